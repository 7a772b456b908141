// SPDX-License-Identifier: BSD-3-Clause
/**
 * Float textures with one texel per pixel of a picture. Internal to the module.
 */
#pragma once

class vtkOpenGLRenderWindow;
class vtkPixelBufferObject;
class vtkTextureObject;

namespace SurfelSplatting
{
enum class TextureKind
{
  Color, ///< RGBA, 32-bit float
  Depth  ///< depth attachment, 32-bit integer as in VTK's framebuffers: its volumes need a copy
};

/// Gives a texture a size, px, unless it has it already. False if it could not be made.
bool FitTexture(vtkOpenGLRenderWindow* window, vtkTextureObject* texture, TextureKind kind,
  int width, int height);

/// A picture in main memory, row 0 at the bottom.
struct PixelValues
{
  int Width, Height; ///< px
  int Components;    ///< 1 or 4
  const float* Values;
};

/// Copies a picture into a texture. False if the texture could not be made.
bool Upload(vtkOpenGLRenderWindow* window, vtkTextureObject* texture, const PixelValues& picture);

/// Pixels in a buffer of OpenGL's, row 0 at the bottom.
struct BufferedPixels
{
  int Width, Height; ///< px
  int Components;    ///< 1 or 4
  int Type;          ///< VTK_FLOAT or VTK_UNSIGNED_CHAR
  vtkPixelBufferObject* Values;
};

/// Copies pixels of a buffer into a texture. False if the texture could not be made.
bool Upload(vtkOpenGLRenderWindow* window, vtkTextureObject* texture, const BufferedPixels& pixels);
}
