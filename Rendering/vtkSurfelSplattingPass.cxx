// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelSplattingPass.h"

#include "Core/Base/Ranks.h"
#include "Rendering/OpenGL/CameraChanges.h"
#include "Rendering/OpenGL/FrameBlit.h"
#include "Rendering/OpenGL/LensAccumulation.h"
#include "Rendering/OpenGL/PropImage.h"
#include "Rendering/Scene/SplattedMarks.h"
#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"

#include <vtkCamera.h>
#include <vtkCameraPass.h>
#include <vtkFloatArray.h>
#include <vtkHardwareSelector.h>
#include <vtkImageData.h>
#include <vtkMatrix4x4.h>
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
#include <vtkSMPTools.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <new>
#include <vector>

namespace
{
/// A pass that is a function: a place among the steps of the default sequence.
class FunctionPass : public vtkRenderPass
{
public:
  static FunctionPass* New();
  vtkTypeMacro(FunctionPass, vtkRenderPass);
  std::function<void(const vtkRenderState*)> Function;
  void Render(const vtkRenderState* state) override { this->Function(state); }
};
vtkStandardNewMacro(FunctionPass);

/// All the renderer's props: its culling knows nothing of blur that reaches into the picture from
/// outside.
std::vector<vtkSurfelSplatter::Item> CollectSurfels(vtkRenderer* renderer)
{
  std::vector<vtkSurfelSplatter::Item> items;
  vtkCollectionSimpleIterator it;
  renderer->GetViewProps()->InitTraversal(it);
  while (vtkProp* prop = renderer->GetViewProps()->GetNextProp(it))
  {
    vtkSurfelSplatter::CollectItems(prop, items);
  }
  return items;
}

SurfelSplatting::DepthRange MakeDepthRange(vtkCamera* camera, double aspect)
{
  vtkMatrix4x4* projection = camera->GetProjectionTransformMatrix(aspect, -1, 1);
  return { projection->GetElement(2, 2), projection->GetElement(2, 3),
    camera->GetParallelProjection() != 0 };
}

/// Pixels of the picture per pixel of the window: posters and supersampling framebuffers.
double Oversampling(
  vtkRenderer* renderer, vtkRenderWindow* window, const SurfelSplatting::PixelRectangle& rectangle)
{
  int width = 0, height = 0;
  renderer->GetTiledSize(&width, &height);
  return static_cast<double>(window->GetTileScale()[1]) * rectangle.Height / std::max(1, height);
}

/// Time that a window's update rate leaves to a renderer.
double SecondsPerFrame(vtkRenderer* renderer)
{
  vtkRenderWindow* window = renderer->GetRenderWindow();
  const int renderers = std::max(1, window->GetRenderers()->GetNumberOfItems());
  return 1.0 / (std::max(1e-6, window->GetDesiredUpdateRate()) * renderers);
}

constexpr double MostCoarsening = 16.0;

/// What a frame's time must fall to for coarser surfels to be of use: meshes' pixels do not get
/// fewer.
constexpr double LeastGain = 0.93;

/// Of pixels that hold any colour, where a compositor takes those of depth 1 for empty.
constexpr double DeepestPixel = 1.0 - 1e-6;

bool IsInteractive(vtkRenderer* renderer)
{
  return renderer->GetRenderWindow()->GetDesiredUpdateRate() > 1.0;
}

/// Calls a function; false where it says so or memory does not suffice.
bool IfMemorySuffices(const std::function<bool()>& function)
{
  try
  {
    return function();
  }
  catch (const std::bad_alloc&)
  {
    return false;
  }
}

/// A number that is 0 again when this goes.
class CountOfCells
{
public:
  CountOfCells(int& count, int cells)
    : Count(count)
  {
    this->Count = cells;
  }
  ~CountOfCells() { this->Count = 0; }

private:
  int& Count;
};
}

struct vtkSurfelSplattingPass::Internals
{
  SurfelSplatting::FrameBlit Blit;
  SurfelSplatting::SplattedMarks Marks;
  vtkNew<vtkRenderStepsPass> Steps;
  vtkNew<vtkOpaquePass> OpaqueProps;
  vtkNew<FunctionPass> Step;
  vtkNew<FunctionPass> TranslucentStep;
  vtkNew<FunctionPass> OverlayStep;
  vtkNew<vtkOverlayPass> Overlay;
  vtkNew<FunctionPass> Cell; // the steps for one cell of the lens
  SurfelSplatting::LensAccumulation Accumulation;
  SurfelSplatting::PropImage Others;
  int CellCount = 0; // while the steps are rendered for each of so many cells
  std::vector<float> WindowDepth;
  std::vector<float> Limit;
  double NextCoarsening = 1.0; // learned from the frames so far
  double LastCoarsening = 1.0, LastLoad = 0.0;
  double UsefulCoarsening = MostCoarsening; // more of it was seen to gain nothing
};

vtkStandardNewMacro(vtkSurfelSplattingPass);

vtkSurfelSplattingPass::vtkSurfelSplattingPass()
  : Internal(new Internals)
{
  this->Internal->Step->Function = [this](const vtkRenderState* state) {
    this->RenderOpaqueStep(state, this->Internal->OpaqueProps);
  };
  this->Internal->Steps->SetOpaquePass(this->Internal->Step);
  // The renderer's own translucent step instead of vtkTranslucentPass: depth peeling where it is
  // switched on.
  this->Internal->TranslucentStep->Function = [](const vtkRenderState* state) {
    state->GetRenderer()->DeviceRenderTranslucentPolygonalGeometry(state->GetFrameBuffer());
  };
  this->Internal->Steps->SetTranslucentPass(this->Internal->TranslucentStep);
  // Text and axes are drawn once, over the mean of the cells.
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

/// Of all processes that draw a picture together.
bool vtkSurfelSplattingPass::All(bool mine)
{
  SurfelSplatting::Ranks* ranks = this->Splatter->GetRanks();
  return ranks ? ranks->All(mine) : mine;
}

void vtkSurfelSplattingPass::Render(const vtkRenderState* state)
{
  this->NumberOfRenderedProps = 0;
  if (state->GetRenderer()->GetSelector())
  {
    this->RenderSelection(state);
    return;
  }
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

/// All props, once for each cell of the lens. False: nothing was drawn; one picture does.
bool vtkSurfelSplattingPass::RenderCells(const vtkRenderState* state)
{
  vtkRenderer* renderer = state->GetRenderer();
  vtkCamera* camera = renderer->GetActiveCamera();
  auto* window = vtkOpenGLRenderWindow::SafeDownCast(renderer->GetRenderWindow());
  const SurfelSplatting::PixelRectangle rectangle = SurfelSplatting::FrameRectangle(state);
  const int cells = this->Splatter->GetLensCells();
  if (!this->OtherPropsThroughLens || cells < 2 || this->Splatter->GetDeepSamples() ||
    this->Splatter->GetChannels() != 0 || !this->Splatter->HasLens(camera) ||
    !this->All(window && rectangle.Width > 0 && rectangle.Height > 0) ||
    !this->Any(SurfelSplatting::HasOtherProps(renderer, false)))
  {
    return false;
  }
  const vtkSurfelSplatter::View view = this->MakeView(state, rectangle);
  SurfelSplatting::LensViews views(camera, view.Size, view.Aspect, this->Splatter->GetLens(view),
    { cells, this->Splatter->GetLensPinholes() != 0 });
  views.LinearLight = this->Splatter->GetLinearLight() != 0;
  views.Deepest = this->Splatter->GetRanks() ? DeepestPixel : 1.0;
  views.All = [this](bool mine) { return this->All(mine); };
  bool good = false;
  {
    const CountOfCells count(this->Internal->CellCount, cells);
    good = this->Internal->Accumulation.Render(state, rectangle, views, this->Internal->Cell);
  }
  if (!good)
  {
    vtkErrorMacro("Float textures of " << rectangle.Width << " x " << rectangle.Height
                                       << " pixels could not be made: other props are seen through "
                                          "the middle of the lens only.");
    return false;
  }
  vtkOpenGLState* glState = window->GetState();
  vtkOpenGLState::ScopedglViewport viewport(glState);
  vtkOpenGLState::ScopedglScissor scissor(glState);
  glState->vtkglViewport(rectangle.X, rectangle.Y, rectangle.Width, rectangle.Height);
  glState->vtkglScissor(rectangle.X, rectangle.Y, rectangle.Width, rectangle.Height);
  this->Internal->Overlay->Render(state);
  return true;
}

void vtkSurfelSplattingPass::RenderSelection(const vtkRenderState* state)
{
  // Hardware selection counts and colours the props itself, which the default passes know nothing
  // of; surfels take part as their mapper's dots.
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

vtkSurfelSplatter::View vtkSurfelSplattingPass::MakeView(
  const vtkRenderState* state, const SurfelSplatting::PixelRectangle& rectangle)
{
  vtkRenderer* renderer = state->GetRenderer();
  vtkRenderWindow* window = renderer->GetRenderWindow();
  vtkSurfelSplatter::View view;
  view.Camera = renderer->GetActiveCamera();
  view.Lights = renderer->GetLights();
  view.Size[0] = rectangle.Width;
  view.Size[1] = rectangle.Height;
  view.Aspect = renderer->GetTiledAspectRatio();
  view.Oversampling = Oversampling(renderer, window, rectangle);
  view.CellCount = this->Internal->CellCount;
  view.Progress = [window](double) { return window->CheckAbortStatus() == 0; };
  view.Camera->GetClippingRange(view.ClippingRange);
  return view;
}

void vtkSurfelSplattingPass::RenderOpaqueStep(const vtkRenderState* state, vtkRenderPass* delegate)
{
  vtkRenderer* renderer = state->GetRenderer();
  const std::vector<vtkSurfelSplatter::Item> items = CollectSurfels(renderer);
  this->Internal->Marks.Set(renderer, items);
  auto* window = vtkOpenGLRenderWindow::SafeDownCast(renderer->GetRenderWindow());
  const SurfelSplatting::PixelRectangle rectangle = SurfelSplatting::FrameRectangle(state);
  const int size[2] = { rectangle.Width, rectangle.Height };
  const bool hasPicture =
    this->All(window && size[0] > 0 && size[1] > 0) && this->Splatter->HasOneSize(size);
  const bool hasSurfels = this->Any(!items.empty());
  this->Internal->Others.SetLinearLight(this->Splatter->GetLinearLight() != 0);
  const int margin = hasPicture ? this->BeginOtherProps(state, rectangle) : 0;
  delegate->Render(state);
  this->NumberOfRenderedProps += delegate->GetNumberOfRenderedProps();
  if (!hasPicture || (!hasSurfels && margin == 0))
  {
    return;
  }
  vtkSurfelSplatter::View view = this->MakeView(state, rectangle);
  const SurfelSplatting::DepthRange range = MakeDepthRange(view.Camera, view.Aspect);
  this->ReadDepths(window, rectangle, range);
  SurfelSplatting::Ranks* ranks = this->Splatter->GetRanks();
  const bool joined = ranks && this->JoinOtherProps(state, rectangle, range, margin, delegate);
  view.OccluderDepth = this->Internal->Limit.data();
  if (margin > 0 &&
    (ranks ? joined && ranks->IsRoot()
           : this->ReadOtherProps(state, rectangle, range, margin, delegate)))
  {
    view.Others = &this->Internal->Others.Picture();
  }
  view.Coarsening = this->Coarsening = this->ChooseCoarsening(renderer);
  const vtkIdType reused = this->Splatter->GetNumberOfReusedFrames();
  if (this->Splatter->Render(items, view))
  {
    if (this->Splatter->GetNumberOfReusedFrames() == reused)
    {
      this->LearnFrameTime(renderer);
    }
    if (ranks && !ranks->IsRoot())
    {
      this->ClearPicture(window, rectangle, joined);
      return;
    }
    this->DrawPicture(window, rectangle, range, joined);
  }
}

/// What is in process 0's picture now leaves this one's; translucent props and volumes, which have
/// no depth, stay.
void vtkSurfelSplattingPass::ClearPicture(
  vtkOpenGLRenderWindow* window, const SurfelSplatting::PixelRectangle& rectangle, bool joined)
{
  Internals& my = *this->Internal;
  SurfelSplatting::FrameBlit::Clear(window, rectangle);
  const float* rest = joined ? my.Others.WithoutGathered(my.Limit) : nullptr;
  if (rest)
  {
    std::fill(my.WindowDepth.begin(), my.WindowDepth.end(), 1.0f);
    my.Blit.Replace(window, rectangle, rest, my.WindowDepth.data());
  }
}

double vtkSurfelSplattingPass::ChooseCoarsening(vtkRenderer* renderer)
{
  const double mine =
    this->HoldUpdateRate && IsInteractive(renderer) ? this->Internal->NextCoarsening : 1.0;
  SurfelSplatting::Ranks* ranks = this->Splatter->GetRanks();
  return ranks ? ranks->RootValue(mine) : mine;
}

void vtkSurfelSplattingPass::LearnFrameTime(vtkRenderer* renderer)
{
  Internals& my = *this->Internal;
  double& next = my.NextCoarsening;
  const double load = this->Splatter->GetFrameMilliseconds() *
    std::max(1, this->Internal->CellCount) / (1000.0 * SecondsPerFrame(renderer));
  if (!IsInteractive(renderer))
  {
    my.UsefulCoarsening = MostCoarsening; // perhaps of another scene
    my.LastLoad = 0.0;
    return; // what was learned is of use when the mouse moves again
  }
  if (load > 1.0 && this->Coarsening > my.LastCoarsening && my.LastLoad > 0.0 &&
    load > LeastGain * my.LastLoad && this->Splatter->GetTakenPixels().Size() > 0)
  {
    my.UsefulCoarsening = my.LastCoarsening;
  }
  my.LastCoarsening = this->Coarsening;
  my.LastLoad = load;
  // Splats go with the inverse square of the coarsening, but not all of a frame's time does.
  if (load > 1.0)
  {
    next = std::min(my.UsefulCoarsening, this->Coarsening * std::min(2.0, std::pow(load, 0.7)));
  }
  else if (load < 0.7)
  {
    next = std::max(1.0, this->Coarsening * std::max(0.7, std::sqrt(load / 0.85)));
  }
}

/// Before the other props are drawn; how far beyond the picture they are to be drawn, px, where
/// they are to go through the lens. 0: they are not, or none is blurred.
int vtkSurfelSplattingPass::BeginOtherProps(
  const vtkRenderState* state, const SurfelSplatting::PixelRectangle& rectangle)
{
  vtkRenderer* renderer = state->GetRenderer();
  vtkCamera* camera = renderer->GetActiveCamera();
  const bool blurs = this->Internal->CellCount > 0
    ? camera->GetFocalDisk() > 0.0 && !camera->GetParallelProjection()
    : this->Splatter->HasLens(camera);
  if (!this->OtherPropsThroughLens || !blurs ||
    !this->Any(SurfelSplatting::HasOtherProps(renderer, true)))
  {
    return 0;
  }
  double distances[2];
  SurfelSplatting::DistancesOfOtherProps(renderer, distances);
  if (SurfelSplatting::Ranks* ranks = this->Splatter->GetRanks())
  {
    distances[0] = -ranks->Largest(-distances[0]);
    distances[1] = ranks->Largest(distances[1]);
  }
  const int margin = this->Splatter->GetMargin(this->MakeView(state, rectangle), distances);
  auto* window = vtkOpenGLRenderWindow::SafeDownCast(renderer->GetRenderWindow());
  const auto read = [&] { return this->Internal->Others.ReadBackground(window, rectangle); };
  if (margin > 0 && !this->All(IfMemorySuffices(read)))
  {
    this->ReportOtherProps();
    return 0;
  }
  return margin;
}

void vtkSurfelSplattingPass::ReportOtherProps()
{
  vtkErrorMacro("The other props' colours could not be read from this framebuffer, or memory does "
                "not suffice for them: they stay sharp. Try vtkRenderWindow::SetMultiSamples(0), a "
                "smaller window, or OtherPropsThroughLensOff().");
}

bool vtkSurfelSplattingPass::ReadOtherProps(const vtkRenderState* state,
  const SurfelSplatting::PixelRectangle& rectangle, const SurfelSplatting::DepthRange& range,
  int margin, vtkRenderPass* delegate)
{
  SurfelSplatting::PropImage& others = this->Internal->Others;
  const auto read = [&] {
    return others.Read(state, rectangle, range, this->Internal->Limit, margin, delegate);
  };
  const bool good = IfMemorySuffices(read);
  if (!good)
  {
    this->ReportOtherProps();
  }
  return good;
}

/// Of all processes, into the picture of process 0. False: there is nothing but its own, or they
/// could not be read.
bool vtkSurfelSplattingPass::JoinOtherProps(const vtkRenderState* state,
  const SurfelSplatting::PixelRectangle& rectangle, const SurfelSplatting::DepthRange& range,
  int margin, vtkRenderPass* delegate)
{
  SurfelSplatting::Ranks& ranks = *this->Splatter->GetRanks();
  const bool mine = SurfelSplatting::HasOtherProps(state->GetRenderer(), false);
  if (margin == 0 && !ranks.Any(mine && !ranks.IsRoot()))
  {
    return false;
  }
  const bool reads = mine || ranks.IsRoot();
  if (!ranks.All(!reads || this->ReadOtherProps(state, rectangle, range, margin, delegate)))
  {
    return false;
  }
  std::vector<float>& limit = this->Internal->Limit;
  this->Internal->Others.Gather(ranks, mine, limit);
  for (std::size_t p = 0; p < limit.size(); ++p)
  {
    this->Internal->WindowDepth[p] =
      std::isinf(limit[p]) ? 1.0f : static_cast<float>(range.WindowDepthOf(limit[p]));
  }
  return true;
}

void vtkSurfelSplattingPass::ReadDepths(vtkOpenGLRenderWindow* window,
  const SurfelSplatting::PixelRectangle& rectangle, const SurfelSplatting::DepthRange& range)
{
  std::vector<float>& windowDepth = this->Internal->WindowDepth;
  if (!this->Internal->Blit.ReadDepth(window, rectangle, windowDepth))
  {
    vtkErrorMacro("The depth of the other props could not be read from this framebuffer: surfels "
                  "are drawn over them. Try vtkRenderWindow::SetMultiSamples(0).");
    std::fill(windowDepth.begin(), windowDepth.end(), 1.0f);
  }
  SurfelSplatting::ToDistances(windowDepth, range, this->Internal->Limit);
}

void vtkSurfelSplattingPass::DrawPicture(vtkOpenGLRenderWindow* window,
  const SurfelSplatting::PixelRectangle& rectangle, const SurfelSplatting::DepthRange& range,
  bool joined)
{
  vtkPointData* picture = this->Splatter->GetOutput()->GetPointData();
  const float* color = vtkFloatArray::SafeDownCast(picture->GetArray("Color"))->GetPointer(0);
  const float* depth = vtkFloatArray::SafeDownCast(picture->GetArray("Depth"))->GetPointer(0);
  std::vector<float>& windowDepth = this->Internal->WindowDepth;
  const auto& taken = this->Splatter->GetTakenPixels().Taken();
  for (const auto& pixel : taken)
  {
    windowDepth[pixel.Index] = 1.0f;
  }
  const auto join = [&range](float others, float distance) {
    if (distance <= 0.0f && !(range.Parallel && distance != 0.0f))
    {
      return others;
    }
    const double d = range.WindowDepthOf(distance);
    return std::min(others, static_cast<float>(std::min(std::max(d, 0.0), 1.0)));
  };
  const float deepest = this->Splatter->GetRanks() ? static_cast<float>(DeepestPixel) : 1.0f;
  const auto count = static_cast<vtkIdType>(windowDepth.size());
  vtkSMPTools::For(0, count, [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType p = begin; p < end; ++p)
    {
      const float most = color[4 * p + 3] > 0.0f ? deepest : 1.0f;
      windowDepth[p] = std::min(join(windowDepth[p], depth[p]), most);
    }
  });
  SurfelSplatting::FrameBlit& blit = this->Internal->Blit;
  // Blending knows nothing of light.
  const bool mixesLight = taken.empty() && !joined && this->Splatter->GetLinearLight() != 0;
  const bool read = mixesLight && this->Internal->Others.ReadPicture(window, rectangle);
  if (mixesLight && !read)
  {
    vtkErrorMacro("The frame's colours could not be read: surfels are blended over it as colours "
                  "instead of as light. Try vtkRenderWindow::SetMultiSamples(0).");
  }
  const bool whole = read || joined || !taken.empty();
  const bool good = whole
    ? blit.Replace(window, rectangle,
        this->Internal->Others.Compose(this->Splatter->GetTakenPixels(), color), windowDepth.data())
    : blit.Draw(window, rectangle, color, windowDepth.data());
  if (!good)
  {
    vtkErrorMacro(
      "The surfels could not be drawn: their picture did not reach OpenGL as float textures.");
  }
}

bool vtkSurfelSplattingPass::FocusAt(vtkRenderer* renderer, int x, int y)
{
  if (!renderer || !renderer->GetRenderWindow() || !renderer->IsInViewport(x, y))
  {
    return false;
  }
  vtkCamera* camera = renderer->GetActiveCamera();
  const double depth = renderer->GetZ(x, y);
  if (camera->GetParallelProjection() || !(depth < 1.0))
  {
    return false;
  }
  const double distance = MakeDepthRange(camera, renderer->GetTiledAspectRatio()).DistanceOf(depth);
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
  this->Internal->Others.ReleaseGraphicsResources(window);
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
