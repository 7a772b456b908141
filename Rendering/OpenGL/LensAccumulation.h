// SPDX-License-Identifier: BSD-3-Clause
/**
 * The mean of views from cells or points of a lens, each rendered by a pass (Haeberli and Akeley
 * 1990), in 32-bit float. Internal to the module.
 */
#pragma once

#include "Core/Lens/Lens.h"
#include "Core/Lens/SubApertures.h"

#include "Rendering/OpenGL/FrameBlit.h"
#include "Rendering/OpenGL/OffscreenFrame.h"

#include <vtkNew.h>
#include <vtkWeakPointer.h>

#include <functional>
#include <memory>

class vtkCamera;
class vtkOpenGLFramebufferObject;
class vtkOpenGLQuadHelper;
class vtkOpenGLRenderWindow;
class vtkRenderPass;
class vtkRenderState;
class vtkTextureObject;
class vtkWindow;

namespace SurfelSplatting
{
/// What to take the mean of.
struct LensViews
{
  LensViews(vtkCamera* camera, const int size[2], double aspect, const Lens& lens,
    const ApertureSampling& sampling);

  /// Whether there is nothing to take a mean of: one view through all of the lens.
  bool IsOne() const
  {
    return this->Cells.size() == 1 && this->Cells[0].Optics.Radius == this->Optics.Radius &&
      this->PixelFilter == 0.0;
  }

  vtkCamera* Camera;
  double Aspect;
  View Middle; // what the camera sees
  Lens Optics;
  std::vector<SubAperture> Cells;
  int Count;                     ///< of views
  double PixelFilter = 0.0;      ///< standard deviation of a Gaussian filter, made by shifts, px
  bool LinearLight = false;      ///< the mean is of light, colours being its sRGB codes
  double Deepest = 1.0;          ///< depth of pixels with any colour, at most
  std::function<bool(bool)> All; ///< of all processes that render the views together, or empty
};

class LensAccumulation
{
public:
  LensAccumulation();
  ~LensAccumulation();

  /**
   * Renders the views with `delegate` and draws their mean, and the first one's depth, into the
   * rectangle of the current framebuffer: over what is there where the renderer is transparent,
   * otherwise instead of it. Each view is rendered through a copy of the camera within a cell of
   * the lens, FocalDisk being the cell's diameter, with as many samples as the current framebuffer
   * has. Views after the first one are left out once the window's rendering is aborted. False: its
   * textures could not be made, and nothing is drawn. A renderer that preserves the depth of layers
   * below has it in every view.
   */
  bool Render(const vtkRenderState* state, const PixelRectangle& rectangle, const LensViews& views,
    vtkRenderPass* delegate);

  void ReleaseGraphicsResources(vtkWindow* window);

private:
  void KeepBelow(
    vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle, bool depth, bool color);
  bool Prepare(vtkOpenGLRenderWindow* window, int width, int height);
  bool RenderView(const vtkRenderState* state, const LensViews& views, int index,
    const PixelRectangle& rectangle, vtkRenderPass* delegate);
  void AddView(
    vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle, bool first, bool toLight);
  enum class Blending
  {
    Replace,
    Add,
    Over
  };
  enum class Code
  {
    Keep,
    ToLight,
    ToCodes
  };
  void Draw(vtkOpenGLRenderWindow* window, vtkTextureObject* color, vtkTextureObject* depth,
    double share, Blending blending, Code code, vtkTextureObject* below = nullptr,
    double deepest = 1.0);

  OffscreenFrame Frame;
  vtkNew<vtkOpenGLFramebufferObject> Sum;
  vtkNew<vtkTextureObject> FirstDepth, SumColor, DepthBelow, ColorBelow;
  FrameBlit Blit;
  bool HasDepthBelow = false;
  bool HasColorBelow = false;
  std::unique_ptr<vtkOpenGLQuadHelper> Quad;
  vtkWeakPointer<vtkOpenGLRenderWindow> QuadWindow;
};
}
