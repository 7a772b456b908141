// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkLensAccumulationPass
 * @brief   depth of field for any props: the mean of views from points of the lens
 *
 * Renders its delegate once for each of NumberOfLensPoints points of the camera's lens (Haeberli
 * and Akeley 1990) and averages the pictures in 32-bit float: meshes, volumes, glyphs and surfels
 * alike. It converges to the thin lens as nearly 1/N; some hundred points make a reference, at as
 * many times the cost of a frame.
 *
 * The lens is vtkCamera's, as for vtkSurfelSplatter: FocalDisk is its diameter in world units,
 * FocalDistance the distance in focus along the view direction, 0 the distance to the focal point.
 * With a FocalDisk of 0, in parallel projection and with one point there is one view, through the
 * middle of the lens.
 *
 * Each view is rendered through a copy of the camera that is moved within the plane of the lens and
 * whose window centre is shifted, so that the plane in focus stays where it is; its FocalDisk is 0:
 * a pinhole. With DelegateBlurs a delegate that blurs by itself, vtkSurfelSplattingPass, gets a
 * cell of the lens instead of a point, FocalDisk / sqrt(N), as with vtkSurfelSplatter::LensCells.
 *
 * The depth that is left in the frame buffer is that of the first view, the innermost point's.
 *
 * @sa vtkSurfelSplattingPass vtkSurfelSplatter
 */
#ifndef vtkLensAccumulationPass_h
#define vtkLensAccumulationPass_h

#include "vtkRenderPass.h"
#include "vtkSmartPointer.h"          // for members
#include "vtkSurfelRenderingModule.h" // for export macro

#include <memory> // for the implementation

class VTKSURFELRENDERING_EXPORT vtkLensAccumulationPass : public vtkRenderPass
{
public:
  static vtkLensAccumulationPass* New();
  vtkTypeMacro(vtkLensAccumulationPass, vtkRenderPass);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  void Render(const vtkRenderState* state) override;
  void ReleaseGraphicsResources(vtkWindow* window) override;

  ///@{
  /**
   * Renders one view: camera, background and props. Default: a vtkSurfelSplattingPass of its own,
   * which draws surfels among the other props.
   */
  void SetDelegatePass(vtkRenderPass* pass);
  vtkRenderPass* GetDelegatePass();
  ///@}

  ///@{
  /**
   * Number N of views. Default 64, range [1, 65536].
   */
  vtkSetClampMacro(NumberOfLensPoints, int, 1, 65536);
  vtkGetMacro(NumberOfLensPoints, int);
  ///@}

  ///@{
  /**
   * Whether the delegate blurs through the lens of the camera that it is given
   * (vtkSurfelSplatter::LENS_CAMERA). It then gets N smaller lenses instead of N pinholes. Default
   * off.
   */
  vtkSetMacro(DelegateBlurs, vtkTypeBool);
  vtkGetMacro(DelegateBlurs, vtkTypeBool);
  vtkBooleanMacro(DelegateBlurs, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Standard deviation in pixels of a Gaussian pixel filter, made by shifting each view: 1 is the
   * filter of the splats (vtkSurfelSplatter::Prefilter), for meshes. Default 0: none, for delegates
   * with a filter of their own. Range [0, 10].
   */
  vtkSetClampMacro(PixelFilter, double, 0.0, 10.0);
  vtkGetMacro(PixelFilter, double);
  ///@}

  ///@{
  /**
   * Whether the mean is of light, colours being its sRGB codes
   * (vtkSurfelSplatter::LinearLight). Default off: of the colours as they are.
   */
  vtkSetMacro(LinearLight, vtkTypeBool);
  vtkGetMacro(LinearLight, vtkTypeBool);
  vtkBooleanMacro(LinearLight, vtkTypeBool);
  ///@}

  /**
   * Changes of the delegate count.
   */
  vtkMTimeType GetMTime() override;

protected:
  vtkLensAccumulationPass();
  ~vtkLensAccumulationPass() override;

private:
  vtkLensAccumulationPass(const vtkLensAccumulationPass&) = delete;
  void operator=(const vtkLensAccumulationPass&) = delete;

  vtkSmartPointer<vtkRenderPass> DelegatePass;
  int NumberOfLensPoints = 64;
  vtkTypeBool DelegateBlurs = 0;
  double PixelFilter = 0.0;
  vtkTypeBool LinearLight = 0;

  struct Internals;
  std::unique_ptr<Internals> Internal;
};

#endif
