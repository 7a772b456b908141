// SPDX-License-Identifier: BSD-3-Clause
/**
 * The frame that a pass draws: where it lies in the framebuffer, and its depth. Internal to the
 * module.
 */
#pragma once

class vtkCamera;
class vtkOpenGLRenderWindow;
class vtkRenderState;
class vtkRenderer;

namespace SurfelSplatting
{
/// A rectangle of the current framebuffer, px.
struct PixelRectangle
{
  int X = 0, Y = 0, Width = 0, Height = 0;
};

/// Converts window depth [0, 1] to distance along the view direction, and back, for a projection
/// matrix with z in [-1, 1].
struct DepthRange
{
  double P22 = 1.0, P23 = 0.0; // elements of the matrix
  bool Parallel = false;

  DepthRange() = default;
  DepthRange(vtkCamera* camera, double aspect);

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

struct PassFrame
{
  explicit PassFrame(const vtkRenderState* state);

  /// Whether there are pixels and OpenGL to draw them with.
  bool CanBeDrawn() const
  {
    return this->Window && this->Rectangle.Width > 0 && this->Rectangle.Height > 0;
  }

  const vtkRenderState* State;
  vtkRenderer* Renderer;
  vtkOpenGLRenderWindow* Window; ///< null if the window is not one of OpenGL
  PixelRectangle Rectangle;
  double Aspect = 1.0; ///< width / height for the camera's projection
  DepthRange Range;    ///< of the camera
};
}
