// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelSplatter
 * @brief   settings, engine and statistics of depth-of-field surface splatting
 *
 * The settings of a picture and what was measured while it was made. A vtkSurfelSplattingPass and a
 * vtkSurfelImageRenderer each hold one (GetSplatter()): the same core, the same pixels.
 *
 * Method: J. Krivanek, J. Zara, K. Bouatouch, "Fast Depth of Field Rendering with Surface
 * Splatting", Computer Graphics International 2003. Formulas, with their equation numbers, are in
 * Core.
 *
 * @sa vtkSurfelSplattingPass vtkSurfelImageRenderer vtkSurfelMapper
 */
#ifndef vtkSurfelSplatter_h
#define vtkSurfelSplatter_h

#include "vtkObject.h"
#include "vtkSmartPointer.h"          // for the scene
#include "vtkSurfelRenderingModule.h" // for export macro

#include <chrono>     // for the stages' times
#include <functional> // for progress
#include <memory>     // for the implementation
#include <vector>     // for the scene

class vtkActor;
class vtkCamera;
class vtkImageData;
class vtkLightCollection;
class vtkMatrix4x4;
class vtkMultiProcessController;
class vtkSurfelMapper;
class vtkProp;
class vtkProperty;

namespace SurfelSplatting
{
struct Lens;
struct DepthImage;
class DepthImageSurfels;
class Ranks;
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
    LENS_CAMERA = 0,             ///< vtkCamera's FocalDisk and FocalDistance
    LENS_PINHOLE = 1,            ///< everything sharp, whatever the camera says
    LENS_CIRCLE_OF_CONFUSION = 2 ///< a lens given by its blur at infinity, in pixels
  };

  ///@{
  /**
   * Which lens to see through. Default LENS_CAMERA: vtkCamera::FocalDisk is the diameter of the
   * lens in world units (0: pinhole) and vtkCamera::FocalDistance the distance in focus along the
   * view direction (0: the distance to the focal point), as in VTK's ray tracers. Note that a
   * vtkCamera comes with a FocalDisk of 1. Parallel projection has no lens: everything is sharp.
   */
  vtkSetClampMacro(LensMode, int, LENS_CAMERA, LENS_CIRCLE_OF_CONFUSION);
  vtkGetMacro(LensMode, int);
  void SetLensModeToCamera() { this->SetLensMode(LENS_CAMERA); }
  void SetLensModeToPinhole() { this->SetLensMode(LENS_PINHOLE); }
  void SetLensModeToCircleOfConfusion() { this->SetLensMode(LENS_CIRCLE_OF_CONFUSION); }
  ///@}

  enum FocusModes
  {
    FOCUS_CAMERA = 0, ///< vtkCamera's FocalDistance
    FOCUS_POINT = 1   ///< the plane through FocusPoint, wherever the camera goes
  };

  ///@{
  /**
   * What is in focus. Default FOCUS_CAMERA. A point behind the camera, or at it, leaves the focus
   * to the camera.
   */
  vtkSetClampMacro(FocusMode, int, FOCUS_CAMERA, FOCUS_POINT);
  vtkGetMacro(FocusMode, int);
  void SetFocusModeToCamera() { this->SetFocusMode(FOCUS_CAMERA); }
  void SetFocusModeToPoint() { this->SetFocusMode(FOCUS_POINT); }
  ///@}

  ///@{
  /**
   * With FOCUS_POINT: world coordinates. Default (0, 0, 0).
   */
  vtkSetVector3Macro(FocusPoint, double);
  vtkGetVector3Macro(FocusPoint, double);
  ///@}

  ///@{
  /**
   * With LENS_CIRCLE_OF_CONFUSION: radius in pixels of the circle of confusion of a point at
   * infinity; the camera still says where the focus is. Pixels of the window: posters
   * (vtkWindowToImageFilter::SetScale) and supersampling keep the look. Default 8, range [0, 1e6].
   */
  vtkSetClampMacro(CircleOfConfusion, double, 0.0, 1e6);
  vtkGetMacro(CircleOfConfusion, double);
  ///@}

  ///@{
  /**
   * In how many cells the lens is divided: each is a smaller lens with a centre of its own, and
   * their pictures are averaged (vtkSurfelSplattingPass: those of all props). 1, the default, is
   * one picture, as in the paper. More is more accurate where things of different depth cover one
   * another, at nearly as many times the frame time; 7 is a good step. Range [1, 65536].
   */
  vtkSetClampMacro(LensCells, int, 1, 65536);
  vtkGetMacro(LensCells, int);
  ///@}

  ///@{
  /**
   * Whether the lens is sampled at as many points, each a pinhole, instead of being divided into
   * cells: multisampling, exact in the limit; some hundred points make a reference. Default off.
   */
  vtkSetMacro(LensPinholes, vtkTypeBool);
  vtkGetMacro(LensPinholes, vtkTypeBool);
  vtkBooleanMacro(LensPinholes, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Whether visibility is told apart for four sectors of each lens cell: what covers one side of
   * the lens does not hide what is seen through the other. 2 to 6 dB more accurate where blurred
   * things cover one another, at up to 3 times the frame time, less where little is blurred; with
   * PEARSON_II only. Default off.
   */
  vtkSetMacro(LensSectors, vtkTypeBool);
  vtkGetMacro(LensSectors, vtkTypeBool);
  vtkBooleanMacro(LensSectors, vtkTypeBool);
  ///@}

  enum KernelTypes
  {
    GAUSSIAN = 0,  ///< Krivanek, Zara, Bouatouch 2003: the disc's closest Gaussian in L2
    PEARSON_II = 1 ///< matched to variance and kurtosis of the disc convolved with the splat
  };

  ///@{
  /**
   * Kernel of a blurred splat. Default PEARSON_II: flat where blur is all, as the uniform disc of a
   * lens is, and the Gaussian where there is none. It is nearer to a ray tracer's lens than the
   * paper's GAUSSIAN at every aperture that was measured (0.1 to 4.6 dB), and smaller, hence
   * faster. In focus both are the same.
   */
  vtkSetClampMacro(Kernel, int, GAUSSIAN, PEARSON_II);
  vtkGetMacro(Kernel, int);
  void SetKernelToGaussian() { this->SetKernel(GAUSSIAN); }
  void SetKernelToPearsonII() { this->SetKernel(PEARSON_II); }
  ///@}

  ///@{
  /**
   * Cut-off c of the resampling kernel, on the Gaussian's exponent: a splat ends where q/2 = c.
   * Larger is smoother and slower. The mass of a splat and the variance of surface and pixel filter
   * do not depend on it. With GAUSSIAN that of the lens grows with it (0.28 C^2 at the default);
   * with PEARSON_II only splats with little blur, which are Gaussians, have a cut-off. Default
   * 2.5, range [1, 20].
   */
  vtkSetClampMacro(Cutoff, double, 1.0, 20.0);
  vtkGetMacro(Cutoff, double);
  ///@}

  ///@{
  /**
   * Variance h of the pixel filter in px^2. Default 1 (Zwicker et al. 2001), range [0.01, 100].
   */
  vtkSetClampMacro(Prefilter, double, 0.01, 100.0);
  vtkGetMacro(Prefilter, double);
  ///@}

  enum LODModes
  {
    LOD_OFF = 0,    ///< every surfel
    LOD_PAPER = 1,  ///< Krivanek, Zara, Bouatouch 2003: circumscribed ellipses, mean colours
    LOD_MOMENTS = 2 ///< nodes with their full covariance and a colour gradient
  };

  ///@{
  /**
   * How surfels with a hierarchy (vtkSurfelHierarchy) are coarsened where blur or the pixel hide
   * it; others are not. Default LOD_MOMENTS.
   */
  vtkSetClampMacro(LODMode, int, LOD_OFF, LOD_MOMENTS);
  vtkGetMacro(LODMode, int);
  void SetLODModeToOff() { this->SetLODMode(LOD_OFF); }
  void SetLODModeToPaper() { this->SetLODMode(LOD_PAPER); }
  void SetLODModeToMoments() { this->SetLODMode(LOD_MOMENTS); }
  ///@}

  ///@{
  /**
   * How coarse, relative to each mode's own measure. With LOD_MOMENTS, 1 lets a node's standard
   * deviation be 0.42 of that of the lens's blur or 0.8 of the pixel filter's; with LOD_PAPER, its
   * radius may be that of the circle of confusion, or a pixel. Less is more accurate and slower.
   * Default 1, range [0, 100].
   */
  vtkSetClampMacro(LODError, double, 0.0, 100.0);
  vtkGetMacro(LODError, double);
  ///@}

  ///@{
  /**
   * Work that cannot be seen and is skipped, for surfels with a hierarchy: what is outside of the
   * picture and cannot blur into it, and one-sided surfels seen from behind. Default on; the
   * pictures are the same.
   */
  vtkSetMacro(FrustumCulling, vtkTypeBool);
  vtkGetMacro(FrustumCulling, vtkTypeBool);
  vtkBooleanMacro(FrustumCulling, vtkTypeBool);
  vtkSetMacro(BackfaceCulling, vtkTypeBool);
  vtkGetMacro(BackfaceCulling, vtkTypeBool);
  vtkBooleanMacro(BackfaceCulling, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Whether what lies behind opaque layers is skipped: a tile of the picture is finished when less
   * than 1/512 shines through it everywhere, and nodes of a hierarchy are set up only when a tile
   * that is not needs them. Default on; pictures differ by at most 1/512.
   */
  vtkSetMacro(OcclusionCulling, vtkTypeBool);
  vtkGetMacro(OcclusionCulling, vtkTypeBool);
  vtkBooleanMacro(OcclusionCulling, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Whether wide splats are drawn on grids of larger cells and interpolated, so that time follows
   * the number of splats instead of their area. Default on; costs less than 0.1 dB.
   */
  vtkSetMacro(CoarseGrids, vtkTypeBool);
  vtkGetMacro(CoarseGrids, vtkTypeBool);
  vtkBooleanMacro(CoarseGrids, vtkTypeBool);
  ///@}

  ///@{
  /**
   * The processes that make one picture of the surfels of all of them, each with some of its own or
   * none. Every Render is then a collective call, with the same settings, camera and size on all;
   * splats are sent to where they lie on the screen, and the picture is process 0's: that of all
   * surfels in one process. Each process has a hierarchy of its own, so that with a level of detail
   * nodes at their borders differ. The other processes' outputs are 0. DeepSamples and Channels are
   * left out. Default none.
   */
  void SetController(vtkMultiProcessController* controller);
  vtkMultiProcessController* GetController();
  ///@}

  ///@{
  /**
   * Whether the last picture is kept where neither scene, camera nor settings have changed. Default
   * on.
   */
  vtkSetMacro(FrameReuse, vtkTypeBool);
  vtkGetMacro(FrameReuse, vtkTypeBool);
  vtkBooleanMacro(FrameReuse, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Whether the picture keeps its layers: GetOutput() then has deep samples too. The frame takes up
   * to twice as long, and longer through many cells of the lens. Default off.
   */
  vtkSetMacro(DeepSamples, vtkTypeBool);
  vtkGetMacro(DeepSamples, vtkTypeBool);
  vtkBooleanMacro(DeepSamples, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Whether light is added up instead of colours: byte colours (lookup tables' as well) and those
   * of properties are taken for sRGB codes, float colours for light. GetOutput() is linear light
   * then; a window shows its codes again, and what it held before is mixed as light, too. Bright
   * points keep their strength as they blur. Default off: colours are mixed as they are.
   */
  vtkSetMacro(LinearLight, vtkTypeBool);
  vtkGetMacro(LinearLight, vtkTypeBool);
  vtkBooleanMacro(LinearLight, vtkTypeBool);
  ///@}

  enum PixelChannels
  {
    CHANNEL_NORMAL = 1,              ///< mean normal of what is seen, of unit length, in the world
    CHANNEL_CIRCLE_OF_CONFUSION = 2, ///< radius at "Depth", px; negative before the focus
    CHANNEL_COVERAGE = 4,            ///< by surfels of whatever opacity, [0, 1]
    CHANNEL_FRAGMENTS = 8,           ///< of splats, hidden ones too, over all cells of the lens
    CHANNEL_LEVEL = 16,              ///< of the hierarchy, mean of what is seen: 0 surfels, 1 nodes
                                     ///< of 2, ...; -1 where nothing is seen
    ALL_CHANNELS = 31
  };

  ///@{
  /**
   * What else GetOutput() holds of each pixel, PixelChannels added up: float point arrays "Normal",
   * "CircleOfConfusion", "Coverage", "Fragments" and "Level". Normals, coverage and fragments take
   * a further frame together, levels another one. Default 0: none.
   */
  vtkSetClampMacro(Channels, int, 0, ALL_CHANNELS);
  vtkGetMacro(Channels, int);
  ///@}

  ///@{
  /**
   * Draw each surfel and node in the colour of its level instead of its own: white the surfels
   * themselves, then blue, green, yellow, orange, red, violet and brown for nodes of 2, 4, 8, ...
   * surfels (figure 5 of the paper). Default off.
   */
  vtkSetMacro(ColorByLevel, vtkTypeBool);
  vtkGetMacro(ColorByLevel, vtkTypeBool);
  vtkBooleanMacro(ColorByLevel, vtkTypeBool);
  ///@}

  ///@{
  /**
   * What the last frame held: surfels handed in (of a hierarchy its leaves), those with non-finite
   * values (not drawn), splats that touched the picture, of these those that the lens blurred (0
   * for a pinhole), and fragments (evaluations inside the support of a kernel).
   */
  vtkIdType GetNumberOfSurfels();
  vtkIdType GetNumberOfInvalidSurfels();
  vtkIdType GetNumberOfSplats();
  vtkIdType GetNumberOfBlurredSplats();
  vtkIdType GetNumberOfFragments();
  ///@}

  ///@{
  /**
   * What the hierarchies spared the last frame: nodes and surfels that were chosen, entries of
   * their tables that were looked at (one for 64 surfels, and those above), surfels skipped outside
   * of the picture and seen from behind, chosen nodes and pairs of splat and tile skipped behind
   * opaque layers, and cells of coarse grids that went into the picture.
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
   * Work beyond the frame itself: surfels whose hierarchy's table or colours were made in the last
   * frame (0 unless the data or its colours have changed), and frames that were kept, since
   * nothing had changed, from the beginning.
   */
  vtkGetMacro(NumberOfPreparedSurfels, vtkIdType);
  vtkGetMacro(NumberOfReusedFrames, vtkIdType);
  ///@}

  ///@{
  /**
   * Wall-clock time in milliseconds of the last frame: the stages by name, and all of it.
   */
  int GetNumberOfStages();
  const char* GetStageName(int stage);
  double GetStageMilliseconds(int stage);
  vtkGetMacro(FrameMilliseconds, double);
  ///@}

  /**
   * The last picture: point array "Color" (scalars; float RGBA, premultiplied, linear, alpha =
   * coverage, no background) and "Depth" (float; distance along the view direction, 0 where the
   * alpha stays below one half). Row 0 is the bottom. Field data: "WorldToCamera" (16 doubles, row
   * by row) and "CameraLens" (focal length in pixels; diameter of the lens and distance in focus in
   * world units). With DeepSamples also the point array "SampleCount" (unsigned int) and the field
   * data array "DeepSamples" (float; R, G, B, premultiplied, A and depth as above of each sample),
   * pixel after pixel, nearest first: vtkDeepEXRWriter's input.
   */
  vtkImageData* GetOutput();

#ifndef __VTK_WRAP__
  /// One actor of the scene: its mapper, where it stands and its property.
  struct Item
  {
    vtkSmartPointer<vtkSurfelMapper> Mapper;
    vtkSmartPointer<vtkMatrix4x4> Matrix;
    vtkSmartPointer<vtkProperty> Property;
  };

  /// Adds the surfel actors that a prop consists of (assemblies are searched) to the items, where
  /// visible.
  static void CollectItems(vtkProp* prop, std::vector<Item>& items);

  /// What to render, and how it is seen.
  struct View
  {
    vtkCamera* Camera = nullptr;
    vtkLightCollection* Lights = nullptr;
    int Size[2] = { 0, 0 };             ///< px
    double Aspect = 1.0;                ///< width / height as the camera is to see it
    double ClippingRange[2] = { 0, 1 }; ///< surfels with centres outside are not drawn; world units
    double Oversampling = 1.0;          ///< pixels of this picture per pixel of the window
    double Coarsening = 1.0;            ///< factor on the LODError, to hold a frame rate
    const float* OccluderDepth =
      nullptr; ///< [height][width] distances along the view direction of
               ///< what others have drawn, infinity where nothing; or null
    const SurfelSplatting::DepthImage* Others = nullptr; ///< what others have drawn and is
                                                         ///< blurred too; or null: it stays sharp
    int CellCount = 0; ///< > 0: the camera's own lens is one of so many cells of that of the
                       ///< settings
    std::function<bool(double)> Progress; ///< is told the share of the lens's cells that are done;
                                          ///< false: stop, with the mean so far; may be empty
  };

  /**
   * Renders a picture into GetOutput(). False, and an empty output, where memory does not suffice.
   * With a controller: on all of its processes, or on none; OccluderDepth and Others are process
   * 0's.
   */
  bool Render(const std::vector<Item>& items, const View& view);

  /// The controller's processes; null where there is but this one.
  SurfelSplatting::Ranks* GetRanks();

  /// Collective with a controller: whether all processes' pictures have the same size; an error if
  /// not.
  bool HasOneSize(const int size[2]);

  /// Whether a camera's lens blurs anything.
  bool HasLens(vtkCamera* camera);

  /// The lens that a view is seen through.
  SurfelSplatting::Lens GetLens(const View& view);

  /// How far outside a picture, px, is what blurs into it, of things between two distances.
  int GetMargin(const View& view, const double distances[2]);

  /// Pixels of others that the last picture shows through the lens instead of where they were
  /// drawn.
  const SurfelSplatting::DepthImageSurfels& GetTakenPixels();
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
  vtkTypeBool LensSectors = 0;
  int Kernel = PEARSON_II;
  double Cutoff = 2.5;
  double Prefilter = 1.0;
  int LODMode = LOD_MOMENTS;
  double LODError = 1.0;
  vtkTypeBool FrustumCulling = 1;
  vtkTypeBool BackfaceCulling = 1;
  vtkTypeBool OcclusionCulling = 1;
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
  void RenderPicture(const std::vector<Item>& items, const View& view);
  void MakeContext(const View& view);
  const float* TakePixels(const View& view, std::vector<SurfelSplatting::SurfelCloud>& clouds);
  void MakeScene(const std::vector<Item>& items, const View& view, SceneClouds& scene);
  void ShareScene(const View& view, bool good, SceneClouds& scene);
  bool RenderScene(const std::vector<Item>& items, const View& view,
    const std::chrono::steady_clock::time_point& start);
#endif

  struct Internals;
  std::unique_ptr<Internals> Internal;
};

#endif
