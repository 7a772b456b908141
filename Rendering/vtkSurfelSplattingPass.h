// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelSplattingPass
 * @brief   draws surfels with depth of field among other props
 *
 * This render pass splats all surfel actors of a renderer (vtkActor with a vtkSurfelMapper) into
 * one A-buffer; a delegate draws all other props.
 *
 *   renderer->SetPass(pass);
 *
 * Without a delegate, the pass replaces a whole vtkRenderStepsPass: camera, lights, opaque props,
 * surfels, translucent props (with depth peeling if the renderer uses it), volumes, overlay. It
 * also supports stereo and hardware selection, which VTK's own passes do not. With a delegate, it
 * is the step of opaque props alone, for use in a sequence of passes:
 *
 *   pass->SetDelegatePass(opaquePass); steps->SetOpaquePass(pass); renderer->SetPass(steps);
 *
 * Stages of the step:
 *   1. The delegate draws the other opaque props.
 *   2. Their depth and colour are read back (OpenGL/PropImage.h). What lies behind them is hidden,
 *      layer by layer, and pixels that the lens blurs become splats (OtherPropsThroughLens).
 *   3. To hold an update rate, the level of detail is made coarser (Scene/RateGovernor.h,
 *      HoldUpdateRate).
 *   4. The core splats all surfels (vtkSurfelSplatter.h).
 *   5. The picture is drawn into the frame (OpenGL/FrameBlit.h): colour (RGBA 32-bit float,
 *      premultiplied) is blended over it, and depth (R 32-bit float) is written where the surfels'
 *      alpha passes one half, so that later props are hidden correctly.
 *
 * If vtkSurfelSplatter::LensCells is above 1, other props are shown through the lens, there is no
 * delegate, and neither deep samples nor channels are wanted, then all steps but the overlay are
 * rendered once per cell of the lens and averaged (OpenGL/LensAccumulation.h). Translucent props
 * and volumes are then blurred as well, and what is hidden behind the edges of blurred props is
 * seen. Each cell takes the time of a frame of all props.
 *
 * With a controller (GetSplatter()->SetController()), the renderers of all its processes draw one
 * picture and all have to render. Opaque props are sent to process 0, the nearest of each pixel,
 * and surfels are exchanged as described in vtkSurfelSplatter. The framebuffer of process 0 then
 * holds the picture, with a depth below 1 wherever there is any colour. The others hold only
 * translucent props and volumes that were drawn before, as compositors expect.
 *
 * While neither scene, camera nor settings change (Scene/PropStamp.h), the picture is drawn into
 * the frame again and nothing else (vtkSurfelSplatter::FrameReuse).
 *
 * GetSplatter()->GetOutput() is the float picture of all splats, before it is rounded to the 8 bits
 * of the frame: surfels and blurred pixels of other props. With several cells it is the picture of
 * the last cell.
 *
 * @sa vtkSurfelMapper vtkSurfelSplatter vtkSurfelImageRenderer
 */
#ifndef vtkSurfelSplattingPass_h
#define vtkSurfelSplattingPass_h

#include "vtkNew.h" // for members
#include "vtkRenderPass.h"
#include "vtkSmartPointer.h"          // for members
#include "vtkSurfelRenderingModule.h" // for export macro
#include "vtkSurfelSplatter.h"        // for members

#include <memory> // for the implementation

class vtkRenderer;

namespace SurfelSplatting
{
struct PassFrame;
}

class VTKSURFELRENDERING_EXPORT vtkSurfelSplattingPass : public vtkRenderPass
{
public:
  static vtkSurfelSplattingPass* New();
  vtkTypeMacro(vtkSurfelSplattingPass, vtkRenderPass);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  void Render(const vtkRenderState* state) override;
  void ReleaseGraphicsResources(vtkWindow* window) override;

  ///@{
  /**
   * The pass that draws the props that are not surfels. If it is set, this pass is one step of a
   * sequence. Default none.
   */
  void SetDelegatePass(vtkRenderPass* pass);
  vtkRenderPass* GetDelegatePass();
  ///@}

  /**
   * The splatter: settings of lens and kernels, statistics and the float picture.
   */
  vtkSurfelSplatter* GetSplatter();

  ///@{
  /**
   * Whether to draw one picture instead of LensCells, and surfels with a hierarchy coarser, to hold
   * the update rate of the window, while it is above one frame per second
   * (vtkRenderWindow::DesiredUpdateRate, which interactors raise while the mouse moves). Still
   * pictures are not changed. Default on.
   */
  vtkSetMacro(HoldUpdateRate, vtkTypeBool);
  vtkGetMacro(HoldUpdateRate, vtkTypeBool);
  vtkBooleanMacro(HoldUpdateRate, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Whether to blur other opaque props as well. Pixels that the lens blurs by more than half a
   * pixel join the surfels in their A-buffer; what is in focus stays as sharp as it was drawn.
   * Props are drawn up to 128 px beyond the border of the frame, as far as they blur into it. The
   * image of the props has one layer: behind the edge of a blurred prop, the gap is filled from the
   * neighbouring surface. With LensCells above 1, every cell sees what is there. With one cell,
   * translucent props and volumes stay sharp; 2D actors, such as text, always do. While the margin
   * and the cells are drawn, the renderer has other cameras (vtkCommand::ActiveCameraEvent).
   * Default on.
   */
  vtkSetMacro(OtherPropsThroughLens, vtkTypeBool);
  vtkGetMacro(OtherPropsThroughLens, vtkTypeBool);
  vtkBooleanMacro(OtherPropsThroughLens, vtkTypeBool);
  ///@}

  /**
   * Focuses a renderer's camera on what was last drawn at a display point (pixels, like an
   * interactor's event position): sets its FocalDistance to the distance of that point along the
   * view direction. Returns false, and does not change the focus, if nothing was drawn there, the
   * window was never rendered, or the camera is parallel. Through a lens a pixel shows a mixture:
   * for the surface itself render with LENS_PINHOLE first. FOCUS_POINT does not use the distance:
   * set vtkSurfelSplatter::FocusPoint to the point instead.
   */
  static bool FocusAt(vtkRenderer* renderer, int x, int y);

  /**
   * The factor on the splatter's LODError in the last frame: 1, or up to 16 to hold an update rate.
   */
  vtkGetMacro(Coarsening, double);

  /**
   * The time of the last change of the settings, including those of the splatter.
   */
  vtkMTimeType GetMTime() override;

protected:
  vtkSurfelSplattingPass();
  ~vtkSurfelSplattingPass() override;

private:
  vtkSurfelSplattingPass(const vtkSurfelSplattingPass&) = delete;
  void operator=(const vtkSurfelSplattingPass&) = delete;

  void RenderSelection(const vtkRenderState* state);
  bool RenderCells(const vtkRenderState* state);
  void RenderOpaqueStep(const vtkRenderState* state, vtkRenderPass* delegate);
  bool HoldsRate(vtkRenderer* renderer) const;
  double ChooseCoarsening(vtkRenderer* renderer);
  void LearnFrameTime(vtkRenderer* renderer);
  void ReportSharpProps();
#ifndef __VTK_WRAP__
  SurfelSplatting::SceneView MakeView(
    const SurfelSplatting::PassFrame& frame, const vtkSurfelSplatter::SceneItems& items);
  void BeginProps(const SurfelSplatting::PassFrame& frame, const SurfelSplatting::SceneView& view);
  bool MayHaveProps(vtkRenderer* renderer) const;
  void ReadProps(const SurfelSplatting::PassFrame& frame, vtkRenderPass* delegate);
  void RenderSurfels(const SurfelSplatting::PassFrame& frame,
    const vtkSurfelSplatter::SceneItems& items, SurfelSplatting::SceneView& view);
  void DrawPicture(const SurfelSplatting::PassFrame& frame);
  void Blend(const SurfelSplatting::PassFrame& frame);
  bool PresentKept(const SurfelSplatting::PassFrame& frame,
    const vtkSurfelSplatter::SceneItems& items, const SurfelSplatting::SceneView& view);
  void TakeStamp(const SurfelSplatting::PassFrame& frame, vtkRenderPass* delegate);
  bool All(bool own);
  bool Any(bool own)
  {
    return !this->All(!own);
  }
#endif

  vtkTypeBool HoldUpdateRate = 1;
  vtkTypeBool OtherPropsThroughLens = 1;
  double Coarsening = 1.0;
  vtkSmartPointer<vtkRenderPass> DelegatePass;
  vtkNew<vtkSurfelSplatter> Splatter;
  struct Internals;
  std::unique_ptr<Internals> Internal;
};

#endif
