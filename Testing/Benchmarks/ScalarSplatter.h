// SPDX-License-Identifier: BSD-3-Clause
/**
 * The method as it would be written down first: surfel after surfel, pixel after pixel, a list of
 * fragments for every pixel. No tiles, no sorted stream, no vectors, no threads; what the
 * splatter's speed is compared with.
 */
#pragma once

#include "Core/Picture/Splatter.h"

#include <vector>

namespace SurfelSplatting
{
/// A frame without depth or lens. Coarse grids are not known here.
void RenderScalar(
  const SplatContext& context, const std::vector<SurfelCloud>& clouds, const Frame& frame);
}
