// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelSplattingPass.h"

#include "Core/Base/Ranks.h"
#include "Rendering/OpenGL/CameraChanges.h"
#include "Rendering/OpenGL/FrameBlit.h"
#include "Rendering/OpenGL/FramebufferTextures.h"
#include "Rendering/OpenGL/LensAccumulation.h"
#include "Rendering/OpenGL/PassFrame.h"
#include "Rendering/OpenGL/PropImage.h"
#include "Rendering/Scene/PropStamp.h"
#include "Rendering/Scene/RateGovernor.h"
#include "Rendering/Scene/SceneView.h"
#include "Rendering/SplattedMappers.h"
#include "SurfelData/SMPExecutor.h"
#include "vtkSurfelSplatter.h"

#include <vtkCamera.h>
#include <vtkCameraPass.h>
#include <vtkFloatArray.h>
#include <vtkHardwareSelector.h>
#include <vtkImageData.h>
#include <vtkObjectFactory.h>
#include <vtkOpaquePass.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkOverlayPass.h>
#include <vtkPointData.h>
#include <vtkPropCollection.h>
#include <vtkRenderState.h>
#include <vtkRenderStepsPass.h>
#include <vtkRenderer.h>
#include <vtkRendererCollection.h>

#include <algorithm>
#include <functional>
#include <vector>

namespace
{
/// A pass that calls a function.
class FunctionPass : public vtkRenderPass
{
public:
  static FunctionPass* New();
  vtkTypeMacro(FunctionPass, vtkRenderPass);
  std::function<void(const vtkRenderState*)> Function;
  void Render(const vtkRenderState* state) override { this->Function(state); }
};
vtkStandardNewMacro(FunctionPass);

/// Collects the surfels of all props, also those that the renderer has culled: they may blur into
/// the picture from outside.
vtkSurfelSplatter::SceneItems CollectSurfels(vtkRenderer* renderer)
{
  vtkSurfelSplatter::SceneItems items;
  vtkCollectionSimpleIterator it;
  renderer->GetViewProps()->InitTraversal(it);
  while (vtkProp* prop = renderer->GetViewProps()->GetNextProp(it))
  {
    vtkSurfelSplatter::CollectItems(prop, items);
  }
  return items;
}

/// Pixels of the picture per pixel of the window: above 1 for posters and supersampling.
double Oversampling(const SurfelSplatting::PassFrame& frame)
{
  int width = 0, height = 0;
  frame.Renderer->GetTiledSize(&width, &height);
  return static_cast<double>(frame.Window->GetTileScale()[1]) * frame.Rectangle.Height /
    std::max(1, height);
}

/// The time that the update rate of a window leaves to a renderer, seconds.
double SecondsPerFrame(vtkRenderer* renderer)
{
  vtkRenderWindow* window = renderer->GetRenderWindow();
  const int renderers = std::max(1, window->GetRenderers()->GetNumberOfItems());
  return 1.0 / (std::max(1e-6, window->GetDesiredUpdateRate()) * renderers);
}

/// Largest depth of pixels with any colour, for compositors that take pixels of depth 1 for empty.
constexpr double DeepestPixel = 1.0 - 1e-6;

bool IsInteractive(vtkRenderer* renderer)
{
  return renderer->GetRenderWindow()->GetDesiredUpdateRate() > 1.0;
}

void RenderProps(std::vector<vtkProp*> props, vtkRenderer* renderer, vtkRenderPass* pass)
{
  vtkRenderState state(renderer);
  state.SetPropArrayAndCount(props.data(), static_cast<int>(props.size()));
  pass->Render(&state);
}

/// What a frame has put into the framebuffer, in memory of the splatter's and of PropImage.
struct FinishedFrame
{
  SurfelSplatting::FramePixels Pixels;
  vtkSmartPointer<vtkFloatArray> Splatted; // keeps the splatter's memory
  bool IsWhole = false;                    // all that is seen, and not to be mixed with anything
  bool IsAll = false;                      // nothing else has been drawn
  bool IsCopied = false;                   // into the textures of the framebuffer
  int NumberOfProps = 0;
};

/// Sets the number of cells; its destructor sets it back to 0.
class ScopedCellCount
{
public:
  ScopedCellCount(int& count, int cells)
    : Count(count)
  {
    this->Count = cells;
  }
  ~ScopedCellCount() { this->Count = 0; }

private:
  int& Count;
};
}

struct vtkSurfelSplattingPass::Internals
{
  SurfelSplatting::SplattedMappers Mappers;
  vtkNew<vtkRenderStepsPass> Steps;
  vtkNew<vtkOpaquePass> OpaqueProps;
  vtkNew<FunctionPass> Step;
  vtkNew<FunctionPass> TranslucentStep;
  vtkNew<FunctionPass> OverlayStep;
  vtkNew<vtkOverlayPass> Overlay;
  vtkNew<FunctionPass> Cell; // the steps for one cell of the lens
  SurfelSplatting::LensAccumulation Accumulation;
  SurfelSplatting::PropImage Props;
  SurfelSplatting::RateGovernor Governor;
  SurfelSplatting::FrameBlit Blit;
  SurfelSplatting::FramebufferTextures Textures;
  SurfelSplatting::PropStamp Stamp;
  FinishedFrame Finished;
  int CellCount = 0; // while the steps are rendered once per cell
  bool IsMoving = false;
};

vtkStandardNewMacro(vtkSurfelSplattingPass);

vtkSurfelSplattingPass::vtkSurfelSplattingPass()
  : Internal(new Internals)
{
  this->Internal->Step->Function = [this](const vtkRenderState* state) {
    this->RenderOpaqueStep(state, this->Internal->OpaqueProps);
  };
  this->Internal->Steps->SetOpaquePass(this->Internal->Step);
  // The renderer's own translucent step, unlike vtkTranslucentPass, supports depth peeling.
  this->Internal->TranslucentStep->Function = [](const vtkRenderState* state) {
    state->GetRenderer()->DeviceRenderTranslucentPolygonalGeometry(state->GetFrameBuffer());
  };
  this->Internal->Steps->SetTranslucentPass(this->Internal->TranslucentStep);
  // Text and axes are drawn once, over the average of the cells.
  this->Internal->OverlayStep->Function = [this](const vtkRenderState* state) {
    if (this->Internal->CellCount == 0)
    {
      this->Internal->Overlay->Render(state);
    }
  };
  this->Internal->Steps->SetOverlayPass(this->Internal->OverlayStep);
  this->Internal->Cell->Function = [this](const vtkRenderState* state) {
    this->Internal->Steps->Render(state);
  };
}

vtkSurfelSplattingPass::~vtkSurfelSplattingPass() = default;

void vtkSurfelSplattingPass::SetDelegatePass(vtkRenderPass* pass)
{
  if (this->DelegatePass != pass)
  {
    this->DelegatePass = pass;
    this->Modified();
  }
}

vtkRenderPass* vtkSurfelSplattingPass::GetDelegatePass()
{
  return this->DelegatePass;
}

vtkSurfelSplatter* vtkSurfelSplattingPass::GetSplatter()
{
  return this->Splatter;
}

vtkMTimeType vtkSurfelSplattingPass::GetMTime()
{
  return std::max(this->Superclass::GetMTime(), this->Splatter->GetMTime());
}

/// Collective. Whether something is true on all processes that draw the picture.
bool vtkSurfelSplattingPass::All(bool own)
{
  SurfelSplatting::Ranks* ranks = this->Splatter->GetRanks();
  return ranks ? ranks->All(own) : own;
}

void vtkSurfelSplattingPass::Render(const vtkRenderState* state)
{
  this->NumberOfRenderedProps = 0;
  if (state->GetRenderer()->GetSelector())
  {
    this->RenderSelection(state);
    return;
  }
  this->Internal->IsMoving = this->All(this->HoldsRate(state->GetRenderer()));
  if (this->DelegatePass)
  {
    this->RenderOpaqueStep(state, this->DelegatePass);
    return;
  }
  SurfelSplatting::UpdateStereo(state->GetRenderer());
  if (!this->RenderCells(state))
  {
    this->Internal->Steps->Render(state);
  }
  this->NumberOfRenderedProps += this->Internal->Steps->GetNumberOfRenderedProps();
}

/// Renders all props once per cell of the lens. False, and nothing is drawn, if one picture is
/// enough.
bool vtkSurfelSplattingPass::RenderCells(const vtkRenderState* state)
{
  const SurfelSplatting::PassFrame frame(state);
  const SurfelSplatting::PixelRectangle& r = frame.Rectangle;
  const int cells = this->Internal->IsMoving ? 1 : this->Splatter->GetLensCells();
  if (!this->OtherPropsThroughLens || cells < 2 || this->Splatter->GetDeepSamples() ||
    this->Splatter->GetChannels() != 0 ||
    !this->Splatter->HasLens(frame.Renderer->GetActiveCamera()) || !this->All(frame.CanBeDrawn()) ||
    !this->Any(SurfelSplatting::HasOtherProps(frame.Renderer, false)))
  {
    return false;
  }
  const SurfelSplatting::SceneView view = this->MakeView(frame, CollectSurfels(frame.Renderer));
  SurfelSplatting::LensViews views(
    view.Projection, view.Optics, { cells, this->Splatter->GetLensPinholes() != 0 });
  views.LinearLight = this->Splatter->GetLinearLight() != 0;
  views.Deepest = this->Splatter->GetRanks() ? DeepestPixel : 1.0;
  views.Group = this->Splatter->GetRanks();
  bool isDrawn = false;
  {
    const ScopedCellCount count(this->Internal->CellCount, cells);
    isDrawn = this->Internal->Accumulation.Render(frame, views, this->Internal->Cell);
  }
  if (!isDrawn)
  {
    vtkErrorMacro("Float textures of " << r.Width << " x " << r.Height
                                       << " pixels could not be created: other props are seen only "
                                          "through the centre of the lens. Try a smaller window.");
    return false;
  }
  vtkOpenGLState* glState = frame.Window->GetState();
  vtkOpenGLState::ScopedglViewport viewport(glState);
  vtkOpenGLState::ScopedglScissor scissor(glState);
  glState->vtkglViewport(r.X, r.Y, r.Width, r.Height);
  glState->vtkglScissor(r.X, r.Y, r.Width, r.Height);
  this->Internal->Overlay->Render(state);
  return true;
}

void vtkSurfelSplattingPass::RenderSelection(const vtkRenderState* state)
{
  // Hardware selection counts and colours the props itself, which the default passes do not
  // support. Surfels take part as the dots of their mapper.
  std::vector<vtkProp*> props(
    state->GetPropArray(), state->GetPropArray() + state->GetPropArrayCount());
  vtkNew<FunctionPass> selection;
  selection->Function = [this, &props](const vtkRenderState* inner) {
    vtkRenderer* renderer = inner->GetRenderer();
    this->NumberOfRenderedProps =
      renderer->GetSelector()->Render(renderer, props.data(), static_cast<int>(props.size()));
  };
  vtkNew<vtkCameraPass> camera;
  camera->SetDelegatePass(selection);
  camera->Render(state);
}

/// The view of a frame; without occluders.
SurfelSplatting::SceneView vtkSurfelSplattingPass::MakeView(
  const SurfelSplatting::PassFrame& frame, const vtkSurfelSplatter::SceneItems& items)
{
  SurfelSplatting::SceneView view;
  view.Camera = frame.Renderer->GetActiveCamera();
  view.Lights = frame.Renderer->GetLights();
  view.Size[0] = frame.Rectangle.Width;
  view.Size[1] = frame.Rectangle.Height;
  view.Aspect = frame.Aspect;
  view.Oversampling = Oversampling(frame);
  view.CellCount = this->Internal->CellCount;
  view.CellShape = this->Internal->Accumulation.ShapeOfCell();
  view.IsMoving = this->Internal->IsMoving;
  vtkRenderWindow* window = frame.Window;
  view.Progress = [window](double) { return window->CheckAbortStatus() == 0; };
  view.Camera->GetClippingRange(view.ClippingRange);
  this->Splatter->CompleteView(view, items);
  return view;
}

void vtkSurfelSplattingPass::RenderOpaqueStep(const vtkRenderState* state, vtkRenderPass* delegate)
{
  Internals& my = *this->Internal;
  const SurfelSplatting::PassFrame frame(state);
  const vtkSurfelSplatter::SceneItems items = CollectSurfels(frame.Renderer);
  my.Mappers.Set(frame.Renderer, items);
  const int size[2] = { frame.Rectangle.Width, frame.Rectangle.Height };
  const bool canBeDrawn = this->All(frame.CanBeDrawn()) && this->Splatter->HasOneSize(size);
  const bool hasSurfels = this->Any(!items.empty());
  SurfelSplatting::SceneView view;
  my.Props.StaySharp();
  if (canBeDrawn)
  {
    view = this->MakeView(frame, items);
    view.Coarsening = this->Coarsening = this->ChooseCoarsening(frame.Renderer);
    this->TakeStamp(frame, delegate);
    view.PropStamp = my.Stamp.IsKnown() ? &my.Stamp.Values() : nullptr;
    if (this->PresentKept(frame, items, view))
    {
      RenderProps(my.Stamp.OtherProps(), frame.Renderer, delegate);
      return;
    }
    this->BeginProps(frame, view);
  }
  my.Finished = FinishedFrame();
  delegate->Render(state);
  this->NumberOfRenderedProps += delegate->GetNumberOfRenderedProps();
  if (canBeDrawn && (hasSurfels || my.Props.IsBlurred()))
  {
    this->ReadProps(frame, delegate);
    this->RenderSurfels(frame, items, view);
  }
}

/// Splats the surfels among the props that were read.
void vtkSurfelSplattingPass::RenderSurfels(const SurfelSplatting::PassFrame& frame,
  const vtkSurfelSplatter::SceneItems& items, SurfelSplatting::SceneView& view)
{
  Internals& my = *this->Internal;
  view.OccluderDepth = my.Props.OccluderDepth();
  view.PropImage = my.Props.BlurredImage();
  const vtkIdType reused = this->Splatter->GetNumberOfReusedFrames();
  if (!this->Splatter->Render(items, view))
  {
    return;
  }
  if (this->Splatter->GetNumberOfReusedFrames() == reused)
  {
    this->LearnFrameTime(frame.Renderer);
  }
  SurfelSplatting::Ranks* ranks = this->Splatter->GetRanks();
  if (ranks && !ranks->IsRoot())
  {
    my.Props.ClearGathered(frame);
  }
  else
  {
    this->DrawPicture(frame);
  }
}

/// Notes what the other props are drawn from, where nothing but them can be in the framebuffer.
void vtkSurfelSplattingPass::TakeStamp(
  const SurfelSplatting::PassFrame& frame, vtkRenderPass* delegate)
{
  Internals& my = *this->Internal;
  const vtkRenderState* state = frame.State;
  if (!this->Splatter->GetFrameReuse() || this->Splatter->GetRanks() || my.CellCount > 0 ||
    delegate != my.OpaqueProps || state->GetRequiredKeys() || state->GetFrameBuffer())
  {
    my.Stamp.Clear();
    return;
  }
  my.Stamp.Take(frame.Renderer,
    { state->GetPropArray(), state->GetPropArray() + state->GetPropArrayCount() }, frame.Aspect,
    this->GetMTime());
}

/// Draws the last frame again if it is known to be this one, too.
bool vtkSurfelSplattingPass::PresentKept(const SurfelSplatting::PassFrame& frame,
  const vtkSurfelSplatter::SceneItems& items, const SurfelSplatting::SceneView& view)
{
  Internals& my = *this->Internal;
  if (!my.Finished.IsAll || !this->Splatter->HasPicture(items, view) ||
    !this->Splatter->Render(items, view))
  {
    return false;
  }
  if (!my.Finished.IsCopied || !my.Textures.CopyAgain(frame, my.Finished.Pixels))
  {
    this->Blend(frame);
  }
  this->NumberOfRenderedProps += my.Finished.NumberOfProps;
  return true;
}

/// Decides, before the other props are drawn, whether they are blurred.
void vtkSurfelSplattingPass::BeginProps(
  const SurfelSplatting::PassFrame& frame, const SurfelSplatting::SceneView& view)
{
  Internals& my = *this->Internal;
  my.Props.SetLinearLight(this->Splatter->GetLinearLight() != 0);
  my.Props.SetPlainBackground(
    !this->DelegatePass && SurfelSplatting::HasPlainBackground(frame.Renderer));
  // In a cell of the lens, the camera has the lens of that cell.
  const bool hasLens = my.CellCount > 0
    ? view.Camera->GetFocalDisk() > 0.0 && !view.Camera->GetParallelProjection()
    : this->Splatter->HasLens(view.Camera);
  if (this->OtherPropsThroughLens && hasLens &&
    !my.Props.Begin(frame, view, this->Splatter->GetRanks()))
  {
    this->ReportSharpProps();
  }
}

/// Whether anything but surfels may be in the framebuffer.
bool vtkSurfelSplattingPass::MayHaveProps(vtkRenderer* renderer) const
{
  return this->Splatter->GetRanks() || this->DelegatePass || renderer->GetPreserveDepthBuffer() ||
    SurfelSplatting::HasOtherProps(renderer, false);
}

void vtkSurfelSplattingPass::ReadProps(
  const SurfelSplatting::PassFrame& frame, vtkRenderPass* delegate)
{
  SurfelSplatting::PropImage& props = this->Internal->Props;
  if (!this->MayHaveProps(frame.Renderer))
  {
    props.ReadNothing();
    return;
  }
  if (!props.ReadDepth(frame))
  {
    vtkErrorMacro("The depth of the other props could not be read from this framebuffer: surfels "
                  "are drawn over them. Try vtkRenderWindow::SetMultiSamples(0).");
  }
  this->Internal->Stamp.BeginCameraSwap(frame.Renderer);
  if (!props.Read(frame, this->Splatter->GetRanks(), delegate))
  {
    this->ReportSharpProps();
  }
  this->Internal->Stamp.EndCameraSwap(frame.Renderer);
}

void vtkSurfelSplattingPass::ReportSharpProps()
{
  vtkErrorMacro("The colours of the other props could not be read from this framebuffer, or there "
                "is not enough memory for them: they stay sharp. Try "
                "vtkRenderWindow::SetMultiSamples(0), a smaller window, or "
                "OtherPropsThroughLensOff().");
}

bool vtkSurfelSplattingPass::HoldsRate(vtkRenderer* renderer) const
{
  return this->HoldUpdateRate && IsInteractive(renderer);
}

double vtkSurfelSplattingPass::ChooseCoarsening(vtkRenderer* renderer)
{
  const double coarsening = this->HoldsRate(renderer) ? this->Internal->Governor.Coarsening() : 1.0;
  SurfelSplatting::Ranks* ranks = this->Splatter->GetRanks();
  return ranks ? ranks->RootValue(coarsening) : coarsening;
}

void vtkSurfelSplattingPass::LearnFrameTime(vtkRenderer* renderer)
{
  Internals& my = *this->Internal;
  if (!IsInteractive(renderer))
  {
    my.Governor.AddStillFrame();
    return;
  }
  const double load = this->Splatter->GetFrameMilliseconds() * std::max(1, my.CellCount) /
    (1000.0 * SecondsPerFrame(renderer));
  my.Governor.AddInteractiveFrame(load, this->Coarsening);
}

void vtkSurfelSplattingPass::DrawPicture(const SurfelSplatting::PassFrame& frame)
{
  Internals& my = *this->Internal;
  vtkPointData* output = this->Splatter->GetOutput()->GetPointData();
  const SurfelSplatting::SplattedPicture picture{
    vtkFloatArray::SafeDownCast(output->GetArray("Color"))->GetPointer(0),
    vtkFloatArray::SafeDownCast(output->GetArray("Depth"))->GetPointer(0),
    static_cast<std::size_t>(frame.Rectangle.Width) * frame.Rectangle.Height,
    this->Splatter->GetBlurredPixels()
  };
  bool isWhole = my.Props.IsGathered() || !picture.BlurredPixels.Blurred().empty();
  if (!isWhole && this->Splatter->GetLinearLight())
  {
    // Blending mixes colours, not light.
    isWhole = my.Props.ReadColor(frame);
    if (!isWhole)
    {
      vtkErrorMacro("The colours of the frame could not be read: surfels are blended over it as "
                    "colours instead of as light. Try vtkRenderWindow::SetMultiSamples(0).");
    }
  }
  my.Props.BeginFinish(picture, isWhole);
  FinishedFrame& finished = my.Finished;
  finished.IsWhole = isWhole;
  finished.IsAll =
    isWhole || (!my.Props.OccluderDepth() && SurfelSplatting::HasPlainBackground(frame.Renderer));
  finished.NumberOfProps = this->NumberOfRenderedProps;
  finished.Splatted = vtkFloatArray::SafeDownCast(output->GetArray("Color"));
  finished.Pixels.Color = isWhole ? my.Props.FinishedColor() : picture.Color;
  finished.Pixels.Depth = my.Props.FinishedDepth();
  if (!isWhole)
  {
    std::copy_n(frame.Renderer->GetBackground(), 3, finished.Pixels.Under);
    finished.Pixels.Under[3] = static_cast<float>(frame.Renderer->GetBackgroundAlpha());
  }
  const float deepest = this->Splatter->GetRanks() ? static_cast<float>(DeepestPixel) : 1.0f;
  const auto finish = [&](std::size_t begin, std::size_t end) {
    my.Props.Finish(picture, frame.Range, deepest, begin, end);
  };
  finished.IsCopied = finished.IsAll && my.Textures.Copy(frame, finished.Pixels, finish);
  if (!finished.IsCopied)
  {
    SurfelSplatting::SMPExecutor().For(picture.Pixels, 4096, finish);
    this->Blend(frame);
  }
}

/// Draws the finished frame over the framebuffer.
void vtkSurfelSplattingPass::Blend(const SurfelSplatting::PassFrame& frame)
{
  Internals& my = *this->Internal;
  FinishedFrame& finished = my.Finished;
  if (!my.Blit.Draw(frame.Window, frame.Rectangle, finished.Pixels.Color, finished.Pixels.Depth,
        finished.IsWhole))
  {
    finished.IsAll = false;
    vtkErrorMacro(
      "The surfels could not be drawn: OpenGL could not create float textures for their picture. "
      "Try a smaller window.");
  }
}

bool vtkSurfelSplattingPass::FocusAt(vtkRenderer* renderer, int x, int y)
{
  if (!renderer || !renderer->GetRenderWindow() ||
    renderer->GetRenderWindow()->GetNeverRendered() || !renderer->IsInViewport(x, y))
  {
    return false;
  }
  vtkCamera* camera = renderer->GetActiveCamera();
  const double depth = renderer->GetZ(x, y);
  if (camera->GetParallelProjection() || !(depth < 1.0))
  {
    return false;
  }
  const SurfelSplatting::DepthRange range(camera, renderer->GetTiledAspectRatio());
  const double distance = range.DistanceOf(depth);
  if (!(distance > 0.0))
  {
    return false;
  }
  camera->SetFocalDistance(distance);
  return true;
}

void vtkSurfelSplattingPass::ReleaseGraphicsResources(vtkWindow* window)
{
  this->Internal->Blit.ReleaseGraphicsResources(window);
  this->Internal->Textures.ReleaseGraphicsResources(window);
  this->Internal->Props.ReleaseGraphicsResources(window);
  this->Internal->Accumulation.ReleaseGraphicsResources(window);
  this->Internal->Steps->ReleaseGraphicsResources(window);
  if (this->DelegatePass)
  {
    this->DelegatePass->ReleaseGraphicsResources(window);
  }
}

void vtkSurfelSplattingPass::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "DelegatePass: " << this->DelegatePass.Get() << "\n";
  os << indent << "HoldUpdateRate: " << this->HoldUpdateRate << "\n";
  os << indent << "OtherPropsThroughLens: " << this->OtherPropsThroughLens << "\n";
  os << indent << "Coarsening: " << this->Coarsening << "\n";
  os << indent << "Splatter:\n";
  this->Splatter->PrintSelf(os, indent.GetNextIndent());
}
