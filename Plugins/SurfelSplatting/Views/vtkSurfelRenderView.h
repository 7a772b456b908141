// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelRenderView
 * @brief   a render view that draws everything through one lens
 *
 * Its renderer's pass is a vtkSurfelSplattingPass: all surfels in one A-buffer, and meshes blurred
 * as they are. Lens: Camera Focal Disk and Camera Focal Distance.
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
class vtkSurfelMapper;
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
   * What is in focus: 0 the camera's focal distance, 1 a point, 2 the view's centre of rotation.
   * Default 0.
   */
  void SetFocusMode(int mode);
  void SetFocusPoint(double x, double y, double z);
  ///@}

  ///@{
  /**
   * Forwarded to the pass and its vtkSurfelSplatter: see there.
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
  vtkNew<vtkSurfelViewActor> Frame; // nothing, but as wide as the view: blur has no bounds
  vtkNew<vtkSurfelMapper> NoSurfels;
  std::unique_ptr<SurfelViews::Focus> Sharp;
};

#endif
