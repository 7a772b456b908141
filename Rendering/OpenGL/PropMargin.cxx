// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/PropMargin.h"

#include "Rendering/OpenGL/CameraChanges.h"
#include "Rendering/OpenGL/Functions.h"
#include "Rendering/OpenGL/PropsBeyond.h"
#include "SurfelData/SMPExecutor.h"

#include <vtkCamera.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkRenderPass.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>

namespace SurfelSplatting
{
namespace
{
/// A pixel that goes from one rank to another.
struct SentPixel
{
  std::uint64_t Index;
  float Distance, Color[4];
};
}

bool PropMargin::Draw(
  const PassFrame& frame, int margin, const std::vector<vtkProp*>& props, vtkRenderPass* delegate)
{
  this->Margin = margin;
  const int size[2] = { frame.Rectangle.Width, frame.Rectangle.Height };
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
  const bool isRead = this->Read(frame);
  this->Wide.End(false);
  return isRead;
}

/// Reads the four sides of the margin.
bool PropMargin::Read(const PassFrame& frame)
{
  const int margin = this->Margin;
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

void PropMargin::PlaceMiddle(const PassFrame& frame, int margin, const PropPixels& pixels)
{
  this->Margin = margin;
  const auto beside = static_cast<std::size_t>(margin), width = pixels.Width;
  const std::size_t wide = width + 2 * beside;
  const auto high = static_cast<std::size_t>(frame.Rectangle.Height) + 2 * beside;
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
      if (y < beside || y >= high - beside)
      {
        convert(0, wide);
        continue;
      }
      convert(0, beside);
      convert(beside + width, beside);
      const std::size_t from = (y - beside) * width, to = row + beside;
      std::copy_n(pixels.Distances.data() + from, width, this->WideDistances.data() + to);
      std::copy_n(pixels.Color.data() + 4 * from, 4 * width, this->WideColor.data() + 4 * to);
    }
  });
}

Message PropMargin::Pack() const
{
  std::vector<SentPixel> sent;
  for (std::size_t p = 0; p < this->WideDistances.size(); ++p)
  {
    if (std::isfinite(this->WideDistances[p]))
    {
      const float* c = &this->WideColor[4 * p];
      sent.push_back({ p, this->WideDistances[p], { c[0], c[1], c[2], c[3] } });
    }
  }
  Message message;
  Put(sent.data(), sent.size(), message);
  return message;
}

void PropMargin::Add(const Message& sent, PropPixels& pixels)
{
  const auto margin = static_cast<std::size_t>(this->Margin);
  const std::size_t wide = pixels.Width + 2 * margin;
  for (MessageReader reader(sent); reader.Size() > 0;)
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
    if (x < pixels.Width && y < pixels.Distances.size() / pixels.Width) // not in the margin
    {
      const std::size_t p = y * pixels.Width + x;
      pixels.Distances[p] = pixel.Distance;
      std::copy_n(pixel.Color, 4, &pixels.Color[4 * p]);
    }
  }
}

void PropMargin::ReleaseGraphicsResources(vtkWindow* window)
{
  this->Wide.ReleaseGraphicsResources(window);
}
}
