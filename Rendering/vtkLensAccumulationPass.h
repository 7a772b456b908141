// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkLensAccumulationPass
 * @brief   averages views from points of the lens: depth of field for any props
 *
 * This render pass renders its delegate once for each of NumberOfLensPoints points of the camera's
 * lens (Haeberli and Akeley 1990) and averages the pictures in 32-bit float: meshes, volumes,
 * glyphs and surfels alike. The error to the thin lens falls nearly as 1/N. Some hundred points
 * make a reference and take as many times the time of a frame.
 *
 * The lens is that of vtkCamera, as for vtkSurfelSplatter: FocalDisk is its diameter in world
 * units, FocalDistance the distance in focus along the view direction, 0 the distance to the focal
 * point. With a FocalDisk of 0, in parallel projection or with one point there is one view, through
 * the centre of the lens.
 *
 * Each view is rendered through a copy of the camera that is moved within the plane of the lens.
 * Its window centre is shifted, so that the plane in focus stays in place, and its FocalDisk is 0:
 * a pinhole. vtkSurfelSplatter::LensCells divides the lens for a vtkSurfelSplattingPass, which
 * takes fewer views.
 *
 * The frame buffer keeps the depth of the first view, which is that of the innermost point.
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
   * The pass that renders one view: camera, background and props. Default: a vtkSurfelSplattingPass
   * of its own, which draws surfels among the other props.
   */
  void SetDelegatePass(vtkRenderPass* pass);
  vtkRenderPass* GetDelegatePass();
  ///@}

  ///@{
  /**
   * The number N of views. Default 64, range [1, 65536].
   */
  vtkSetClampMacro(NumberOfLensPoints, int, 1, 65536);
  vtkGetMacro(NumberOfLensPoints, int);
  ///@}

  ///@{
  /**
   * Standard deviation in pixels of a Gaussian pixel filter, made by shifting each view. 1 gives
   * meshes the filter of splats (vtkSurfelSplatter::Prefilter). 0 is no filter, for delegates that
   * filter by themselves. Default 0, range [0, 10].
   */
  vtkSetClampMacro(PixelFilter, double, 0.0, 10.0);
  vtkGetMacro(PixelFilter, double);
  ///@}

  ///@{
  /**
   * Whether colours are converted from sRGB to linear light before they are averaged
   * (vtkSurfelSplatter::LinearLight). Default off.
   */
  vtkSetMacro(LinearLight, vtkTypeBool);
  vtkGetMacro(LinearLight, vtkTypeBool);
  vtkBooleanMacro(LinearLight, vtkTypeBool);
  ///@}

  /**
   * The time of the last change of the settings, including those of the delegate.
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
  double PixelFilter = 0.0;
  vtkTypeBool LinearLight = 0;

  struct Internals;
  std::unique_ptr<Internals> Internal;
};

#endif
