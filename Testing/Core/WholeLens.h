// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Core/Lens/LensVisibility.h"

namespace SurfelSplatting
{
/// The footprint of a splat of which all points of the lens see the same, and which the lens makes.
/// @param perForm of the lens point
inline LensFootprint WholeLens(float meanX, float meanY, float perForm)
{
  return { meanX, meanY, perForm, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f };
}
}
