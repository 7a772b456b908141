// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/PixelTexture.h"

#include "Rendering/OpenGL/Functions.h"

#include <vtkOpenGLRenderWindow.h>
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
}

bool FitTexture(
  vtkOpenGLRenderWindow* window, vtkTextureObject* texture, TextureKind kind, int width, int height)
{
  if (SetUp(window, texture, width, height))
  {
    return true;
  }
  const auto w = static_cast<unsigned int>(width), h = static_cast<unsigned int>(height);
  return kind == TextureKind::Depth ? texture->AllocateDepth(w, h, vtkTextureObject::Float32)
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
  // Into the memory that the texture has: allocating it costs as much as the copy.
  texture->Bind();
  GLint alignment = 4;
  glGetIntegerv(GL_UNPACK_ALIGNMENT, &alignment);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, picture.Width, picture.Height,
    picture.Components == 1 ? GL_RED : GL_RGBA, GL_FLOAT, picture.Values);
  glPixelStorei(GL_UNPACK_ALIGNMENT, alignment);
  return true;
}
}
