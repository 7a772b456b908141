// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelRenderView
 * @brief   a render view that draws everything through one lens
 *
 * The view's render pass is a vtkSurfelSplattingPass: all surfels share one A-buffer, and meshes
 * are blurred, too. The lens is set by Camera Focal Disk and Camera Focal Distance.
 */
#ifndef vtkSurfelRenderView_h
#define vtkSurfelRenderView_h

#include "vtkNew.h" // for members
#include "vtkPVRenderView.h"
#include "vtkSurfelViewsModule.h" // for export macro

#include <memory> // for members

namespace SurfelViews
{
struct Focus;
}
class vtkSurfelSplattingPass;
class vtkSurfelViewActor;

class VTKSURFELVIEWS_EXPORT vtkSurfelRenderView : public vtkPVRenderView
{
public:
  static vtkSurfelRenderView* New();
  vtkTypeMacro(vtkSurfelRenderView, vtkPVRenderView);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * What to focus on: 0 the camera's focal distance, 1 a point, 2 the view's centre of rotation, 3
   * the surface in the middle (vtkSurfelSplatter::FOCUS_MIDDLE). Default 3.
   */
  void SetFocusMode(int mode);
  void SetFocusPoint(double x, double y, double z);
  ///@}

  ///@{
  /**
   * Passed on to vtkSurfelSplattingPass and its vtkSurfelSplatter; see there.
   */
  void SetLensMode(int mode);
  void SetCircleOfConfusion(double radius);
  void SetLensCells(int cells);
  void SetLinearLight(int linear);
  void SetOtherPropsThroughLens(int through);
  ///@}

  void Update() override;

protected:
  vtkSurfelRenderView();
  ~vtkSurfelRenderView() override;

  void AboutToRenderOnLocalProcess(bool interactive) override;

private:
  vtkSurfelRenderView(const vtkSurfelRenderView&) = delete;
  void operator=(const vtkSurfelRenderView&) = delete;

  vtkNew<vtkSurfelSplattingPass> Pass;
  vtkNew<vtkSurfelViewActor> EmptyActor; // draws nothing; its bounds may cover the view
  std::unique_ptr<SurfelViews::Focus> Focus;
};

#endif
