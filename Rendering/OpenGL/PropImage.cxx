// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/PropImage.h"

#include "Core/Base/LinearLight.h"
#include "Rendering/OpenGL/CameraChanges.h"
#include "vtkSurfelMapper.h"

#include <vtk_glew.h>

#include <vtkActor.h>
#include <vtkAssemblyNode.h>
#include <vtkAssemblyPath.h>
#include <vtkCamera.h>
#include <vtkMath.h>
#include <vtkMatrix4x4.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkProp3D.h>
#include <vtkRenderPass.h>
#include <vtkRenderState.h>
#include <vtkRenderer.h>
#include <vtkSMPTools.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace SurfelSplatting
{
namespace
{
/// Whether any part of a prop is in space, and no surfels.
bool IsOther(vtkProp* prop, bool opaqueOnly)
{
  bool other = false;
  prop->InitPathTraversal();
  while (vtkAssemblyPath* path = prop->GetNextPath())
  {
    vtkProp* leaf = path->GetLastNode()->GetViewProp();
    auto* actor = vtkActor::SafeDownCast(leaf);
    other = other ||
      (vtkProp3D::SafeDownCast(leaf) && leaf->GetVisibility() &&
        (!opaqueOnly || leaf->HasOpaqueGeometry()) &&
        !(actor && vtkSurfelMapper::SafeDownCast(actor->GetMapper())));
  }
  return other;
}

/// Premultiplied RGBA over what is there.
void Mix(const float* color, float* under)
{
  const float through = 1.0f - color[3];
  for (int c = 0; c < 4; ++c)
  {
    under[c] = color[c] + through * under[c];
  }
}

/// The same of light over sRGB codes.
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

/// The distances of a box's corners.
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
}

bool HasOtherProps(vtkRenderer* renderer, bool opaqueOnly)
{
  const std::vector<vtkProp*> props = VisibleProps(renderer);
  return std::any_of(
    props.begin(), props.end(), [=](vtkProp* prop) { return IsOther(prop, opaqueOnly); });
}

void DistancesOfOtherProps(vtkRenderer* renderer, double distances[2])
{
  vtkCamera* camera = renderer->GetActiveCamera();
  double found[2] = { VTK_DOUBLE_MAX, -VTK_DOUBLE_MAX };
  for (vtkProp* prop : VisibleProps(renderer))
  {
    const double* bounds = IsOther(prop, true) ? prop->GetBounds() : nullptr;
    if (bounds && vtkMath::AreBoundsInitialized(bounds))
    {
      AddDistances(bounds, camera->GetModelViewTransformMatrix(), found);
    }
  }
  const double* range = camera->GetClippingRange();
  distances[0] = std::min(std::max(found[0], range[0]), range[1]);
  distances[1] = std::min(std::max(found[1], range[0]), range[1]);
}

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

bool PropImage::ReadBackground(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle)
{
  return this->Blit.ReadColor(window, rectangle, this->Background);
}

bool PropImage::Read(const vtkRenderState* state, const PixelRectangle& rectangle,
  const DepthRange& range, const std::vector<float>& distances, int margin, vtkRenderPass* delegate)
{
  auto* window = vtkOpenGLRenderWindow::SafeDownCast(state->GetRenderer()->GetRenderWindow());
  if (!this->Blit.ReadColor(window, rectangle, this->Color))
  {
    return false;
  }
  this->Whole.Margin = margin;
  this->Whole.Antialiased = CurrentSamples() > 0;
  if (margin > 0 && !this->DrawWide(state, rectangle, range, delegate))
  {
    this->Whole.Margin = 0;
  }
  this->PlaceMiddle(rectangle, distances);
  this->HasBackdrop = margin > 0 && this->FindBackdrop(distances);
  this->Whole.Depth = this->WideDistances.data();
  this->Whole.Colors = this->WideColor.data();
  return true;
}

void PropImage::Gather(Ranks& ranks, bool mine, std::vector<float>& distances)
{
  Message message;
  if (mine && !ranks.IsRoot())
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
    Put(pixels.data(), pixels.size(), message);
  }
  if (!mine && !ranks.IsRoot())
  {
    this->Color.clear();
  }
  const auto margin = static_cast<std::size_t>(this->Whole.Margin);
  const std::size_t wide = this->Width + 2 * margin;
  for (const Message& pixels : ranks.ToRoot(std::move(message)))
  {
    for (MessageReader reader(pixels); reader.Size() > 0;)
    {
      const auto pixel = reader.Get<SentPixel>();
      if (pixel.Index < this->WideDistances.size() &&
        pixel.Distance < this->WideDistances[pixel.Index])
      {
        this->WideDistances[pixel.Index] = pixel.Distance;
        std::copy_n(pixel.Color, 4, &this->WideColor[4 * pixel.Index]);
        const std::size_t x = pixel.Index % wide - margin, y = pixel.Index / wide - margin;
        if (x < this->Width && y < distances.size() / this->Width) // not in the margin
        {
          distances[y * this->Width + x] = pixel.Distance;
          std::copy_n(pixel.Color, 4, &this->Color[4 * (y * this->Width + x)]);
        }
      }
    }
  }
}

const float* PropImage::WithoutGathered(const std::vector<float>& distances)
{
  if (this->Color.size() != 4 * distances.size())
  {
    return nullptr;
  }
  for (std::size_t p = 0; p < distances.size(); ++p)
  {
    if (std::isfinite(distances[p]))
    {
      std::fill_n(&this->Color[4 * p], 4, 0.0f);
    }
  }
  return this->Color.data();
}

bool PropImage::DrawWide(const vtkRenderState* state, const PixelRectangle& rectangle,
  const DepthRange& range, vtkRenderPass* delegate)
{
  vtkRenderer* renderer = state->GetRenderer();
  auto* window = vtkOpenGLRenderWindow::SafeDownCast(renderer->GetRenderWindow());
  const int size[2] = { rectangle.Width, rectangle.Height };
  const PixelRectangle wide{ 0, 0, size[0] + 2 * this->Whole.Margin,
    size[1] + 2 * this->Whole.Margin };
  const vtkSmartPointer<vtkCamera> camera =
    CopyCamera(renderer->GetActiveCamera(), renderer->GetTiledAspectRatio());
  WidenCamera(camera, size, this->Whole.Margin);
  if (!this->Wide.Begin(window, wide.Width, wide.Height, CurrentSamples()))
  {
    return false;
  }
  vtkOpenGLState* glState = window->GetState();
  glState->vtkglClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  glState->vtkglClearDepth(1.0);
  glState->vtkglDepthMask(GL_TRUE);
  glState->vtkglClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  RenderThrough(state, camera, this->Wide.Framebuffer(), delegate);
  const bool good = this->Blit.ReadColor(window, wide, this->WideColor) &&
    this->Blit.ReadDepth(window, wide, this->WindowDepth);
  this->Wide.End(false);
  if (good)
  {
    ToDistances(this->WindowDepth, range, this->WideDistances);
  }
  return good;
}

/// In the middle of the wide picture, the picture itself.
void PropImage::PlaceMiddle(const PixelRectangle& rectangle, const std::vector<float>& distances)
{
  this->Width = static_cast<std::size_t>(rectangle.Width);
  const std::size_t width = this->Width;
  const auto height = static_cast<std::size_t>(rectangle.Height);
  const auto margin = static_cast<std::size_t>(this->Whole.Margin);
  const std::size_t wide = width + 2 * margin;
  this->WideDistances.resize(wide * (height + 2 * margin));
  this->WideColor.resize(4 * this->WideDistances.size());
  for (std::size_t y = 0; y < height; ++y)
  {
    const std::size_t to = (y + margin) * wide + margin;
    std::copy_n(distances.data() + y * width, width, this->WideDistances.data() + to);
    std::copy_n(this->Color.data() + 4 * y * width, 4 * width, this->WideColor.data() + 4 * to);
  }
}

/// Whether something without a depth, such as a skybox, was drawn: where nothing is, and not beside
/// an edge, which may be antialiased, there is another colour than before.
bool PropImage::FindBackdrop(const std::vector<float>& distances) const
{
  const auto isNothing = [&](std::size_t p) { return std::isinf(distances[p]); };
  const std::size_t height = distances.size() / this->Width;
  for (std::size_t y = 1; y + 1 < height; ++y)
  {
    for (std::size_t x = 1; x + 1 < this->Width; ++x)
    {
      const std::size_t p = y * this->Width + x;
      const float* color = &this->Color[4 * p];
      if (isNothing(p) && !std::equal(color, color + 4, &this->Background[4 * p]) &&
        isNothing(p - 1) && isNothing(p + 1) && isNothing(p - this->Width) &&
        isNothing(p + this->Width))
      {
        return true;
      }
    }
  }
  return false;
}

/// Where nothing is, the background of the pixel itself.
const float* PropImage::ColorUnder(const DepthImageSurfels::Pixel& pixel) const
{
  const bool known = pixel.Under != DepthImageSurfels::NoPixel &&
    (this->HasBackdrop || std::isfinite(this->WideDistances[pixel.Under]));
  return known ? &this->WideColor[4 * pixel.Under] : &this->Background[4 * pixel.Index];
}

const float* PropImage::Compose(const DepthImageSurfels& pixels, const float* color)
{
  float* under = this->Color.data();
  for (const auto* list : { &pixels.Taken(), &pixels.Mixed() })
  {
    for (const DepthImageSurfels::Pixel& pixel : *list)
    {
      std::copy_n(this->ColorUnder(pixel), 4, under + 4 * pixel.Index);
    }
  }
  const bool linear = this->Whole.LinearLight;
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
