// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelViewActor
 * @brief   draws surfels in a view without a vtkSurfelSplattingPass
 *
 * After opaque and translucent props, the first actor of this class splats all visible surfels of
 * the renderer into one A-buffer. Opaque props hide what is behind them; other props stay sharp. In
 * a vtkSurfelRenderView the view's pass splats instead. Hardware selection renders the mapper's
 * dots. A new actor has a mapper without points.
 *
 * @sa vtkSurfelSplattingPass
 */
#ifndef vtkSurfelViewActor_h
#define vtkSurfelViewActor_h

#include "vtkActor.h"
#include "vtkSmartPointer.h"      // for members
#include "vtkSurfelViewsModule.h" // for export macro

class vtkSurfelSplattingPass;

class VTKSURFELVIEWS_EXPORT vtkSurfelViewActor : public vtkActor
{
public:
  static vtkSurfelViewActor* New();
  vtkTypeMacro(vtkSurfelViewActor, vtkActor);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  /**
   * The pass that splats; several actors may share one. The first actor that a renderer draws
   * splats the surfels of all. Default none: nothing is drawn.
   */
  void SetPass(vtkSurfelSplattingPass* pass);

  ///@{
  /**
   * Whether the actor's bounds cover the whole view. Compositors of several processes skip
   * processes whose props are out of view, and cut off what lies beyond their bounds; but all must
   * take part in a picture, and blur extends beyond the bounds. Default off.
   */
  vtkSetMacro(CoversView, bool);
  vtkGetMacro(CoversView, bool);
  ///@}

  using vtkActor::GetBounds;
  double* GetBounds() override;

  /**
   * Draws the mapper's dots.
   */
  void Render(vtkRenderer* renderer, vtkMapper* mapper) override;

  ///@{
  /**
   * Flat index of the surfels' block, for hardware selection; 0: the data are not composite.
   * Default 0.
   */
  vtkSetMacro(CompositeIndex, unsigned int);
  vtkGetMacro(CompositeIndex, unsigned int);
  ///@}

  void ProcessSelectorPixelBuffers(
    vtkHardwareSelector* selector, std::vector<unsigned int>& pixeloffsets) override;

  int RenderOpaqueGeometry(vtkViewport* viewport) override;
  int RenderTranslucentPolygonalGeometry(vtkViewport*) override { return 0; }
  vtkTypeBool HasTranslucentPolygonalGeometry() override { return 0; }
  int RenderVolumetricGeometry(vtkViewport* viewport) override;
  void ReleaseGraphicsResources(vtkWindow* window) override;

protected:
  vtkSurfelViewActor();
  ~vtkSurfelViewActor() override;

private:
  vtkSurfelViewActor(const vtkSurfelViewActor&) = delete;
  void operator=(const vtkSurfelViewActor&) = delete;

  vtkSmartPointer<vtkSurfelSplattingPass> Pass;
  bool CoversView = false;
  unsigned int CompositeIndex = 0;
  double ViewBounds[6];
};

#endif
