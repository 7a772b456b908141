// SPDX-License-Identifier: BSD-3-Clause
/**
 * Adds further point arrays to a picture, besides colour and depth (SurfelArrays.h). Internal to
 * the module.
 */
#pragma once

#include "Core/Picture/Splatter.h"

#include <vector>

class vtkImageData;

namespace SurfelSplatting
{
/// Which arrays to add.
struct PixelChannels
{
  bool Normal = false;
  bool CircleOfConfusion = false;
  bool Coverage = false;
  bool Fragments = false;
  bool Level = false;
  bool MedianDepth = false;
};

/// What a picture shows, to be rendered again in other colours.
struct PaintedScene
{
  const SplatContext& Context;
  const std::vector<SurfelCloud>& Clouds;
  const float* OccluderDepth; ///< as in RenderTarget
  Splatter& Painter;
};

/**
 * Adds the chosen arrays. Normals, coverage and fragments together take one further frame of the
 * same scene, levels and median depths another one each.
 * @param picture has "Color" and "Depth"
 */
void AddChannels(const PixelChannels& channels, const PaintedScene& scene, vtkImageData* picture);
}
