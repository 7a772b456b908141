// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/PropImage.h"

#include "Core/Base/LinearLight.h"
#include "Rendering/OpenGL/CameraChanges.h"
#include "Rendering/OpenGL/Functions.h"

#include <vtkActor.h>
#include <vtkAssemblyNode.h>
#include <vtkAssemblyPath.h>
#include <vtkCamera.h>
#include <vtkMapper.h>
#include <vtkMath.h>
#include <vtkMatrix4x4.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkProp3D.h>
#include <vtkRenderPass.h>
#include <vtkRenderer.h>
#include <vtkSMPTools.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <new>

namespace SurfelSplatting
{
namespace
{
bool IsSurfelActor(vtkProp* prop)
{
  auto* actor = vtkActor::SafeDownCast(prop);
  return actor && actor->GetMapper() && actor->GetMapper()->IsA("vtkSurfelMapper");
}

/// Whether any part of a prop is in 3D space and is not surfels.
bool IsOtherProp(vtkProp* prop, bool opaqueOnly)
{
  bool isOther = false;
  prop->InitPathTraversal();
  while (vtkAssemblyPath* path = prop->GetNextPath())
  {
    vtkProp* leaf = path->GetLastNode()->GetViewProp();
    isOther = isOther ||
      (vtkProp3D::SafeDownCast(leaf) && leaf->GetVisibility() &&
        (!opaqueOnly || leaf->HasOpaqueGeometry()) && !IsSurfelActor(leaf));
  }
  return isOther;
}

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
  const std::vector<float>& windowDepth, const DepthRange& range, std::vector<float>& distances)
{
  distances.resize(windowDepth.size());
  const auto count = static_cast<vtkIdType>(windowDepth.size());
  vtkSMPTools::For(0, count, [&](vtkIdType begin, vtkIdType end) {
    std::transform(windowDepth.data() + begin, windowDepth.data() + end, distances.data() + begin,
      [&range](float depth) {
        return depth >= 1.0f ? std::numeric_limits<float>::infinity()
                             : static_cast<float>(range.DistanceOf(depth));
      });
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
  const bool isRead = IfMemorySuffices(
    [&] { return this->Blit.ReadColor(frame.Window, frame.Rectangle, this->Background); });
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
  ToDistances(this->WindowDepth, frame.Range, this->Distances);
  return isRead;
}

bool PropImage::Read(const PassFrame& frame, Ranks* ranks, vtkRenderPass* delegate)
{
  this->Gathered = false;
  this->HasImage = false;
  const auto read = [&] { return this->ReadImage(frame, delegate); };
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
  const bool isRead = !(hasProps || ranks->IsRoot()) || IfMemorySuffices(read);
  if (ranks->All(isRead))
  {
    this->Gather(*ranks, hasProps, frame.Range);
    this->Gathered = true;
    this->HasImage = this->IsBlurred() && ranks->IsRoot();
  }
  return isRead;
}

bool PropImage::ReadImage(const PassFrame& frame, vtkRenderPass* delegate)
{
  if (!this->ReadColor(frame))
  {
    return false;
  }
  this->Image.Margin = this->Margin;
  this->Image.Antialiased = CurrentSamples() > 0;
  if (this->IsBlurred() && !this->DrawWide(frame, delegate))
  {
    this->Image.Margin = 0;
  }
  this->PlaceMiddle(frame.Rectangle);
  this->HasBackdrop = this->IsBlurred() && this->FindBackdrop();
  this->Image.Depth = this->WideDistances.data();
  this->Image.Colors = this->WideColor.data();
  return true;
}

/// Draws the props with the margin, through a wider camera.
bool PropImage::DrawWide(const PassFrame& frame, vtkRenderPass* delegate)
{
  const int size[2] = { frame.Rectangle.Width, frame.Rectangle.Height };
  const int margin = this->Image.Margin;
  const PixelRectangle wide{ 0, 0, size[0] + 2 * margin, size[1] + 2 * margin };
  const vtkSmartPointer<vtkCamera> camera =
    CopyCamera(frame.Renderer->GetActiveCamera(), frame.Aspect);
  WidenCamera(camera, size, margin);
  if (!this->Wide.Begin(frame.Window, wide.Width, wide.Height, CurrentSamples()))
  {
    return false;
  }
  vtkOpenGLState* glState = frame.Window->GetState();
  glState->vtkglClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  glState->vtkglClearDepth(1.0);
  glState->vtkglDepthMask(GL_TRUE);
  glState->vtkglClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  RenderThrough(frame.State, camera, this->Wide.Framebuffer(), delegate);
  const bool isRead = this->Blit.ReadColor(frame.Window, wide, this->WideColor) &&
    this->Blit.ReadDepth(frame.Window, wide, this->WideWindowDepth);
  this->Wide.End(false);
  if (isRead)
  {
    ToDistances(this->WideWindowDepth, frame.Range, this->WideDistances);
  }
  return isRead;
}

/// Copies the frame itself into the middle of the image with the margin.
void PropImage::PlaceMiddle(const PixelRectangle& rectangle)
{
  this->Width = static_cast<std::size_t>(rectangle.Width);
  const std::size_t width = this->Width;
  const auto height = static_cast<std::size_t>(rectangle.Height);
  const auto margin = static_cast<std::size_t>(this->Image.Margin);
  const std::size_t wide = width + 2 * margin;
  this->WideDistances.resize(wide * (height + 2 * margin));
  this->WideColor.resize(4 * this->WideDistances.size());
  for (std::size_t y = 0; y < height; ++y)
  {
    const std::size_t to = (y + margin) * wide + margin;
    std::copy_n(this->Distances.data() + y * width, width, this->WideDistances.data() + to);
    std::copy_n(this->Color.data() + 4 * y * width, 4 * width, this->WideColor.data() + 4 * to);
  }
}

/// Whether something without a depth, such as a skybox, was drawn: a pixel without depth, whose
/// neighbours have none either (edges may be antialiased), has another colour than before.
bool PropImage::FindBackdrop() const
{
  const auto isEmpty = [&](std::size_t p) { return std::isinf(this->Distances[p]); };
  const std::size_t height = this->Distances.size() / this->Width;
  for (std::size_t y = 1; y + 1 < height; ++y)
  {
    for (std::size_t x = 1; x + 1 < this->Width; ++x)
    {
      const std::size_t p = y * this->Width + x;
      const float* color = &this->Color[4 * p];
      if (isEmpty(p) && !std::equal(color, color + 4, &this->Background[4 * p]) && isEmpty(p - 1) &&
        isEmpty(p + 1) && isEmpty(p - this->Width) && isEmpty(p + this->Width))
      {
        return true;
      }
    }
  }
  return false;
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
/// @param hasProps whether this rank has anything to add
void PropImage::Gather(Ranks& ranks, bool hasProps, const DepthRange& range)
{
  Message message;
  if (hasProps && !ranks.IsRoot())
  {
    message = this->PackPixels();
  }
  if (!hasProps && !ranks.IsRoot())
  {
    this->Color.clear();
  }
  for (const Message& pixels : ranks.ToRoot(std::move(message)))
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
  this->Blit.Replace(frame.Window, frame.Rectangle, this->Color.data(), this->WindowDepth.data());
}

const float* PropImage::JoinDepth(
  const SplattedPicture& picture, const DepthRange& range, float deepest)
{
  for (const auto& pixel : picture.BlurredPixels.Blurred())
  {
    this->WindowDepth[pixel.Index] = 1.0f;
  }
  const auto join = [&range](float propDepth, float distance) {
    if (distance <= 0.0f && !(range.Parallel && distance != 0.0f))
    {
      return propDepth;
    }
    const double depth = range.WindowDepthOf(distance);
    return std::min(propDepth, static_cast<float>(std::min(std::max(depth, 0.0), 1.0)));
  };
  const bool hasProps = !this->Distances.empty();
  this->WindowDepth.resize(picture.Pixels);
  vtkSMPTools::For(0, static_cast<vtkIdType>(picture.Pixels), [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType p = begin; p < end; ++p)
    {
      const float largest = picture.Color[4 * p + 3] > 0.0f ? deepest : 1.0f;
      const float prop = hasProps ? this->WindowDepth[p] : 1.0f;
      this->WindowDepth[p] = std::min(join(prop, picture.Depth[p]), largest);
    }
  });
  return this->WindowDepth.data();
}

/// The colour under a splatted pixel; the background of the pixel itself if nothing is there.
const float* PropImage::ColorUnder(const DepthImageSurfels::Pixel& pixel) const
{
  const bool isKnown = pixel.Under != DepthImageSurfels::NoPixel &&
    (this->HasBackdrop || std::isfinite(this->WideDistances[pixel.Under]));
  return isKnown ? &this->WideColor[4 * pixel.Under] : &this->Background[4 * pixel.Index];
}

const float* PropImage::Compose(const SplattedPicture& picture)
{
  float* under = this->Color.data();
  for (const auto* pixels : { &picture.BlurredPixels.Blurred(), &picture.BlurredPixels.Mixed() })
  {
    for (const DepthImageSurfels::Pixel& pixel : *pixels)
    {
      std::copy_n(this->ColorUnder(pixel), 4, under + 4 * pixel.Index);
    }
  }
  const bool linear = this->Image.LinearLight;
  const float* color = picture.Color;
  const auto count = static_cast<vtkIdType>(this->Color.size() / 4);
  vtkSMPTools::For(0, count, [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType p = begin; p < end; ++p)
    {
      if (color[4 * p + 3] > 0.0f)
      {
        linear ? MixLight(color + 4 * p, under + 4 * p) : Mix(color + 4 * p, under + 4 * p);
      }
    }
  });
  return under;
}

void PropImage::ReleaseGraphicsResources(vtkWindow* window)
{
  this->Blit.ReleaseGraphicsResources(window);
  this->Wide.ReleaseGraphicsResources(window);
}
}
