// SPDX-License-Identifier: BSD-3-Clause
/**
 * What other opaque props of a renderer look like, for the splatter to show it through the lens:
 * colours and distances of their pixels, and of those beyond the picture's border that blur into
 * it. Internal to the module.
 */
#pragma once

#include "Core/Base/Ranks.h"
#include "Core/Splats/DepthImageSurfels.h"
#include "Rendering/OpenGL/FrameBlit.h"
#include "Rendering/OpenGL/OffscreenFrame.h"

#include <vector>

class vtkOpenGLRenderWindow;
class vtkRenderPass;
class vtkRenderState;
class vtkRenderer;
class vtkWindow;

namespace SurfelSplatting
{
/// Whether a renderer shows anything in space that is no surfels; opaque things alone where wanted.
bool HasOtherProps(vtkRenderer* renderer, bool opaqueOnly);

/// The distances between which a renderer's other opaque props are, within its clipping range.
void DistancesOfOtherProps(vtkRenderer* renderer, double distances[2]);

/// Window depths as distances along the view direction, infinity where nothing was drawn.
void ToDistances(
  const std::vector<float>& windowDepth, const DepthRange& range, std::vector<float>& distances);

class PropImage
{
public:
  /// Whether colours are sRGB codes of the light that is blurred and mixed.
  void SetLinearLight(bool linear) { this->Whole.LinearLight = linear; }

  /// Instead of Read, where all that was drawn stays: what is there now.
  bool ReadPicture(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle)
  {
    return this->Blit.ReadColor(window, rectangle, this->Color);
  }

  /// What is there before they are drawn. False: it could not be read.
  bool ReadBackground(vtkOpenGLRenderWindow* window, const PixelRectangle& rectangle);

  /**
   * What is there after they were drawn; the margin is drawn by `delegate` through a wider camera
   * and with as many samples.
   * @param distances [height][width] of what was drawn
   * @param margin    px on each side; 0: none, and nothing is blurred
   */
  bool Read(const vtkRenderState* state, const PixelRectangle& rectangle, const DepthRange& range,
    const std::vector<float>& distances, int margin, vtkRenderPass* delegate);

  /**
   * Collective: what the last Read of each rank has seen, the nearest of each pixel, into rank 0's.
   * @param mine      whether this rank has anything to add; rank 0 and all that have must have read
   * @param distances [height][width] of what was drawn; on rank 0 by any rank, afterwards
   */
  void Gather(Ranks& ranks, bool mine, std::vector<float>& distances);

  /// On the other ranks: what the last Read has seen without what was gathered, premultiplied; null
  /// where nothing was read.
  const float* WithoutGathered(const std::vector<float>& distances);

  /// Of the last Read.
  const DepthImage& Picture() const { return this->Whole; }

  /**
   * The whole picture, [height][width][4]: the splatter's `color` over these props where they
   * stayed, and over the background where they were taken.
   */
  const float* Compose(const DepthImageSurfels& pixels, const float* color);

  void ReleaseGraphicsResources(vtkWindow* window);

private:
  bool DrawWide(const vtkRenderState* state, const PixelRectangle& rectangle,
    const DepthRange& range, vtkRenderPass* delegate);
  bool FindBackdrop(const std::vector<float>& distances) const;
  const float* ColorUnder(const DepthImageSurfels::Pixel& pixel) const;
  void PlaceMiddle(const PixelRectangle& rectangle, const std::vector<float>& distances);

  FrameBlit Blit;
  OffscreenFrame Wide;
  std::vector<float> Background, Color;        // of the picture
  std::vector<float> WideDistances, WideColor; // with the margin
  std::vector<float> WindowDepth;
  DepthImage Whole;
  std::size_t Width = 0; // of the picture
  bool HasBackdrop = false;
};
}
