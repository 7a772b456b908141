// SPDX-License-Identifier: BSD-3-Clause
/**
 * Between the core's frames and OpenGL: reads the depth that other props have left and blends a
 * finished frame over them. Internal to the module.
 */
#pragma once

#include <vtkNew.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLState.h>
#include <vtkWeakPointer.h>

#include <memory>
#include <vector>

class vtkOpenGLQuadHelper;
class vtkRenderState;
class vtkTextureObject;
class vtkWindow;

namespace SurfelSplatting
{
/// A rectangle of the current framebuffer, px.
struct PixelRectangle
{
  int X = 0, Y = 0, Width = 0, Height = 0;
};

/// Where a state's picture lies in the framebuffer that it is drawn into.
PixelRectangle FrameRectangle(const vtkRenderState* state);

/// Window depth [0, 1] <-> distance along the view direction, from a projection matrix for z in
/// [-1, 1].
struct DepthRange
{
  double P22, P23;
  bool Parallel;

  double DistanceOf(double windowDepth) const
  {
    const double ndc = 2.0 * windowDepth - 1.0;
    return this->Parallel ? (this->P23 - ndc) / this->P22 : this->P23 / (ndc + this->P22);
  }

  double WindowDepthOf(double distance) const
  {
    const double ndc =
      this->Parallel ? this->P23 - this->P22 * distance : this->P23 / distance - this->P22;
    return 0.5 * (ndc + 1.0);
  }
};

/// While it lives a quad is drawn over all of the viewport: colour and depth as they come from the
/// shader, blended by the functions that are set. All is as before afterwards.
class QuadState
{
public:
  explicit QuadState(vtkOpenGLState* state);

private:
  vtkOpenGLState::ScopedglEnableDisable Blend, DepthTest, Cull;
  vtkOpenGLState::ScopedglBlendFuncSeparate BlendFunction;
  vtkOpenGLState::ScopedglDepthFunc DepthFunction;
  vtkOpenGLState::ScopedglDepthMask DepthMask;
};

/// A picture of 1 or 4 floats a pixel into a texture, read pixel by pixel; false where it cannot be
/// had.
bool Upload(vtkOpenGLRenderWindow* window, vtkTextureObject* texture,
  const PixelRectangle& rectangle, int components, const float* values);

class FrameBlit
{
public:
  FrameBlit();
  ~FrameBlit();

  /// Depth of the current draw framebuffer, multisampled or not, row 0 at the bottom. False: it
  /// could not be read.
  bool ReadDepth(
    vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle, std::vector<float>& depth);

  /// Colour of the current draw framebuffer, linear RGBA floats, row 0 at the bottom. False: it
  /// could not be read.
  bool ReadColor(
    vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle, std::vector<float>& color);

  /**
   * Puts a premultiplied RGBA frame into the current draw framebuffer instead of what is there: all
   * pixels, colour and depth, as they are. Otherwise as Draw.
   */
  bool Replace(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle, const float* color,
    const float* windowDepth)
  {
    return this->Draw(window, rectangle, color, windowDepth, true);
  }

  /**
   * Blends a premultiplied RGBA frame over the current draw framebuffer.
   * @param color       [height][width][4]
   * @param windowDepth [height][width] what the depth buffer shall hold where alpha > 0
   */
  bool Draw(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle, const float* color,
    const float* windowDepth, bool replace = false);

  /// Empties a rectangle of the current draw framebuffer: no colour, nothing drawn.
  static void Clear(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle);

  void ReleaseGraphicsResources(vtkWindow* window);

private:
  enum class Plane
  {
    Color,
    Depth
  };
  bool Read(
    vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle, Plane plane, float* values);
  bool Resolve(vtkOpenGLState* state, const PixelRectangle& rectangle, int framebuffer, Plane plane,
    float* values);

  vtkNew<vtkTextureObject> Color;
  vtkNew<vtkTextureObject> Depth;
  std::unique_ptr<vtkOpenGLQuadHelper> Quad;
  vtkWeakPointer<vtkOpenGLRenderWindow> QuadWindow;
};
}
