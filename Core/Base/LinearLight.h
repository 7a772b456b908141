// SPDX-License-Identifier: BSD-3-Clause
/**
 * Colours as they are stored and shown (sRGB codes), and as linear light.
 *
 * sRGB (IEC 61966-2-1): a code v in [0, 1] is the light ((v + 0.055) / 1.055)^2.4, or v / 12.92 up
 * to 0.04045. The power continues above 1; negative values become 0.
 */
#pragma once

#include <cmath>

namespace SurfelSplatting
{
inline double LightOfCode(double v)
{
  return v <= 0.04045 ? std::fmax(0.0, v) / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

inline double CodeOfLight(double light)
{
  return light <= 0.0031308 ? 12.92 * std::fmax(0.0, light)
                            : 1.055 * std::pow(light, 1.0 / 2.4) - 0.055;
}
}
