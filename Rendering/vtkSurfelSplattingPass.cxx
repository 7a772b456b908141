// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelSplattingPass.h"

#include "PixelSurfels.h"
#include "SurfelFrameBlit.h"
#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"

#include <vtk_glew.h>

#include <vtkCallbackCommand.h>
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
#include <vtkPointData.h>
#include <vtkPropCollection.h>
#include <vtkRenderState.h>
#include <vtkRenderStepsPass.h>
#include <vtkRenderer.h>
#include <vtkRendererCollection.h>
#include <vtkSMPTools.h>
#include <vtkWeakPointer.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
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

/// Only the camera's own rendering tells it which eye it is, and VTK's passes leave that out.
void UpdateStereo(vtkRenderer* renderer)
{
  auto* window = vtkOpenGLRenderWindow::SafeDownCast(renderer->GetRenderWindow());
  if (window && (window->GetStereoRender() || renderer->GetActiveCamera()->GetStereo()))
  {
    vtkOpenGLState* state = window->GetState();
    vtkOpenGLState::ScopedglViewport viewport(state);
    vtkOpenGLState::ScopedglScissor scissor(state);
    vtkOpenGLState::ScopedglEnableDisable scissorTest(state, GL_SCISSOR_TEST);
    renderer->GetActiveCamera()->Render(renderer);
  }
}

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

/// Whether a state's props are more than surfels.
bool HasOtherProps(const vtkRenderState* state)
{
  return std::any_of(
    state->GetPropArray(), state->GetPropArray() + state->GetPropArrayCount(), [](vtkProp* prop) {
      auto* actor = vtkActor::SafeDownCast(prop);
      return !(actor && vtkSurfelMapper::SafeDownCast(actor->GetMapper()));
    });
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

bool IsInteractive(vtkRenderer* renderer)
{
  return renderer->GetRenderWindow()->GetDesiredUpdateRate() > 1.0;
}

/// The surfels of a renderer are the pass's from now to the end of the renderer's frame, also while
/// later passes draw translucent props.
class SplattedMarks
{
public:
  ~SplattedMarks() { this->Clear(); }

  void Set(vtkRenderer* renderer, const std::vector<vtkSurfelSplatter::Item>& items)
  {
    this->Clear();
    for (const vtkSurfelSplatter::Item& item : items)
    {
      item.Mapper->SetSplatted(true);
      this->Mappers.push_back(item.Mapper);
    }
    vtkNew<vtkCallbackCommand> command;
    command->SetClientData(this);
    command->SetCallback([](vtkObject*, unsigned long, void* self, void*) {
      static_cast<SplattedMarks*>(self)->Clear();
    });
    this->Renderer = renderer;
    this->Observer = renderer->AddObserver(vtkCommand::EndEvent, command);
  }

  void Clear()
  {
    for (vtkSurfelMapper* mapper : this->Mappers)
    {
      mapper->SetSplatted(false);
    }
    this->Mappers.clear();
    if (this->Renderer)
    {
      this->Renderer->RemoveObserver(this->Observer);
      this->Renderer = nullptr;
    }
  }

private:
  std::vector<vtkSmartPointer<vtkSurfelMapper>> Mappers;
  vtkWeakPointer<vtkRenderer> Renderer;
  unsigned long Observer = 0;
};
}

struct vtkSurfelSplattingPass::Internals
{
  SurfelSplatting::FrameBlit Blit;
  SplattedMarks Marks;
  vtkNew<vtkRenderStepsPass> Steps;
  vtkNew<vtkOpaquePass> OpaqueProps;
  vtkNew<FunctionPass> Step;
  vtkNew<FunctionPass> TranslucentStep;
  std::vector<float> WindowDepth;
  std::vector<float> Limit;
  std::vector<float> Background;  // before the other props
  std::vector<float> OthersColor; // with them; then the whole picture
  double NextCoarsening = 1.0;    // learned from the frames so far
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
  UpdateStereo(state->GetRenderer());
  this->Internal->Steps->Render(state);
  this->NumberOfRenderedProps += this->Internal->Steps->GetNumberOfRenderedProps();
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

void vtkSurfelSplattingPass::RenderOpaqueStep(const vtkRenderState* state, vtkRenderPass* delegate)
{
  vtkRenderer* renderer = state->GetRenderer();
  const std::vector<vtkSurfelSplatter::Item> items = CollectSurfels(renderer);
  this->Internal->Marks.Set(renderer, items);
  auto* window = vtkOpenGLRenderWindow::SafeDownCast(renderer->GetRenderWindow());
  const SurfelSplatting::PixelRectangle rectangle = SurfelSplatting::FrameRectangle(state);
  const bool hasPicture = window && rectangle.Width > 0 && rectangle.Height > 0;
  vtkCamera* camera = renderer->GetActiveCamera();
  const bool others = hasPicture && this->OtherPropsThroughLens != 0 &&
    this->Splatter->HasLens(camera) && HasOtherProps(state) &&
    this->ReadColor(window, rectangle, this->Internal->Background);
  delegate->Render(state);
  this->NumberOfRenderedProps += delegate->GetNumberOfRenderedProps();
  if (!hasPicture || (items.empty() && !others))
  {
    return;
  }
  const double aspect = renderer->GetTiledAspectRatio();
  const SurfelSplatting::DepthRange range = MakeDepthRange(camera, aspect);
  this->ReadOtherProps(window, rectangle, range);

  vtkSurfelSplatter::View view;
  view.Camera = camera;
  view.Lights = renderer->GetLights();
  view.Size[0] = rectangle.Width;
  view.Size[1] = rectangle.Height;
  view.Aspect = aspect;
  view.Oversampling = Oversampling(renderer, window, rectangle);
  view.DepthLimit = this->Internal->Limit.data();
  if (others && this->ReadColor(window, rectangle, this->Internal->OthersColor))
  {
    view.OthersColor = this->Internal->OthersColor.data();
  }
  view.Progress = [window](double) { return window->CheckAbortStatus() == 0; };
  camera->GetClippingRange(view.ClippingRange);
  view.Coarsening = this->Coarsening = this->ChooseCoarsening(renderer);
  const vtkIdType reused = this->Splatter->GetNumberOfReusedFrames();
  if (this->Splatter->Render(items, view))
  {
    if (this->Splatter->GetNumberOfReusedFrames() == reused)
    {
      this->LearnFrameTime(renderer);
    }
    this->DrawPicture(window, rectangle, range);
  }
}

double vtkSurfelSplattingPass::ChooseCoarsening(vtkRenderer* renderer)
{
  return this->HoldUpdateRate && IsInteractive(renderer) ? this->Internal->NextCoarsening : 1.0;
}

void vtkSurfelSplattingPass::LearnFrameTime(vtkRenderer* renderer)
{
  constexpr double mostCoarsening = 16.0;
  double& next = this->Internal->NextCoarsening;
  const double load = this->Splatter->GetFrameMilliseconds() / (1000.0 * SecondsPerFrame(renderer));
  if (!IsInteractive(renderer))
  {
    return; // what was learned is of use when the mouse moves again
  }
  // Splats go with the inverse square of the coarsening, but not all of a frame's time does.
  if (load > 1.0)
  {
    next = std::min(mostCoarsening, this->Coarsening * std::min(2.0, std::pow(load, 0.7)));
  }
  else if (load < 0.7)
  {
    next = std::max(1.0, this->Coarsening * std::max(0.7, std::sqrt(load / 0.85)));
  }
}

bool vtkSurfelSplattingPass::ReadColor(vtkOpenGLRenderWindow* window,
  const SurfelSplatting::PixelRectangle& rectangle, std::vector<float>& color)
{
  const bool good = this->Internal->Blit.ReadColor(window, rectangle, color);
  if (!good)
  {
    vtkErrorMacro("The other props' colours could not be read from this framebuffer: they stay "
                  "sharp. Try vtkRenderWindow::SetMultiSamples(0), or OtherPropsThroughLensOff().");
  }
  return good;
}

void vtkSurfelSplattingPass::ReadOtherProps(vtkOpenGLRenderWindow* window,
  const SurfelSplatting::PixelRectangle& rectangle, const SurfelSplatting::DepthRange& range)
{
  std::vector<float>& windowDepth = this->Internal->WindowDepth;
  if (!this->Internal->Blit.ReadDepth(window, rectangle, windowDepth))
  {
    vtkErrorMacro("The depth of the other props could not be read from this framebuffer: surfels "
                  "are drawn over them. Try vtkRenderWindow::SetMultiSamples(0).");
    std::fill(windowDepth.begin(), windowDepth.end(), 1.0f);
  }
  this->Internal->Limit.resize(windowDepth.size());
  const float* depths = windowDepth.data();
  float* limits = this->Internal->Limit.data();
  const auto count = static_cast<vtkIdType>(windowDepth.size());
  vtkSMPTools::For(0, count, [&](vtkIdType begin, vtkIdType end) {
    std::transform(depths + begin, depths + end, limits + begin, [&range](float depth) {
      return depth >= 1.0f ? std::numeric_limits<float>::infinity()
                           : static_cast<float>(range.DistanceOf(depth));
    });
  });
}

void vtkSurfelSplattingPass::DrawPicture(vtkOpenGLRenderWindow* window,
  const SurfelSplatting::PixelRectangle& rectangle, const SurfelSplatting::DepthRange& range)
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
  float* joined = windowDepth.data();
  const auto count = static_cast<vtkIdType>(windowDepth.size());
  vtkSMPTools::For(0, count, [&](vtkIdType begin, vtkIdType end) {
    std::transform(joined + begin, joined + end, depth + begin, joined + begin, join);
  });
  SurfelSplatting::FrameBlit& blit = this->Internal->Blit;
  bool good = false;
  if (taken.empty())
  {
    good = blit.Draw(window, rectangle, color, windowDepth.data());
  }
  else
  {
    this->ComposePicture(color);
    good = blit.Replace(window, rectangle, this->Internal->OthersColor.data(), windowDepth.data());
  }
  if (!good)
  {
    vtkErrorMacro(
      "The surfels could not be drawn: their picture did not reach OpenGL as float textures.");
  }
}

/// The picture over the others' where they stay, and over the background where they were taken.
void vtkSurfelSplattingPass::ComposePicture(const float* color)
{
  float* under = this->Internal->OthersColor.data();
  const float* background = this->Internal->Background.data();
  for (const auto& pixel : this->Splatter->GetTakenPixels().Taken())
  {
    for (std::size_t c = 4 * pixel.Index; c < 4 * pixel.Index + 4; ++c)
    {
      under[c] += pixel.Absent * (background[c] - under[c]);
    }
  }
  const auto count = static_cast<vtkIdType>(this->Internal->WindowDepth.size());
  vtkSMPTools::For(0, count, [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType p = begin; p < end; ++p)
    {
      const float through = 1.0f - color[4 * p + 3];
      for (vtkIdType c = 4 * p; c < 4 * p + 4; ++c)
      {
        under[c] = color[c] + through * under[c];
      }
    }
  });
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
