// SPDX-License-Identifier: BSD-3-Clause
/**
 * The last step of a frame: the splatter's picture over the props that stayed sharp, and over what
 * is behind those that it shows through the lens. Internal to the module.
 */
#pragma once

#include "Core/Splats/DepthImageSurfels.h"
#include "Rendering/OpenGL/PropPixels.h"

#include <vector>

namespace SurfelSplatting
{
/// A picture that the splatter has made.
struct SplattedPicture
{
  const float* Color;                     ///< [height][width][4] premultiplied RGBA
  const float* Depth;                     ///< [height][width] distance; 0 where there is none
  std::size_t Pixels;                     ///< height times width
  const DepthImageSurfels& BlurredPixels; ///< pixels of props that it shows through the lens
};

class FrameFinish
{
public:
  /**
   * Removes the props that were splatted.
   * @param props   that were splatted
   * @param isWhole whether the finished colours are to contain all that is seen
   */
  void Begin(
    const SplattedPicture& picture, const DepthImage& props, bool isWhole, PropPixels& pixels);

  /**
   * Finishes the pixels [begin, end); threads may finish different ones.
   * @param deepest largest window depth of pixels with any colour
   */
  void Finish(const SplattedPicture& picture, const DepthRange& range, float deepest,
    std::size_t begin, std::size_t end);

private:
  const float* ColorUnder(const DepthImageSurfels::Pixel& pixel, const DepthImage& props) const;
  void Mix(const SplattedPicture& picture, std::size_t begin, std::size_t end);

  PropPixels* Pixels = nullptr;
  std::vector<float> Under; // splatted pixels
  bool IsWhole = false;     // colours are finished, not only depths
  bool InLight = false;     // colours are sRGB codes of the light that is mixed
};
}
