// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelSplattingPass
 * @brief   draws surfels with depth of field among other props
 *
 * Splats every surfel actor of a renderer (vtkActor with a vtkSurfelMapper) into one A-buffer and
 * lets a delegate draw all other props.
 *
 *   renderer->SetPass(pass);
 *
 * That is all. Without a delegate pass it stands for a whole vtkRenderStepsPass: camera, lights,
 * opaque props, surfels, translucent props (with depth peeling where the renderer says so),
 * volumes, overlay; it also serves stereo and hardware selection, which VTK's own passes leave out.
 * With a delegate it is the step of opaque props alone, to be used inside a sequence of passes:
 *
 *   pass->SetDelegatePass(opaquePass); steps->SetOpaquePass(pass); renderer->SetPass(steps);
 *
 * Stages of the step:
 *   1. the delegate draws the other opaque props;
 *   2. their depth and colour are read back: what lies behind them is hidden, layer by layer, and
 *      pixels that the lens blurs become surfels themselves (OtherPropsThroughLens);
 *   3. the core splats all surfels (vtkSurfelSplatter);
 *   4. colour (RGBA 32-bit float, premultiplied) is blended over the frame, and depth (R 32-bit
 *      float) written where the surfels' alpha passes one half, so that later props are hidden
 *      correctly.
 *
 * With vtkSurfelSplatter::LensCells above 1, other props to go through the lens and neither a
 * delegate nor deep samples or channels to be made, all steps but the overlay are rendered once for
 * each cell of the lens, and the frame is their mean: translucent props and volumes are blurred as
 * well, and what blurred props hide is seen past their edges. Each cell costs a frame of all props.
 *
 * With a controller (GetSplatter()->SetController()) the renderers of all its processes draw one
 * picture, and all have to render: opaque props come to process 0, the nearest of each pixel, and
 * surfels as vtkSurfelSplatter says. Process 0's framebuffer then holds the picture, with a depth
 * below 1 wherever there is any colour, and the others' nothing but translucent props and volumes
 * that were drawn before, as compositors want them.
 *
 * The float picture of what was splatted, before it is rounded to the frame's 8 bits, is
 * GetSplatter()->GetOutput(): surfels and blurred pixels of other props; that of the last cell
 * where there are several.
 *
 * @sa vtkSurfelMapper vtkSurfelSplatter vtkSurfelImageRenderer
 */
#ifndef vtkSurfelSplattingPass_h
#define vtkSurfelSplattingPass_h

#include "vtkNew.h" // for members
#include "vtkRenderPass.h"
#include "vtkSmartPointer.h"          // for members
#include "vtkSurfelRenderingModule.h" // for export macro
#include "vtkSurfelSplatter.h"        // for its view

#include <memory> // for the implementation

class vtkOpenGLRenderWindow;
class vtkRenderer;

namespace SurfelSplatting
{
struct DepthRange;
struct PixelRectangle;
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
   * Draws the props that are not surfels, in place of the whole default sequence. Default none.
   */
  void SetDelegatePass(vtkRenderPass* pass);
  vtkRenderPass* GetDelegatePass();
  ///@}

  /**
   * Lens, kernel, statistics and the float picture.
   */
  vtkSurfelSplatter* GetSplatter();

  ///@{
  /**
   * Whether surfels with a hierarchy are drawn coarser while a window asks for more than one frame
   * a second (vtkRenderWindow::DesiredUpdateRate, which interactors raise while the mouse moves),
   * as far as it takes to hold that rate. Still pictures are not touched. Default on.
   */
  vtkSetMacro(HoldUpdateRate, vtkTypeBool);
  vtkGetMacro(HoldUpdateRate, vtkTypeBool);
  vtkBooleanMacro(HoldUpdateRate, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Whether what the other opaque props have drawn goes through the lens as well: pixels that it
   * blurs by more than half a pixel join the surfels in their A-buffer; what is in focus stays as
   * sharp as it was drawn. What is up to 128 px beyond the frame's border is drawn, too, for what
   * blurs into it. A picture has one layer: behind the edge of a blurred prop the surface beside it
   * is taken to go on; with LensCells above 1 every cell sees for itself. With one cell translucent
   * props and volumes stay sharp. 2D actors, such as text, always do. The margin and the cells are
   * drawn through cameras that the renderer has for as long (vtkCommand::ActiveCameraEvent).
   * Default on.
   */
  vtkSetMacro(OtherPropsThroughLens, vtkTypeBool);
  vtkGetMacro(OtherPropsThroughLens, vtkTypeBool);
  vtkBooleanMacro(OtherPropsThroughLens, vtkTypeBool);
  ///@}

  /**
   * Focuses a renderer's camera on what was last drawn at a display point (pixels, as an
   * interactor's event position): sets its FocalDistance to the distance there along the view
   * direction. False, and the focus stays, where nothing was drawn or the camera is parallel. With
   * LENS_PINHOLE there is a focus but no blur to see it by.
   */
  static bool FocusAt(vtkRenderer* renderer, int x, int y);

  /**
   * Factor on the splatter's LODError in the last frame: 1, or more to hold an update rate.
   */
  vtkGetMacro(Coarsening, double);

  /**
   * Changes of the settings count.
   */
  vtkMTimeType GetMTime() override;

protected:
  vtkSurfelSplattingPass();
  ~vtkSurfelSplattingPass() override;

private:
  vtkSurfelSplattingPass(const vtkSurfelSplattingPass&) = delete;
  void operator=(const vtkSurfelSplattingPass&) = delete;

  double ChooseCoarsening(vtkRenderer* renderer);
  void LearnFrameTime(vtkRenderer* renderer);
  void RenderSelection(const vtkRenderState* state);
  void RenderOpaqueStep(const vtkRenderState* state, vtkRenderPass* delegate);
  bool RenderCells(const vtkRenderState* state);
  void ReportOtherProps();
#ifndef __VTK_WRAP__
  vtkSurfelSplatter::View MakeView(
    const vtkRenderState* state, const SurfelSplatting::PixelRectangle& rectangle);
  bool JoinOtherProps(const vtkRenderState* state, const SurfelSplatting::PixelRectangle& rectangle,
    const SurfelSplatting::DepthRange& range, int margin, vtkRenderPass* delegate);
  int BeginOtherProps(
    const vtkRenderState* state, const SurfelSplatting::PixelRectangle& rectangle);
  bool ReadOtherProps(const vtkRenderState* state, const SurfelSplatting::PixelRectangle& rectangle,
    const SurfelSplatting::DepthRange& range, int margin, vtkRenderPass* delegate);
  bool All(bool mine);
  bool Any(bool mine)
  {
    return !this->All(!mine);
  }
  void ReadDepths(vtkOpenGLRenderWindow* window, const SurfelSplatting::PixelRectangle& rectangle,
    const SurfelSplatting::DepthRange& range);
  void ClearPicture(
    vtkOpenGLRenderWindow* window, const SurfelSplatting::PixelRectangle& rectangle, bool joined);
  void DrawPicture(vtkOpenGLRenderWindow* window, const SurfelSplatting::PixelRectangle& rectangle,
    const SurfelSplatting::DepthRange& range, bool joined);
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
