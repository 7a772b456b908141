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
   * What splats: several actors may have the same one. Of the actors of a renderer the first one
   * that is drawn has its pass do it for all. Default none: nothing is drawn.
   */
  void SetPass(vtkSurfelSplattingPass* pass);

  ///@{
  /**
   * Whether the actor is taken to reach over all of the view. Compositors of several processes skip
   * those whose props are out of sight, and cut off what is beyond their bounds; but all have to
   * take part in a picture, and blur reaches farther. Default off.
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
   * Flat index of the block that the surfels are of, which hardware selection gives; 0: the data
   * are no composite ones. Default 0.
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
