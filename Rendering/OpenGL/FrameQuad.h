// SPDX-License-Identifier: BSD-3-Clause
/**
 * Draws textures with colours and depths into a rectangle of the framebuffer. Internal to the
 * module.
 */
#pragma once

#include "Rendering/OpenGL/FullScreenQuad.h"
#include "Rendering/OpenGL/PassFrame.h"

class vtkTextureObject;

namespace SurfelSplatting
{
/// Textures of one texel per pixel.
struct FrameTextures
{
  vtkTextureObject* Color; ///< premultiplied RGBA
  vtkTextureObject* Depth; ///< new values of the depth buffer, [0, 1]
};

class FrameQuad
{
public:
  FrameQuad();

  /**
   * Draws into the current draw framebuffer.
   * @param replace whether all pixels are replaced; otherwise colours are blended over those below,
   * and pixels without alpha stay as they are
   * @return false, and nothing is drawn, if the program does not compile
   */
  bool Draw(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle,
    const FrameTextures& textures, bool replace);

  void ReleaseGraphicsResources() { this->Quad.ReleaseGraphicsResources(); }

private:
  FullScreenQuad Quad;
};
}
