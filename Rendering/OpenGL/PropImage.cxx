// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/PropImage.h"

#include "Core/Base/LinearLight.h"
#include "Rendering/OpenGL/CameraChanges.h"
#include "Rendering/OpenGL/Functions.h"
#include "Rendering/OpenGL/PropsBeyond.h"
#include "Rendering/Scene/PropStamp.h"
#include "SurfelData/SMPExecutor.h"

#include <vtkCamera.h>
#include <vtkMath.h>
#include <vtkMatrix4x4.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkRenderPass.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <new>

namespace SurfelSplatting
{
namespace
{
constexpr std::size_t PixelsAtATime = 4096; // of a thread

/// Calls a function. False if it returns false or there is not enough memory.
template <typename Function>
bool IfMemorySuffices(const Function& function)
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

/// Joins distances of splats, 0 where there is none, and window depths: the smaller ones.
void JoinDepths(
  const float* distances, std::size_t count, const DepthRange& range, float* windowDepths)
{
  const double p22 = range.P22, p23 = range.P23;
  for (std::size_t i = 0; i < count && !range.Parallel; ++i)
  {
    const bool has = distances[i] > 0.0f;
    const double ndc = p23 / (has ? distances[i] : 1.0f) - p22;
    const auto depth = static_cast<float>(std::min(std::max(0.5 * (ndc + 1.0), 0.0), 1.0));
    windowDepths[i] = std::min(windowDepths[i], has ? depth : 1.0f);
  }
  for (std::size_t i = 0; i < count && range.Parallel; ++i)
  {
    const double depth = std::min(std::max(range.WindowDepthOf(distances[i]), 0.0), 1.0);
    windowDepths[i] =
      std::min(windowDepths[i], distances[i] != 0.0f ? static_cast<float>(depth) : 1.0f);
  }
}

/// Mixes premultiplied RGBA over what is there.
void Mix(const float* color, float* under)
{
  const float through = 1.0f - color[3];
  for (int c = 0; c < 4; ++c)
  {
    under[c] = color[c] + through * under[c];
  }
}

/// Mixes premultiplied light over sRGB codes.
void MixLight(const float* color, float* under)
{
  const float through = 1.0f - color[3];
  for (int c = 0; c < 3; ++c)
  {
    const double below = through > 0.0f ? through * LightOfCode(under[c]) : 0.0;
    under[c] = static_cast<float>(CodeOfLight(color[c] + below));
  }
  under[3] = color[3] + through * under[3];
}

/// A pixel that goes from one rank to another.
struct SentPixel
{
  std::uint64_t Index;
  float Distance, Color[4];
};

/// Widens a range of distances by those of a box's corners.
void AddDistances(const double* bounds, vtkMatrix4x4* worldToView, double distances[2])
{
  for (int corner = 0; corner < 8; ++corner)
  {
    const double p[4] = { bounds[corner & 1], bounds[2 + (corner >> 1 & 1)],
      bounds[4 + (corner >> 2 & 1)], 1.0 };
    double q[4];
    worldToView->MultiplyPoint(p, q);
    distances[0] = std::min(distances[0], -q[2]);
    distances[1] = std::max(distances[1], -q[2]);
  }
}

/// The range of distances of a renderer's other opaque props, within its clipping range.
void DistancesOfOtherProps(vtkRenderer* renderer, double distances[2])
{
  vtkCamera* camera = renderer->GetActiveCamera();
  double found[2] = { VTK_DOUBLE_MAX, -VTK_DOUBLE_MAX };
  for (vtkProp* prop : VisibleProps(renderer))
  {
    const double* bounds = IsOtherProp(prop, true) ? prop->GetBounds() : nullptr;
    if (bounds && vtkMath::AreBoundsInitialized(bounds))
    {
      AddDistances(bounds, camera->GetModelViewTransformMatrix(), found);
    }
  }
  const double* range = camera->GetClippingRange();
  distances[0] = std::min(std::max(found[0], range[0]), range[1]);
  distances[1] = std::min(std::max(found[1], range[0]), range[1]);
}

/// Converts window depths to distances along the view direction, infinity where nothing was drawn.
void ToDistances(
  const float* windowDepth, std::size_t count, const DepthRange& range, float* distances)
{
  std::transform(windowDepth, windowDepth + count, distances, [&range](float depth) {
    return depth >= 1.0f ? std::numeric_limits<float>::infinity()
                         : static_cast<float>(range.DistanceOf(depth));
  });
}
}

bool HasOtherProps(vtkRenderer* renderer, bool opaqueOnly)
{
  const std::vector<vtkProp*> props = VisibleProps(renderer);
  return std::any_of(
    props.begin(), props.end(), [=](vtkProp* prop) { return IsOtherProp(prop, opaqueOnly); });
}

bool PropImage::Begin(const PassFrame& frame, const SceneView& view, Ranks* ranks)
{
  this->Margin = 0;
  const bool hasProps = HasOtherProps(frame.Renderer, true);
  if (!(ranks ? ranks->Any(hasProps) : hasProps))
  {
    return true;
  }
  double distances[2];
  DistancesOfOtherProps(frame.Renderer, distances);
  if (ranks)
  {
    distances[0] = -ranks->Largest(-distances[0]);
    distances[1] = ranks->Largest(distances[1]);
  }
  const int margin =
    MarginOf(view.Projection, view.Optics, distances[0], distances[1], view.MinConfusion());
  if (margin == 0)
  {
    return true;
  }
  PixelRectangle background = frame.Rectangle;
  if (this->IsPlain)
  {
    background.Width = background.Height = 1;
  }
  const bool isRead = IfMemorySuffices(
    [&] { return this->Blit.ReadColor(frame.Window, background, this->Background); });
  if (!(ranks ? ranks->All(isRead) : isRead))
  {
    return false;
  }
  this->Margin = margin;
  return true;
}

void PropImage::ReadNothing()
{
  this->Gathered = false;
  this->HasImage = false;
  this->Distances.clear();
}

bool PropImage::ReadDepth(const PassFrame& frame)
{
  const bool isRead = this->Blit.ReadDepth(frame.Window, frame.Rectangle, this->WindowDepth);
  if (!isRead)
  {
    std::fill(this->WindowDepth.begin(), this->WindowDepth.end(), 1.0f);
  }
  const std::size_t pixels = this->WindowDepth.size();
  this->Distances.resize(pixels);
  SMPExecutor().For(pixels, PixelsAtATime, [&](std::size_t begin, std::size_t end) {
    ToDistances(
      this->WindowDepth.data() + begin, end - begin, frame.Range, this->Distances.data() + begin);
  });
  return isRead;
}

bool PropImage::Read(const PassFrame& frame, Ranks* ranks, vtkRenderPass* delegate)
{
  this->Gathered = false;
  this->HasImage = false;
  const auto read = [&] { return this->ReadImage(frame, ranks, delegate); };
  if (!ranks)
  {
    this->HasImage = this->IsBlurred() && IfMemorySuffices(read);
    return this->HasImage || !this->IsBlurred();
  }
  const bool hasProps = HasOtherProps(frame.Renderer, false);
  if (!this->IsBlurred() && !ranks->Any(hasProps && !ranks->IsRoot()))
  {
    return true; // there are none but rank 0's
  }
  Message pixels; // for rank 0
  const bool isRead = !(hasProps || ranks->IsRoot()) || IfMemorySuffices([&] {
    if (!read())
    {
      return false;
    }
    pixels = ranks->IsRoot() ? Message() : this->PackPixels();
    return true;
  });
  if (!ranks->All(isRead))
  {
    return isRead;
  }
  // An exchange fails on all ranks or on none.
  this->Gathered = IfMemorySuffices([&] {
    this->Gather(*ranks, std::move(pixels), hasProps, frame.Range);
    return true;
  });
  this->HasImage = this->Gathered && this->IsBlurred() && ranks->IsRoot();
  return this->Gathered;
}

bool PropImage::ReadImage(const PassFrame& frame, bool shares, vtkRenderPass* delegate)
{
  if (!this->ReadColor(frame))
  {
    return false;
  }
  this->Width = static_cast<std::size_t>(frame.Rectangle.Width);
  this->Image.Antialiased = CurrentSamples() > 0;
  const std::vector<vtkProp*> beyond =
    this->IsBlurred() ? PropsBeyond(frame) : std::vector<vtkProp*>();
  // Ranks have the same margin, whether or not they have anything in it.
  this->Image.Margin = shares || !beyond.empty() ? this->Margin : 0;
  if (this->Image.Margin > 0 && !this->DrawWide(frame, beyond, delegate))
  {
    this->Image.Margin = 0;
  }
  this->HasBackdrop = this->IsBlurred() && this->FindBackdrop();
  if (this->IsBlurred())
  {
    this->MakeMixedOpaque();
  }
  const bool isWide = shares || this->Image.Margin > 0;
  if (isWide)
  {
    this->PlaceMiddle(frame);
  }
  this->Image.Depth = (isWide ? this->WideDistances : this->Distances).data();
  this->Image.Colors = (isWide ? this->WideColor : this->Color).data();
  return true;
}

/// Draws the props in the margin, through a wider camera.
bool PropImage::DrawWide(
  const PassFrame& frame, const std::vector<vtkProp*>& props, vtkRenderPass* delegate)
{
  const int size[2] = { frame.Rectangle.Width, frame.Rectangle.Height };
  const int margin = this->Image.Margin;
  const int width = size[0] + 2 * margin, height = size[1] + 2 * margin;
  const vtkSmartPointer<vtkCamera> camera =
    CopyCamera(frame.Renderer->GetActiveCamera(), frame.Aspect);
  WidenCamera(camera, size, margin);
  if (!this->Wide.Begin(frame.Window, width, height, CurrentSamples()))
  {
    return false;
  }
  vtkOpenGLState* glState = frame.Window->GetState();
  glState->vtkglClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  glState->vtkglClearDepth(1.0);
  glState->vtkglDepthMask(GL_TRUE);
  glState->vtkglClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  {
    // The frame itself has been drawn: something at the camera hides it.
    vtkOpenGLState::ScopedglScissor box(glState);
    vtkOpenGLState::ScopedglEnableDisable test(glState, GL_SCISSOR_TEST);
    glState->vtkglEnable(GL_SCISSOR_TEST);
    glState->vtkglScissor(margin, margin, size[0], size[1]);
    glState->vtkglClearDepth(0.0);
    glState->vtkglClear(GL_DEPTH_BUFFER_BIT);
    glState->vtkglClearDepth(1.0);
  }
  RenderThrough(frame.State, props, camera, this->Wide.Framebuffer(), delegate);
  const bool isRead = this->ReadMargin(frame);
  this->Wide.End(false);
  return isRead;
}

/// Reads the four sides of the margin.
bool PropImage::ReadMargin(const PassFrame& frame)
{
  const int margin = this->Image.Margin;
  const int width = frame.Rectangle.Width, height = frame.Rectangle.Height;
  const int wide = width + 2 * margin;
  this->WideWindowDepth.resize(static_cast<std::size_t>(wide) * (height + 2 * margin));
  this->WideColor.resize(4 * this->WideWindowDepth.size());
  const PixelRectangle sides[] = { { 0, 0, wide, margin }, { 0, margin + height, wide, margin },
    { 0, margin, margin, height }, { margin + width, margin, margin, height } };
  return std::all_of(std::begin(sides), std::end(sides), [&](const PixelRectangle& side) {
    return this->Blit.ReadPart(frame.Window, side, wide, this->WideColor, this->WideWindowDepth);
  });
}

/// VTK does not multiply a background by its alpha, which is 0 unless told otherwise. An
/// antialiased edge before it, or a translucent prop that is forced to be opaque, has the colour of
/// both and the prop's alpha: too much light for so little alpha.
void PropImage::MakeMixedOpaque()
{
  SMPExecutor().For(this->Distances.size(), PixelsAtATime, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p)
    {
      const float* under = this->BackgroundOf(p);
      const bool isMultiplied = *std::max_element(under, under + 3) <= under[3];
      if (!isMultiplied && std::isfinite(this->Distances[p]))
      {
        this->Color[4 * p + 3] = 1.0f;
      }
    }
  });
}

/// Joins the frame, in the middle, and its margin.
void PropImage::PlaceMiddle(const PassFrame& frame)
{
  const auto margin = static_cast<std::size_t>(this->Image.Margin), width = this->Width;
  const std::size_t wide = width + 2 * margin;
  const auto high = static_cast<std::size_t>(frame.Rectangle.Height) + 2 * margin;
  this->WideDistances.resize(wide * high);
  this->WideColor.resize(4 * this->WideDistances.size());
  SMPExecutor().For(high, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y)
    {
      const std::size_t row = y * wide;
      const auto convert = [&](std::size_t x, std::size_t count) {
        ToDistances(this->WideWindowDepth.data() + row + x, count, frame.Range,
          this->WideDistances.data() + row + x);
      };
      if (y < margin || y >= high - margin)
      {
        convert(0, wide);
        continue;
      }
      convert(0, margin);
      convert(margin + width, margin);
      const std::size_t from = (y - margin) * width, to = row + margin;
      std::copy_n(this->Distances.data() + from, width, this->WideDistances.data() + to);
      std::copy_n(this->Color.data() + 4 * from, 4 * width, this->WideColor.data() + 4 * to);
    }
  });
}

/// Whether something without a depth, such as a skybox, was drawn: a pixel without depth, whose
/// neighbours have none either (edges may be antialiased), has another colour than before.
bool PropImage::FindBackdrop() const
{
  const auto isEmpty = [&](std::size_t p) { return std::isinf(this->Distances[p]); };
  const auto isOther = [&](std::size_t p) {
    const float* color = &this->Color[4 * p];
    return isEmpty(p) && !std::equal(color, color + 4, this->BackgroundOf(p)) && isEmpty(p - 1) &&
      isEmpty(p + 1) && isEmpty(p - this->Width) && isEmpty(p + this->Width);
  };
  const std::size_t height = this->Distances.size() / this->Width;
  std::atomic<bool> found{ false };
  SMPExecutor().For(height, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = std::max<std::size_t>(begin, 1); y < std::min(end, height - 1); ++y)
    {
      for (std::size_t x = 1; x + 1 < this->Width && !found; ++x)
      {
        if (isOther(y * this->Width + x))
        {
          found = true;
        }
      }
    }
  });
  return found;
}

Message PropImage::PackPixels() const
{
  std::vector<SentPixel> pixels;
  for (std::size_t p = 0; p < this->WideDistances.size(); ++p)
  {
    if (std::isfinite(this->WideDistances[p]))
    {
      const float* c = &this->WideColor[4 * p];
      pixels.push_back({ p, this->WideDistances[p], { c[0], c[1], c[2], c[3] } });
    }
  }
  Message message;
  Put(pixels.data(), pixels.size(), message);
  return message;
}

/// Adds pixels of another rank where they are nearer.
void PropImage::AddPixels(const Message& pixels)
{
  const auto margin = static_cast<std::size_t>(this->Image.Margin);
  const std::size_t wide = this->Width + 2 * margin;
  for (MessageReader reader(pixels); reader.Size() > 0;)
  {
    const auto pixel = reader.Get<SentPixel>();
    if (pixel.Index >= this->WideDistances.size() ||
      !(pixel.Distance < this->WideDistances[pixel.Index]))
    {
      continue;
    }
    this->WideDistances[pixel.Index] = pixel.Distance;
    std::copy_n(pixel.Color, 4, &this->WideColor[4 * pixel.Index]);
    const std::size_t x = pixel.Index % wide - margin, y = pixel.Index / wide - margin;
    if (x < this->Width && y < this->Distances.size() / this->Width) // not in the margin
    {
      const std::size_t p = y * this->Width + x;
      this->Distances[p] = pixel.Distance;
      std::copy_n(pixel.Color, 4, &this->Color[4 * p]);
    }
  }
}

/// Collective. Gathers the images of all ranks, the nearest prop of each pixel, on rank 0.
/// @param own      of PackPixels
/// @param hasProps whether this rank has anything to add
void PropImage::Gather(Ranks& ranks, Message own, bool hasProps, const DepthRange& range)
{
  if (!hasProps && !ranks.IsRoot())
  {
    this->Color.clear();
  }
  for (const Message& pixels : ranks.ToRoot([&] { return std::move(own); }))
  {
    this->AddPixels(pixels);
  }
  for (std::size_t p = 0; p < this->Distances.size(); ++p)
  {
    this->WindowDepth[p] = std::isinf(this->Distances[p])
      ? 1.0f
      : static_cast<float>(range.WindowDepthOf(this->Distances[p]));
  }
}

void PropImage::ClearGathered(const PassFrame& frame)
{
  FrameBlit::Clear(frame.Window, frame.Rectangle);
  if (!this->Gathered || this->Color.size() != 4 * this->Distances.size())
  {
    return;
  }
  for (std::size_t p = 0; p < this->Distances.size(); ++p)
  {
    if (std::isfinite(this->Distances[p]))
    {
      std::fill_n(&this->Color[4 * p], 4, 0.0f);
    }
  }
  std::fill(this->WindowDepth.begin(), this->WindowDepth.end(), 1.0f);
  this->Blit.Draw(
    frame.Window, frame.Rectangle, this->Color.data(), this->WindowDepth.data(), true);
}

/// The colour under a splatted pixel; the background of the pixel itself if nothing is there.
const float* PropImage::ColorUnder(const DepthImageSurfels::Pixel& pixel) const
{
  const bool isKnown = pixel.Under != DepthImageSurfels::NoPixel &&
    (this->HasBackdrop || std::isfinite(this->Image.Depth[pixel.Under]));
  return isKnown ? this->Image.Colors + 4 * pixel.Under : this->BackgroundOf(pixel.Index);
}

void PropImage::BeginFinish(const SplattedPicture& picture, bool isWhole)
{
  this->IsWhole = isWhole;
  this->WindowDepth.resize(picture.Pixels);
  const std::vector<DepthImageSurfels::Pixel>& blurred = picture.BlurredPixels.Blurred();
  const std::vector<DepthImageSurfels::Pixel>& mixed = picture.BlurredPixels.Mixed();
  const auto pixelOf = [&](std::size_t i) -> const DepthImageSurfels::Pixel& {
    return i < blurred.size() ? blurred[i] : mixed[i - blurred.size()];
  };
  const std::size_t count = isWhole ? blurred.size() + mixed.size() : blurred.size();
  // All colours under them are taken before any is replaced: they may be those of one another.
  this->Under.resize(isWhole ? 4 * count : 0);
  SMPExecutor().For(this->Under.size() / 4, PixelsAtATime, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      std::copy_n(this->ColorUnder(pixelOf(i)), 4, &this->Under[4 * i]);
    }
  });
  SMPExecutor().For(count, PixelsAtATime, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      const std::size_t p = pixelOf(i).Index;
      if (i < blurred.size())
      {
        this->WindowDepth[p] = 1.0f;
      }
      if (isWhole)
      {
        std::copy_n(&this->Under[4 * i], 4, &this->Color[4 * p]);
      }
    }
  });
}

void PropImage::Finish(const SplattedPicture& picture, const DepthRange& range, float deepest,
  std::size_t begin, std::size_t end)
{
  float* windowDepth = this->WindowDepth.data();
  if (this->Distances.empty())
  {
    std::fill(windowDepth + begin, windowDepth + end, 1.0f);
  }
  JoinDepths(picture.Depth + begin, end - begin, range, windowDepth + begin);
  for (std::size_t p = begin; p < end && deepest < 1.0f; ++p)
  {
    windowDepth[p] = std::min(windowDepth[p], picture.Color[4 * p + 3] > 0.0f ? deepest : 1.0f);
  }
  if (this->IsWhole)
  {
    this->MixPixels(picture, begin, end);
  }
}

void PropImage::MixPixels(const SplattedPicture& picture, std::size_t begin, std::size_t end)
{
  const bool linear = this->Image.LinearLight;
  for (std::size_t p = begin; p < end; ++p)
  {
    const float* color = picture.Color + 4 * p;
    float* under = &this->Color[4 * p];
    if (color[3] > 0.0f)
    {
      linear ? MixLight(color, under) : Mix(color, under);
    }
  }
}

void PropImage::ReleaseGraphicsResources(vtkWindow* window)
{
  this->Blit.ReleaseGraphicsResources(window);
  this->Wide.ReleaseGraphicsResources(window);
}
}
