// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelViewActor
 * @brief   surfels among the props of a view whose passes know nothing of them
 *
 * Splats all visible surfels of its renderer into one A-buffer, once for all actors of this kind,
 * after opaque and translucent props; what is behind opaque ones is hidden. Other props stay sharp.
 * In a vtkSurfelRenderView the view's pass splats instead.
 * In hardware selection it is the mapper's dots.
 *
 * @sa vtkSurfelSplattingPass
 */
#ifndef vtkSurfelViewActor_h
#define vtkSurfelViewActor_h

#include "vtkActor.h"
#include "vtkNew.h"               // for members
#include "vtkSurfelViewsModule.h" // for export macro

class vtkSurfelSplatter;
class vtkSurfelSplattingPass;

class VTKSURFELVIEWS_EXPORT vtkSurfelViewActor : public vtkActor
{
public:
  static vtkSurfelViewActor* New();
  vtkTypeMacro(vtkSurfelViewActor, vtkActor);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  int RenderOpaqueGeometry(vtkViewport* viewport) override;
  int RenderTranslucentPolygonalGeometry(vtkViewport*) override { return 0; }
  vtkTypeBool HasTranslucentPolygonalGeometry() override { return 0; }
  int RenderVolumetricGeometry(vtkViewport* viewport) override;
  void ReleaseGraphicsResources(vtkWindow* window) override;

  /**
   * Lens, kernel and level of detail. Of several actors in a renderer those of the first one count.
   */
  vtkSurfelSplatter* GetSplatter();

protected:
  vtkSurfelViewActor();
  ~vtkSurfelViewActor() override;

private:
  vtkSurfelViewActor(const vtkSurfelViewActor&) = delete;
  void operator=(const vtkSurfelViewActor&) = delete;

  vtkNew<vtkSurfelSplattingPass> Pass;
};

#endif
