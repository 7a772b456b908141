// SPDX-License-Identifier: BSD-3-Clause
/**
 * Averages views from cells or points of a lens, each rendered by a pass (Haeberli and Akeley
 * 1990), in 32-bit float. Internal to the module.
 */
#pragma once

#include "Core/Base/Ranks.h"
#include "Core/Lens/Lens.h"
#include "Core/Lens/SubApertures.h"
#include "Core/Lens/View.h"
#include "Rendering/OpenGL/FrameBlit.h"
#include "Rendering/OpenGL/FullScreenQuad.h"
#include "Rendering/OpenGL/OffscreenFrame.h"
#include "Rendering/OpenGL/OwningWindow.h"
#include "Rendering/OpenGL/PassFrame.h"

#include <vtkNew.h>

#include <vector>

class vtkOpenGLFramebufferObject;
class vtkOpenGLRenderWindow;
class vtkRenderPass;
class vtkTextureObject;
class vtkWindow;

namespace SurfelSplatting
{
/// The views of a lens.
struct LensViews
{
  /// @param view what the camera sees through all of the lens
  LensViews(const View& view, const Lens& lens, const ApertureSampling& sampling);

  /// Whether there is one view only, through all of the lens.
  bool IsOne() const
  {
    return this->Cells.size() == 1 && this->Cells[0].Optics.Radius == this->Optics.Radius &&
      this->PixelFilter == 0.0;
  }

  View Whole; // through all of the lens
  Lens Optics;
  std::vector<SubAperture> Cells;
  int Count;                ///< number of views
  double PixelFilter = 0.0; ///< standard deviation of a Gaussian filter, made by shifts, px
  bool LinearLight = false; ///< colours are sRGB codes; the mean is of the light
  double Deepest = 1.0;     ///< largest window depth of pixels with any colour
  Ranks* Group = nullptr;   ///< all processes that render the views together; null: this one
};

class LensAccumulation
{
public:
  LensAccumulation();
  ~LensAccumulation();

  /**
   * Renders the views with `delegate` and draws their mean, and the first view's depth, into the
   * frame: over what is there if the renderer is transparent, otherwise instead of it. Each view is
   * rendered through a copy of the camera within a cell of the lens, with the diameter of a
   * disc of the cell's area as its FocalDisk, and with as many samples as the current framebuffer
   * has. If the window's rendering is aborted, the remaining views are left out. If the renderer
   * preserves the depth of the layers below, every view has it. Returns false, and draws nothing,
   * if the textures could not be made.
   */
  bool Render(const PassFrame& frame, const LensViews& views, vtkRenderPass* delegate);

  /// That of the cell whose view is rendered, which a camera cannot tell.
  const LensShape& ShapeOfCell() const { return this->CellShape; }

  void ReleaseGraphicsResources(vtkWindow* window);

private:
  enum class Blending
  {
    Replace,
    Add,
    Over
  };
  enum class Conversion
  {
    None,
    ToLight,
    ToCodes
  };
  /// A picture to be drawn over all of the viewport.
  struct Drawing
  {
    vtkTextureObject* Color;
    vtkTextureObject* Depth;
    Blending Blend = Blending::Replace;
    Conversion Convert = Conversion::None;
    double Share = 1.0;                ///< factor on the colour
    vtkTextureObject* Below = nullptr; ///< colours to mix it with as light; may be null
    double Deepest = 1.0;              ///< as in LensViews
  };

  bool Prepare(const PassFrame& frame);
  void KeepBelow(const PassFrame& frame, bool depth, bool color);
  bool RenderView(
    const PassFrame& frame, const LensViews& views, int index, vtkRenderPass* delegate);
  void AddView(const PassFrame& frame, bool first, bool toLight);
  void Draw(vtkOpenGLRenderWindow* window, const Drawing& drawing);

  OffscreenFrame Frame;
  OwningWindow Owner; // of Sum
  vtkNew<vtkOpenGLFramebufferObject> Sum;
  vtkNew<vtkTextureObject> FirstDepth, SumColor, DepthBelow, ColorBelow;
  FrameBlit Blit;
  bool HasDepthBelow = false;
  bool HasColorBelow = false;
  LensShape CellShape;
  FullScreenQuad Quad;
};
}
