// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelSplatter
 * @brief   renders surfels with depth of field; holds the settings and statistics
 *
 * This class is the renderer behind vtkSurfelSplattingPass and vtkSurfelImageRenderer. Each of them
 * owns one (GetSplatter()), so that both have the same settings and make the same pixels. After a
 * picture it tells what the picture held and how long it took.
 *
 * Method: J. Krivanek, J. Zara, K. Bouatouch, "Fast Depth of Field Rendering with Surface
 * Splatting", Computer Graphics International 2003. The formulas, with their equation numbers, are
 * in Core.
 *
 * @sa vtkSurfelSplattingPass vtkSurfelImageRenderer vtkSurfelMapper
 */
#ifndef vtkSurfelSplatter_h
#define vtkSurfelSplatter_h

#include "vtkObject.h"
#include "vtkSurfelRenderingModule.h" // for export macro

#include <chrono> // for the stages' times
#include <memory> // for the implementation
#include <vector> // for the scene

class vtkCamera;
class vtkImageData;
class vtkMultiProcessController;
class vtkProp;

namespace SurfelSplatting
{
class DepthImageSurfels;
class FrameKey;
class Ranks;
struct SceneItem;
struct SceneView;
struct SurfelCloud;
}

class VTKSURFELRENDERING_EXPORT vtkSurfelSplatter : public vtkObject
{
public:
  static vtkSurfelSplatter* New();
  vtkTypeMacro(vtkSurfelSplatter, vtkObject);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum LensModes
  {
    LENS_CAMERA = 0,             ///< the lens of vtkCamera: FocalDisk and FocalDistance
    LENS_PINHOLE = 1,            ///< everything is sharp, whatever the camera's lens
    LENS_CIRCLE_OF_CONFUSION = 2 ///< a lens given by its blur at infinity, in pixels
  };

  ///@{
  /**
   * The lens that the scene is seen through. With LENS_CAMERA, vtkCamera::FocalDisk is the diameter
   * of the lens in world units (0: pinhole) and vtkCamera::FocalDistance the distance in focus
   * along the view direction (0: the distance to the focal point), as in VTK's ray tracers. Note
   * that a new vtkCamera has a FocalDisk of 1. Parallel projection has no lens: everything is
   * sharp. Default LENS_CAMERA.
   */
  vtkSetClampMacro(LensMode, int, LENS_CAMERA, LENS_CIRCLE_OF_CONFUSION);
  vtkGetMacro(LensMode, int);
  void SetLensModeToCamera() { this->SetLensMode(LENS_CAMERA); }
  void SetLensModeToPinhole() { this->SetLensMode(LENS_PINHOLE); }
  void SetLensModeToCircleOfConfusion() { this->SetLensMode(LENS_CIRCLE_OF_CONFUSION); }
  ///@}

  enum FocusModes
  {
    FOCUS_CAMERA = 0, ///< the camera's FocalDistance
    FOCUS_POINT = 1,  ///< the plane through FocusPoint, wherever the camera moves
    FOCUS_MIDDLE = 2  ///< the surface in the middle of the picture
  };

  ///@{
  /**
   * What is in focus. If FocusPoint is not in front of the camera, the camera's FocalDistance is
   * used. FOCUS_MIDDLE is for programs whose users have not chosen yet: each frame with a lens is
   * in focus where a photographer would focus, on the front of the surfels in its middle, which a
   * small picture without lens finds first; on the camera's FocalDistance if that is above 0, or if
   * no surfels are seen. Default FOCUS_CAMERA.
   */
  vtkSetClampMacro(FocusMode, int, FOCUS_CAMERA, FOCUS_MIDDLE);
  vtkGetMacro(FocusMode, int);
  void SetFocusModeToCamera() { this->SetFocusMode(FOCUS_CAMERA); }
  void SetFocusModeToPoint() { this->SetFocusMode(FOCUS_POINT); }
  void SetFocusModeToMiddle() { this->SetFocusMode(FOCUS_MIDDLE); }
  ///@}

  ///@{
  /**
   * The point in focus with FOCUS_POINT, in world coordinates. Default (0, 0, 0).
   */
  vtkSetVector3Macro(FocusPoint, double);
  vtkGetVector3Macro(FocusPoint, double);
  ///@}

  ///@{
  /**
   * Blur radius of very distant points with LENS_CIRCLE_OF_CONFUSION, in pixels; nearer things blur
   * less. The focus is as set by FocusMode. The unit is a pixel of the window, so that posters
   * (vtkWindowToImageFilter::SetScale) and supersampling keep the look. Default 8, range [0, 1e6].
   */
  vtkSetClampMacro(CircleOfConfusion, double, 0.0, 1e6);
  vtkGetMacro(CircleOfConfusion, double);
  ///@}

  ///@{
  /**
   * Number of cells that the lens is divided into. Each cell is a smaller lens with its own centre;
   * their pictures are averaged (vtkSurfelSplattingPass averages those of all props). One cell
   * gives one picture, as in the paper. More cells are more accurate where things at different
   * depths cover one another; up to nine are drawn in tiles with such places only, and
   * multiply the time of these. More, or with channels or deep samples, are drawn everywhere. 7 is
   * a good choice. A pass that holds an update rate draws one picture while that is above one
   * frame per second (vtkSurfelSplattingPass::HoldUpdateRate). Default 1, range [1, 65536].
   */
  vtkSetClampMacro(LensCells, int, 1, 65536);
  vtkGetMacro(LensCells, int);
  ///@}

  ///@{
  /**
   * Whether LensCells is a number of points of the lens, each a pinhole, instead of cells. This is
   * multisampling, exact in the limit; some hundred points make a reference. Default off.
   */
  vtkSetMacro(LensPinholes, vtkTypeBool);
  vtkGetMacro(LensPinholes, vtkTypeBool);
  vtkBooleanMacro(LensPinholes, vtkTypeBool);
  ///@}

  enum KernelTypes
  {
    GAUSSIAN = 0,  ///< Krivanek, Zara, Bouatouch 2003: the Gaussian closest to the disc in L2
    PEARSON_II = 1 ///< has variance and kurtosis of the disc convolved with the splat
  };

  ///@{
  /**
   * The kernel of a blurred splat. PEARSON_II is flat, like the uniform disc of a lens, if the blur
   * is wide, and a bell of nearly the Gaussian's kurtosis without blur. At every aperture that was
   * measured it is closer to a ray tracer's lens than the paper's GAUSSIAN (by 0.1 to 4.6 dB). It
   * ends in zero, so that nothing jumps in motion, and is faster where much is blurred. Default
   * PEARSON_II.
   */
  vtkSetClampMacro(Kernel, int, GAUSSIAN, PEARSON_II);
  vtkGetMacro(Kernel, int);
  void SetKernelToGaussian() { this->SetKernel(GAUSSIAN); }
  void SetKernelToPearsonII() { this->SetKernel(PEARSON_II); }
  ///@}

  ///@{
  /**
   * Cut-off c of the GAUSSIAN kernel, on its exponent: a splat ends where q/2 = c. A larger cut-off
   * is smoother and slower. It changes neither the mass of a splat nor the variance of surface
   * kernel and pixel filter; the variance of the lens grows with it (0.28 C^2 at the default).
   * Default 2.5, range [1, 20].
   */
  vtkSetClampMacro(Cutoff, double, 1.0, 20.0);
  vtkGetMacro(Cutoff, double);
  ///@}

  ///@{
  /**
   * Variance h of the Gaussian pixel filter in px^2. Default 1 (Zwicker et al. 2001), range [0.01,
   * 100].
   */
  vtkSetClampMacro(Prefilter, double, 0.01, 100.0);
  vtkGetMacro(Prefilter, double);
  ///@}

  ///@{
  /**
   * Whether Gaussians of captures keep their mass when the pixel filter widens them: what is
   * smaller than a pixel becomes fainter (Yu et al., Mip-Splatting, 2024) instead of growing, as it
   * does in the published method that captures are trained with (Kerbl et al. 2023). Good for
   * captures that were trained so, and for captures seen from afar. Volumes always keep it.
   * Default off.
   */
  vtkSetMacro(KeepCaptureMass, vtkTypeBool);
  vtkGetMacro(KeepCaptureMass, vtkTypeBool);
  vtkBooleanMacro(KeepCaptureMass, vtkTypeBool);
  ///@}

  enum LODModes
  {
    LOD_OFF = 0,    ///< all surfels are drawn
    LOD_PAPER = 1,  ///< Krivanek, Zara, Bouatouch 2003: circumscribed ellipses, mean colours
    LOD_MOMENTS = 2 ///< nodes with their full covariance and a colour gradient
  };

  ///@{
  /**
   * How surfels with a hierarchy (vtkSurfelHierarchy) are replaced by coarser nodes where blur or
   * the pixel size hides the difference. Other surfels are all drawn. Default LOD_MOMENTS.
   */
  vtkSetClampMacro(LODMode, int, LOD_OFF, LOD_MOMENTS);
  vtkGetMacro(LODMode, int);
  void SetLODModeToOff() { this->SetLODMode(LOD_OFF); }
  void SetLODModeToPaper() { this->SetLODMode(LOD_PAPER); }
  void SetLODModeToMoments() { this->SetLODMode(LOD_MOMENTS); }
  ///@}

  ///@{
  /**
   * Factor e on the error that the level of detail allows; smaller is more accurate and slower.
   * With LOD_MOMENTS, the variance of a node on the screen is at most e^2 (0.84^2 h + 0.37^2 V) for
   * the pixel filter's variance h and the lens blur's variance V, px^2; 0.90 and 0.37 for captures
   * and volumes. With LOD_PAPER, the radius of a node is at most e times the larger one of the
   * circle of confusion and sqrt(h). Default 1, range [0, 100].
   */
  vtkSetClampMacro(LODError, double, 0.0, 100.0);
  vtkGetMacro(LODError, double);
  ///@}

  ///@{
  /**
   * Whether to draw wide splats on coarse grids and interpolate, so that time depends on the number
   * of splats instead of their area. Pictures are as near to a ray tracer's as without them.
   * Default on.
   */
  vtkSetMacro(CoarseGrids, vtkTypeBool);
  vtkGetMacro(CoarseGrids, vtkTypeBool);
  vtkBooleanMacro(CoarseGrids, vtkTypeBool);
  ///@}

  ///@{
  /**
   * The processes that render one picture together, each with its own surfels or none. Every Render
   * is then a collective call with the same settings, camera and size on all processes. Splats are
   * sent to the processes that own their part of the screen. Process 0 gets the picture, as if it
   * had all surfels; the output of the others is 0 everywhere. Each process has its own hierarchy:
   * with a level of detail, nodes at the borders differ. DeepSamples and Channels are not
   * supported. Default none.
   */
  void SetController(vtkMultiProcessController* controller);
  vtkMultiProcessController* GetController();
  ///@}

  ///@{
  /**
   * Whether to keep the last picture if neither scene, camera nor settings have changed. Default
   * on.
   */
  vtkSetMacro(FrameReuse, vtkTypeBool);
  vtkGetMacro(FrameReuse, vtkTypeBool);
  vtkBooleanMacro(FrameReuse, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Whether to keep the layers of the picture as deep samples in GetOutput(). The frame takes up to
   * twice as long, and longer with many lens cells. Default off.
   */
  vtkSetMacro(DeepSamples, vtkTypeBool);
  vtkGetMacro(DeepSamples, vtkTypeBool);
  vtkBooleanMacro(DeepSamples, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Whether colours are converted from sRGB to linear light first, so that bright points keep their
   * strength when they are blurred. Byte colours (also from lookup tables) and property colours are
   * converted; float colours are taken as light, and so are harmonics, which makes captures too
   * bright: their Gaussians are made to be mixed as they are stored. GetOutput() is then linear
   * light. In a window the result is converted back to sRGB, and what was drawn before is also
   * mixed as light. Default off: colours are mixed as they are.
   */
  vtkSetMacro(LinearLight, vtkTypeBool);
  vtkGetMacro(LinearLight, vtkTypeBool);
  vtkBooleanMacro(LinearLight, vtkTypeBool);
  ///@}

  enum PixelChannels
  {
    CHANNEL_NORMAL = 1,              ///< unit mean normal of the visible surfels, world
                                     ///< coordinates; 0 for Gaussians in space
    CHANNEL_CIRCLE_OF_CONFUSION = 2, ///< radius at "Depth", px; negative in front of the focus
    CHANNEL_COVERAGE = 4,            ///< share covered by surfels, regardless of opacity, [0, 1]
    CHANNEL_FRAGMENTS = 8,           ///< number of fragments, hidden ones too, in all lens cells
    CHANNEL_LEVEL = 16,        ///< mean level in the hierarchy of the visible nodes: 0 for surfels,
                               ///< 1 for nodes of 2, ...; -1 where nothing is seen
    CHANNEL_MEDIAN_DEPTH = 32, ///< of what the whole lens sees, the depth at which half of alpha is
                               ///< reached, however small that is; 0 where nothing is seen
    ALL_CHANNELS = 63
  };

  ///@{
  /**
   * Further float point arrays of GetOutput(), a sum of PixelChannels: "Normal",
   * "CircleOfConfusion", "Coverage", "Fragments", "Level" and "MedianDepth". Normals, coverage
   * and fragments together take the time of one more frame, levels and median depths of one more
   * each. Default 0: none. Range [0, ALL_CHANNELS].
   */
  vtkSetClampMacro(Channels, int, 0, ALL_CHANNELS);
  vtkGetMacro(Channels, int);
  ///@}

  ///@{
  /**
   * Whether to draw each surfel and node in the colour of its level instead of its own: white for
   * surfels, then blue, green, yellow, orange, red, violet and brown for nodes of 2, 4, 8, ...
   * surfels (figure 5 of the paper). Default off.
   */
  vtkSetMacro(ColorByLevel, vtkTypeBool);
  vtkGetMacro(ColorByLevel, vtkTypeBool);
  vtkBooleanMacro(ColorByLevel, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Counts of the last frame: surfels of the scene (a hierarchy counts its leaves), surfels with
   * non-finite values (not drawn), splats that touched the picture, those of them that the lens
   * blurred (0 for a pinhole), and fragments (evaluations inside the support of a kernel).
   */
  vtkIdType GetNumberOfSurfels();
  vtkIdType GetNumberOfInvalidSurfels();
  vtkIdType GetNumberOfSplats();
  vtkIdType GetNumberOfBlurredSplats();
  vtkIdType GetNumberOfFragments();
  ///@}

  ///@{
  /**
   * Counts of the hierarchies in the last frame: nodes and surfels that were chosen; clusters that
   * were tested (one for each 64 surfels, and the nodes above); surfels skipped because they are
   * outside the picture or seen from behind; chosen nodes, and pairs of splat and tile, skipped
   * behind opaque layers; and cells of coarse grids that went into the picture.
   */
  vtkIdType GetNumberOfChosenNodes();
  vtkIdType GetNumberOfVisitedNodes();
  vtkIdType GetNumberOfSurfelsOutside();
  vtkIdType GetNumberOfSurfelsFacingAway();
  vtkIdType GetNumberOfHiddenSurfels();
  vtkIdType GetNumberOfHiddenPairs();
  vtkIdType GetNumberOfCoarseCells();
  ///@}

  ///@{
  /**
   * NumberOfPreparedSurfels: surfels for whose hierarchy bounds or colours were computed in the
   * last frame (0 unless the data or its colours have changed). NumberOfReusedFrames: frames, since
   * this object was created, that reused the last picture because nothing had changed.
   */
  vtkGetMacro(NumberOfPreparedSurfels, vtkIdType);
  vtkGetMacro(NumberOfReusedFrames, vtkIdType);
  ///@}

  ///@{
  /**
   * Wall-clock time of the last frame in milliseconds: of each stage, [0, GetNumberOfStages()),
   * with its name, and of the whole frame. For other stages the name is null and the time 0.
   */
  int GetNumberOfStages();
  const char* GetStageName(int stage);
  double GetStageMilliseconds(int stage);
  vtkGetMacro(FrameMilliseconds, double);
  ///@}

  /**
   * The distance, along the view direction, to what FOCUS_MIDDLE would focus on in a picture such
   * as GetOutput(), by its "MedianDepth", or else its "Depth"; 0 if it is empty. Of a small picture
   * without lens: of a large one single points count.
   */
  static double FindFront(vtkImageData* picture);

  /**
   * The last picture. Row 0 is the bottom row. Its point arrays are "Color" (scalars; float RGBA,
   * premultiplied, without background; alpha is the coverage), "Depth" (float; distance along the
   * view direction, 0 where alpha stays below one half) and those of Channels. Its field data have
   * the camera and the lens. With DeepSamples it is the input of vtkDeepEXRWriter.
   * Documentation/DataContract.md describes all arrays.
   */
  vtkImageData* GetOutput();

#ifndef __VTK_WRAP__
  using SceneItems = std::vector<SurfelSplatting::SceneItem>;
  using SceneView = SurfelSplatting::SceneView;

  /// Adds the visible surfel actors of a prop, including the parts of assemblies.
  static void CollectItems(vtkProp* prop, SceneItems& items);

  /// Computes Projection and Optics of a view from its other members, the settings and, with
  /// FOCUS_MIDDLE, what is seen. Call once a frame, before Render. Collective with a controller.
  void CompleteView(SceneView& view, const SceneItems& items);

  /**
   * Renders a picture into GetOutput(). Returns false with an empty output if there is not enough
   * memory. With a controller, either all of its processes succeed or none; OccluderDepth and
   * PropImage of the view are then read on process 0.
   */
  bool Render(const SceneItems& items, const SceneView& view);

  /// Whether GetOutput() is the picture of a view with a PropStamp, which Render would keep.
  bool HasPicture(const SceneItems& items, const SceneView& view);

  /// The processes of the controller; null if there is only this one.
  SurfelSplatting::Ranks* GetRanks();

  /// Collective with a controller. Whether the pictures of all processes have the same size, px;
  /// reports an error if not.
  bool HasOneSize(const int size[2]);

  /// Whether the lens of a camera blurs anything.
  bool HasLens(vtkCamera* camera);

  /// Pixels of other props that the last picture shows as splats through the lens.
  const SurfelSplatting::DepthImageSurfels& GetBlurredPixels();
#endif

protected:
  vtkSurfelSplatter();
  ~vtkSurfelSplatter() override;

private:
  vtkSurfelSplatter(const vtkSurfelSplatter&) = delete;
  void operator=(const vtkSurfelSplatter&) = delete;

  int LensMode = LENS_CAMERA;
  int FocusMode = FOCUS_CAMERA;
  double FocusPoint[3] = { 0.0, 0.0, 0.0 };
  double CircleOfConfusion = 8.0;
  int LensCells = 1;
  vtkTypeBool LensPinholes = 0;
  int Kernel = PEARSON_II;
  double Cutoff = 2.5;
  double Prefilter = 1.0;
  vtkTypeBool KeepCaptureMass = false;
  int LODMode = LOD_MOMENTS;
  double LODError = 1.0;
  vtkTypeBool CoarseGrids = 1;
  vtkTypeBool FrameReuse = 1;
  vtkTypeBool ColorByLevel = 0;
  vtkTypeBool DeepSamples = 0;
  int Channels = 0;
  vtkTypeBool LinearLight = 0;
  double FrameMilliseconds = 0.0;
  vtkIdType NumberOfPreparedSurfels = 0;
  vtkIdType NumberOfReusedFrames = 0;

#ifndef __VTK_WRAP__
  struct SceneClouds;
  void RenderPicture(const SceneItems& items, const SceneView& view);
  void MakeContext(const SceneView& view);
  double FindMiddle(const SceneItems& items, const SceneView& view);
  SurfelSplatting::FrameKey MakeKey(const SceneItems& items, const SceneView& view);
  void MakeClouds(const SceneItems& items, const SceneView& view, SceneClouds& scene);
  void MakeScene(const SceneItems& items, const SceneView& view, SceneClouds& scene);
  bool RenderScene(const SceneItems& items, const SceneView& view,
    const std::chrono::steady_clock::time_point& start);
  void StorePicture(const SceneView& view, SceneClouds& scene);
  void AddChannels(const SceneClouds& scene);
#endif

  struct Internals;
  std::unique_ptr<Internals> Internal;
};

#endif
