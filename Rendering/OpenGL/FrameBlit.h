// SPDX-License-Identifier: BSD-3-Clause
/**
 * Copies pictures between the core's memory and OpenGL's framebuffer: reads the image of other
 * props, and draws a finished frame over it. Internal to the module.
 */
#pragma once

#include "Rendering/OpenGL/FrameQuad.h"
#include "Rendering/OpenGL/PassFrame.h"

#include <vtkNew.h>

#include <vector>

class vtkOpenGLRenderWindow;
class vtkOpenGLState;
class vtkTextureObject;
class vtkWindow;

namespace SurfelSplatting
{
class FrameBlit
{
public:
  FrameBlit();
  ~FrameBlit();

  /// Reads the depth of the current draw framebuffer, multisampled or not, row 0 at the bottom.
  /// False if it could not be read.
  bool ReadDepth(
    vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle, std::vector<float>& depth);

  /// Reads the colour of the current draw framebuffer as RGBA floats, row 0 at the bottom. False if
  /// it could not be read.
  bool ReadColor(
    vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle, std::vector<float>& color);

  /// Reads colour and depth of the current draw framebuffer into the same rectangle of a picture.
  /// @param width of the picture, px
  bool ReadPart(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle, int width,
    std::vector<float>& color, std::vector<float>& depth);

  /**
   * Draws a premultiplied RGBA frame into the current draw framebuffer.
   * @param color       [height][width][4]
   * @param windowDepth [height][width] new values of the depth buffer, [0, 1]
   * @param replace     as of FrameQuad::Draw
   * @return false if no OpenGL texture of the picture could be created; nothing is drawn
   */
  bool Draw(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle, const float* color,
    const float* windowDepth, bool replace);

  /// Clears a rectangle of the current draw framebuffer: transparent black, depth 1.
  static void Clear(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle);

  void ReleaseGraphicsResources(vtkWindow* window);

private:
  enum class Plane
  {
    Color,
    Depth
  };
  /// Where values go; rows are Stride pixels apart.
  struct Target
  {
    float* Values;
    int Stride;
  };
  bool Read(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle, Plane plane,
    const Target& target);
  bool ReadBytes(const PixelRectangle& rectangle, const Target& target);
  bool Resolve(vtkOpenGLState* state, const PixelRectangle& rectangle, int framebuffer, Plane plane,
    const Target& target);

  std::vector<unsigned char> Bytes;
  vtkNew<vtkTextureObject> Color;
  vtkNew<vtkTextureObject> Depth;
  FrameQuad Quad;
};
}
