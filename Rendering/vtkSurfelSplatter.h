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
 * Rendering/Core.
 *
 * @sa vtkSurfelSplattingPass vtkSurfelImageRenderer vtkSurfelMapper
 */
#ifndef vtkSurfelSplatter_h
#define vtkSurfelSplatter_h

#include "vtkObject.h"
#include "vtkSmartPointer.h"          // for the scene
#include "vtkSurfelRenderingModule.h" // for export macro

#include <memory> // for the implementation
#include <vector> // for the scene

class vtkActor;
class vtkCamera;
class vtkImageData;
class vtkLightCollection;
class vtkMatrix4x4;
class vtkSurfelMapper;
class vtkProp;
class vtkProperty;

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

  ///@{
  /**
   * With LENS_CIRCLE_OF_CONFUSION: radius in pixels of the circle of confusion of a point at
   * infinity; the camera still says where the focus is. Pixels of the window: posters
   * (vtkWindowToImageFilter::SetScale) and supersampling keep the look. Default 8, range [0, 1e6].
   */
  vtkSetClampMacro(CircleOfConfusion, double, 0.0, 1e6);
  vtkGetMacro(CircleOfConfusion, double);
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

  ///@{
  /**
   * What the last frame held: surfels handed in, those with non-finite values (not drawn), splats
   * that touched the picture, and fragments (evaluations inside the support of a kernel).
   */
  vtkIdType GetNumberOfSurfels();
  vtkIdType GetNumberOfInvalidSurfels();
  vtkIdType GetNumberOfSplats();
  vtkIdType GetNumberOfFragments();
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
   * alpha stays below one half). Row 0 is the bottom.
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
    const float* DepthLimit = nullptr;  ///< [height][width] distances along the view direction of
                                        ///< what others have drawn, infinity where nothing; or null
  };

  /**
   * Renders a picture into GetOutput(). False, and an empty output, where memory does not suffice.
   */
  bool Render(const std::vector<Item>& items, const View& view);
#endif

protected:
  vtkSurfelSplatter();
  ~vtkSurfelSplatter() override;

private:
  vtkSurfelSplatter(const vtkSurfelSplatter&) = delete;
  void operator=(const vtkSurfelSplatter&) = delete;

  int LensMode = LENS_CAMERA;
  double CircleOfConfusion = 8.0;
  int Kernel = PEARSON_II;
  double Cutoff = 2.5;
  double Prefilter = 1.0;
  double FrameMilliseconds = 0.0;

#ifndef __VTK_WRAP__
  void RenderPicture(const std::vector<Item>& items, const View& view);
#endif

  struct Internals;
  std::unique_ptr<Internals> Internal;
};

#endif
