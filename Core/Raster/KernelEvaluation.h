// SPDX-License-Identifier: BSD-3-Clause
/**
 * The kernels of ResamplingKernel.h as the raster evaluates them, for 16 pixels at a time. Included
 * by the translation units of the raster's targets (RasterTarget.h), whose own this code is.
 */
#pragma once

#include "Core/Lens/ResamplingKernel.h"
#include "Core/Simd/Lanes.h"

namespace SurfelSplatting
{
namespace
{
constexpr float FirstSmoothShape = static_cast<float>(SmoothShape);

/// The kernel at q, 1 at q = 0 (ResamplingKernel.h); undefined where q >= support.
SURFELSPLATTING_INLINE Lanes EvaluateKernel(float shape, const Lanes& q, float support)
{
  if (shape < 0.0f)
  {
    return ExpOfMinus(Smaller(0.5f * q, 80.0f));
  }
  Lanes k = Larger(1.0f - q * (1.0f / support), 0.0f);
  if (shape >= FirstSmoothShape)
  {
    k = Smaller(k * (shape - FirstSmoothShape), 1.0f);
    return k * k * (3.0f - 2.0f * k);
  }
  return k * (k * k);
}

/// The kernel at q and its derivative d, without its constant factor (t in ResamplingKernel.h).
SURFELSPLATTING_INLINE Lanes EvaluateSlope(float shape, const Lanes& q, float support, Lanes& d)
{
  if (shape < 0.0f)
  {
    d = ExpOfMinus(Smaller(0.5f * q, 80.0f));
    return d;
  }
  const Lanes s = 1.0f - q * (1.0f / support);
  if (shape >= FirstSmoothShape)
  {
    const Lanes u = Smaller(Larger(s * (shape - FirstSmoothShape), 0.0f), 1.0f);
    d = u * (1.0f - u);
    return u * u * (3.0f - 2.0f * u);
  }
  d = s * s;
  return s * d;
}
}
}
