// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/BufferedFrame.h"

#include "Rendering/OpenGL/Functions.h"
#include "Rendering/OpenGL/PixelTexture.h"

#include <vtkOpenGLRenderWindow.h>
#include <vtkPixelBufferObject.h>
#include <vtkSmartPointer.h>
#include <vtkTextureObject.h>

#include <cstring>

namespace SurfelSplatting
{
BufferedFrame::BufferedFrame() = default;
BufferedFrame::~BufferedFrame()
{
  this->ReleaseBuffers();
}

bool BufferedFrame::IsWorthwhile()
{
  // Mesa's llvmpipe copies into textures in less time than it draws them.
  const auto* name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  return name && std::strncmp(name, "llvmpipe", 8) != 0;
}

BufferedFrame::Memory BufferedFrame::Begin(
  vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle)
{
  this->Width = this->Height = 0;
  const auto pixels = static_cast<unsigned int>(rectangle.Width) * rectangle.Height;
  if (this->Window != window)
  {
    this->ReleaseBuffers();
    this->Window = window;
  }
  this->Colors->SetContext(window);
  this->Depths->SetContext(window);
  Memory memory;
  memory.Depth = static_cast<float*>(this->Depths->MapUnpackedBuffer(VTK_FLOAT, pixels, 1));
  if (!memory.Depth)
  {
    return {};
  }
  memory.Color =
    static_cast<unsigned char*>(this->Colors->MapUnpackedBuffer(VTK_UNSIGNED_CHAR, pixels, 4));
  if (!memory.Color)
  {
    this->Depths->UnmapUnpackedBuffer();
  }
  return memory;
}

bool BufferedFrame::Draw(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle)
{
  const int width = rectangle.Width, height = rectangle.Height;
  this->Colors->UnmapUnpackedBuffer();
  this->Depths->UnmapUnpackedBuffer();
  if (!Upload(window, this->Color, { width, height, 4, VTK_UNSIGNED_CHAR, this->Colors }) ||
    !Upload(window, this->Depth, { width, height, 1, VTK_FLOAT, this->Depths }))
  {
    return false;
  }
  this->Width = width;
  this->Height = height;
  return this->DrawAgain(window, rectangle);
}

bool BufferedFrame::DrawAgain(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle)
{
  return this->Width == rectangle.Width && this->Height == rectangle.Height &&
    this->Color->GetHandle() &&
    this->Quad.Draw(window, rectangle, { this->Color, this->Depth }, true);
}

/// vtkPixelBufferObject deletes its buffer in the current context, which may be another window's.
void BufferedFrame::ReleaseBuffers()
{
  const vtkSmartPointer<vtkOpenGLRenderWindow> window = this->Window.Get();
  if (window)
  {
    window->PushContext();
  }
  this->Colors->SetContext(nullptr);
  this->Depths->SetContext(nullptr);
  if (window)
  {
    window->PopContext();
  }
  this->Window = nullptr;
}

void BufferedFrame::ReleaseGraphicsResources(vtkWindow* window)
{
  this->Width = this->Height = 0;
  this->Quad.ReleaseGraphicsResources();
  this->ReleaseBuffers();
  this->Color->ReleaseGraphicsResources(window);
  this->Depth->ReleaseGraphicsResources(window);
}
}
