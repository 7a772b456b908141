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
constexpr float Edge = static_cast<float>(BellEdge);

/// The kernel at q, 1 at q = 0 (ResamplingKernel.h); undefined where q >= support.
template <class Real>
SURFELSPLATTING_INLINE Real EvaluateKernel(float shape, const Real& q, float support)
{
  if (shape < 0.0f)
  {
    return ExpOfMinus(Smaller(0.5f * q, Real(80.0f)));
  }
  const Real x = Larger(1.0f - q * (1.0f / support), Real(0.0f));
  if (shape >= FirstSmoothShape)
  {
    const Real u = Smaller(x * (shape - FirstSmoothShape), Real(1.0f));
    return u * u * (3.0f - 2.0f * u);
  }
  return x * (x + shape * (Edge + (1.0f - Edge) * (x * x * x) - x));
}

/// The kernel at q and its derivative d, without its constant factor (t in ResamplingKernel.h).
SURFELSPLATTING_INLINE Lanes EvaluateSlope(float shape, const Lanes& q, float support, Lanes& d)
{
  if (shape < 0.0f)
  {
    d = ExpOfMinus(Smaller(0.5f * q, 80.0f));
    return d;
  }
  const Lanes x = Larger(1.0f - q * (1.0f / support), 0.0f);
  if (shape >= FirstSmoothShape)
  {
    const Lanes u = Smaller(x * (shape - FirstSmoothShape), 1.0f);
    d = u * (1.0f - u);
    return u * u * (3.0f - 2.0f * u);
  }
  d = x;
  return x * (x + shape * (Edge + (1.0f - Edge) * (x * x * x) - x));
}
}
}
