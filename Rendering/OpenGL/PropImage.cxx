// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/PropImage.h"

#include "Rendering/OpenGL/CameraChanges.h"
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
#include <limits>
#include <new>

namespace SurfelSplatting
{
namespace
{
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
  if (this->Pixels.IsPlain)
  {
    background.Width = background.Height = 1;
  }
  const bool isRead = IfMemorySuffices(
    [&] { return this->Blit.ReadColor(frame.Window, background, this->Pixels.Background); });
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
  this->Pixels.Distances.clear();
}

bool PropImage::ReadDepth(const PassFrame& frame)
{
  const bool isRead = this->Blit.ReadDepth(frame.Window, frame.Rectangle, this->Pixels.WindowDepth);
  if (!isRead)
  {
    std::fill(this->Pixels.WindowDepth.begin(), this->Pixels.WindowDepth.end(), 1.0f);
  }
  const std::size_t pixels = this->Pixels.WindowDepth.size();
  this->Pixels.Distances.resize(pixels);
  SMPExecutor().For(pixels, PixelsAtATime, [&](std::size_t begin, std::size_t end) {
    ToDistances(this->Pixels.WindowDepth.data() + begin, end - begin, frame.Range,
      this->Pixels.Distances.data() + begin);
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
    pixels = ranks->IsRoot() ? Message() : this->Beside.Pack();
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
  this->Pixels.Width = static_cast<std::size_t>(frame.Rectangle.Width);
  this->Image.Antialiased = CurrentSamples() > 0;
  const std::vector<vtkProp*> beyond =
    this->IsBlurred() ? PropsBeyond(frame) : std::vector<vtkProp*>();
  // Ranks have the same margin, whether or not they have anything in it.
  this->Image.Margin = shares || !beyond.empty() ? this->Margin : 0;
  if (this->Image.Margin > 0 && !this->Beside.Draw(frame, this->Image.Margin, beyond, delegate))
  {
    this->Image.Margin = 0;
  }
  this->Pixels.HasBackdrop = this->IsBlurred() && this->FindBackdrop();
  if (this->IsBlurred())
  {
    this->MakeMixedOpaque();
  }
  const bool isWide = shares || this->Image.Margin > 0;
  if (isWide)
  {
    this->Beside.PlaceMiddle(frame, this->Image.Margin, this->Pixels);
  }
  this->Image.Depth = (isWide ? this->Beside.Distances() : this->Pixels.Distances).data();
  this->Image.Colors = (isWide ? this->Beside.Color() : this->Pixels.Color).data();
  return true;
}

/// VTK does not multiply a background by its alpha, which is 0 unless told otherwise. An
/// antialiased edge before it, or a translucent prop that is forced to be opaque, has the colour of
/// both and the prop's alpha: too much light for so little alpha.
void PropImage::MakeMixedOpaque()
{
  SMPExecutor().For(
    this->Pixels.Distances.size(), PixelsAtATime, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p)
      {
        const float* under = this->Pixels.BackgroundOf(p);
        const bool isMultiplied = *std::max_element(under, under + 3) <= under[3];
        if (!isMultiplied && std::isfinite(this->Pixels.Distances[p]))
        {
          this->Pixels.Color[4 * p + 3] = 1.0f;
        }
      }
    });
}

/// Whether something without a depth, such as a skybox, was drawn: a pixel without depth, whose
/// neighbours have none either (edges may be antialiased), has another colour than before.
bool PropImage::FindBackdrop() const
{
  const auto isEmpty = [&](std::size_t p) { return std::isinf(this->Pixels.Distances[p]); };
  const auto isOther = [&](std::size_t p) {
    const float* color = &this->Pixels.Color[4 * p];
    return isEmpty(p) && !std::equal(color, color + 4, this->Pixels.BackgroundOf(p)) &&
      isEmpty(p - 1) && isEmpty(p + 1) && isEmpty(p - this->Pixels.Width) &&
      isEmpty(p + this->Pixels.Width);
  };
  const std::size_t height = this->Pixels.Distances.size() / this->Pixels.Width;
  std::atomic<bool> found{ false };
  SMPExecutor().For(height, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = std::max<std::size_t>(begin, 1); y < std::min(end, height - 1); ++y)
    {
      for (std::size_t x = 1; x + 1 < this->Pixels.Width && !found; ++x)
      {
        if (isOther(y * this->Pixels.Width + x))
        {
          found = true;
        }
      }
    }
  });
  return found;
}

/// Collective. Gathers the images of all ranks, the nearest prop of each pixel, on rank 0.
/// @param own      of PropMargin::Pack
/// @param hasProps whether this rank has anything to add
void PropImage::Gather(Ranks& ranks, Message own, bool hasProps, const DepthRange& range)
{
  if (!hasProps && !ranks.IsRoot())
  {
    this->Pixels.Color.clear();
  }
  for (const Message& pixels : ranks.ToRoot([&] { return std::move(own); }))
  {
    this->Beside.Add(pixels, this->Pixels);
  }
  for (std::size_t p = 0; p < this->Pixels.Distances.size(); ++p)
  {
    this->Pixels.WindowDepth[p] = std::isinf(this->Pixels.Distances[p])
      ? 1.0f
      : static_cast<float>(range.WindowDepthOf(this->Pixels.Distances[p]));
  }
}

void PropImage::ClearGathered(const PassFrame& frame)
{
  FrameBlit::Clear(frame.Window, frame.Rectangle);
  if (!this->Gathered || this->Pixels.Color.size() != 4 * this->Pixels.Distances.size())
  {
    return;
  }
  for (std::size_t p = 0; p < this->Pixels.Distances.size(); ++p)
  {
    if (std::isfinite(this->Pixels.Distances[p]))
    {
      std::fill_n(&this->Pixels.Color[4 * p], 4, 0.0f);
    }
  }
  std::fill(this->Pixels.WindowDepth.begin(), this->Pixels.WindowDepth.end(), 1.0f);
  this->Blit.Draw(frame.Window, frame.Rectangle, this->Pixels.Color.data(),
    this->Pixels.WindowDepth.data(), true);
}

void PropImage::ReleaseGraphicsResources(vtkWindow* window)
{
  this->Blit.ReleaseGraphicsResources(window);
  this->Beside.ReleaseGraphicsResources(window);
}
}
