// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/PixelTexture.h"

#include "Rendering/OpenGL/Functions.h"

#include <vtkOpenGLRenderWindow.h>
#include <vtkPixelBufferObject.h>
#include <vtkTextureObject.h>

namespace SurfelSplatting
{
namespace
{
/// Makes a texture one of the window, read without interpolation. Returns whether it has the size.
bool SetUp(vtkOpenGLRenderWindow* window, vtkTextureObject* texture, int width, int height)
{
  texture->SetContext(window);
  texture->SetMinificationFilter(vtkTextureObject::Nearest);
  texture->SetMagnificationFilter(vtkTextureObject::Nearest);
  texture->SetWrapS(vtkTextureObject::ClampToEdge);
  texture->SetWrapT(vtkTextureObject::ClampToEdge);
  return texture->GetHandle() && texture->GetWidth() == static_cast<unsigned int>(width) &&
    texture->GetHeight() == static_cast<unsigned int>(height);
}

/// How values in memory make up a pixel.
struct PixelFormat
{
  int Components, Type; // constants of OpenGL
};

/// Copies into the memory that a texture has: allocating it costs as much as the copy.
/// @param values null: those of the bound buffer
void CopyInto(
  vtkTextureObject* texture, int width, int height, const PixelFormat& format, const void* values)
{
  texture->Bind();
  GLint alignment = 4;
  glGetIntegerv(GL_UNPACK_ALIGNMENT, &alignment);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, static_cast<GLenum>(format.Components),
    static_cast<GLenum>(format.Type), values);
  glPixelStorei(GL_UNPACK_ALIGNMENT, alignment);
}
}

bool FitTexture(
  vtkOpenGLRenderWindow* window, vtkTextureObject* texture, TextureKind kind, int width, int height)
{
  if (SetUp(window, texture, width, height))
  {
    return true;
  }
  const auto w = static_cast<unsigned int>(width), h = static_cast<unsigned int>(height);
  return kind == TextureKind::Depth ? texture->AllocateDepth(w, h, vtkTextureObject::Fixed32)
                                    : texture->Allocate2D(w, h, 4, VTK_FLOAT);
}

bool Upload(vtkOpenGLRenderWindow* window, vtkTextureObject* texture, const PixelValues& picture)
{
  if (!SetUp(window, texture, picture.Width, picture.Height))
  {
    return texture->Create2DFromRaw(static_cast<unsigned int>(picture.Width),
      static_cast<unsigned int>(picture.Height), picture.Components, VTK_FLOAT,
      const_cast<float*>(picture.Values));
  }
  CopyInto(texture, picture.Width, picture.Height,
    { picture.Components == 1 ? GL_RED : GL_RGBA, GL_FLOAT }, picture.Values);
  return true;
}

bool Upload(vtkOpenGLRenderWindow* window, vtkTextureObject* texture, const BufferedPixels& pixels)
{
  const int width = pixels.Width, height = pixels.Height;
  if (!SetUp(window, texture, width, height) &&
    !texture->Allocate2D(static_cast<unsigned int>(width), static_cast<unsigned int>(height),
      pixels.Components, pixels.Type))
  {
    return false;
  }
  pixels.Values->BindToUnPackedBuffer();
  CopyInto(texture, width, height,
    { pixels.Components == 1 ? GL_RED : GL_RGBA,
      pixels.Type == VTK_FLOAT ? GL_FLOAT : GL_UNSIGNED_BYTE },
    nullptr);
  pixels.Values->UnBind();
  return true;
}
}
