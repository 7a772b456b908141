// SPDX-License-Identifier: BSD-3-Clause
/**
 * What a picture's pixels are besides colour and depth, as point arrays (SurfelArrays.h). Internal
 * to the module.
 */
#pragma once

#include "Core/Picture/Splatter.h"

#include <vector>

class vtkImageData;

namespace SurfelSplatting
{
/**
 * Adds those that are asked for. Normals and levels are further pictures of the same scene; they,
 * coverage and fragments together take one or two frames' time.
 * @param channels vtkSurfelSplatter::PixelChannels
 * @param limit    as for Splatter::Render
 * @param picture  with "Color" and "Depth"
 */
void AddChannels(int channels, const SplatContext& context, const std::vector<SurfelCloud>& clouds,
  const float* limit, Splatter& splatter, vtkImageData* picture);
}
