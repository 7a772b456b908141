// SPDX-License-Identifier: BSD-3-Clause
/**
 * The spherical harmonics of a Gaussian as they are drawn: one cache line. The constant ones are
 * floats; the others have bytes, with an error of up to 1/254 of the largest of them.
 */
#pragma once

#include "Core/Surfels/SphericalHarmonics.h"

#include <cstdint>

namespace SurfelSplatting
{
struct alignas(64) PackedHarmonics
{
  static constexpr float One = 127.0f;

  float Constant[3];                 ///< coefficients of the first harmonic
  float Unit;                        ///< of Rest
  std::int8_t Rest[3][MaxHarmonics]; ///< red, green, blue; the first of each is not used
};
static_assert(sizeof(PackedHarmonics) == 64, "one cache line");
}
