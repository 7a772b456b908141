// SPDX-License-Identifier: BSD-3-Clause
/**
 * Props in a margin around the frame, from which they blur into it: drawn through a wider camera,
 * and joined with the frame. Internal to the module.
 */
#pragma once

#include "Core/Base/Ranks.h"
#include "Rendering/OpenGL/FrameBlit.h"
#include "Rendering/OpenGL/OffscreenFrame.h"
#include "Rendering/OpenGL/PropPixels.h"

#include <vector>

class vtkProp;
class vtkRenderPass;
class vtkWindow;

namespace SurfelSplatting
{
class PropMargin
{
public:
  /// @param blit reads the margin; must outlive this
  explicit PropMargin(FrameBlit& blit)
    : Blit(blit)
  {
  }

  /// Draws the props in a margin of so many pixels, and reads it. False if it could not be done.
  /// @param delegate draws with as many samples as the frame has
  bool Draw(const PassFrame& frame, int margin, const std::vector<vtkProp*>& props,
    vtkRenderPass* delegate);

  /// Joins the frame, in the middle, and its margin, which is empty if it was not drawn.
  void PlaceMiddle(const PassFrame& frame, int margin, const PropPixels& pixels);

  /// Of frame and margin.
  const std::vector<float>& Distances() const { return this->WideDistances; }
  const std::vector<float>& Color() const { return this->WideColor; }

  /// The pixels with props, for another rank.
  Message Pack() const;

  /// Takes pixels of another rank where they are nearer, into the frame, too.
  void Add(const Message& sent, PropPixels& pixels);

  void ReleaseGraphicsResources(vtkWindow* window);

private:
  bool Read(const PassFrame& frame);

  FrameBlit& Blit;
  OffscreenFrame Wide;
  std::vector<float> WideDistances, WideColor, WideWindowDepth;
  int Margin = 0; // px on each side
};
}
