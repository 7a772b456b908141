// SPDX-License-Identifier: BSD-3-Clause
/**
 * The kernels of ResamplingKernel.h as the raster evaluates them, for 16 pixels at a time; those of
 * surfels are in BatchRaster.h. Included by the translation units of the raster's targets
 * (RasterTarget.h), whose own this code is.
 */
#pragma once

#include "Core/Lens/GaussianFootprint.h"
#include "Core/Simd/Lanes.h"

namespace SurfelSplatting
{
namespace
{
constexpr float FirstSmoothShape = static_cast<float>(SmoothShape);
constexpr float Edge = static_cast<float>(BellEdge);

/// The kernel of a Gaussian in space at q < reach, 1 at q = 0 (GaussianFootprint.h).
template <class Real>
SURFELSPLATTING_INLINE Real EvaluateInSpace(float shape, const Real& q, float reach)
{
  if (shape < 0.0f)
  {
    constexpr float perSquare = -0.72134752f; // exp(-q/2) is a power of two
    const Real gaussian = TimesPowerOfTwo(1.0f, perSquare * q);
    if (shape <= -1.0f)
    {
      return gaussian;
    }
    const Real x = Larger(1.0f - q * static_cast<float>(1.0 / FocusBellReach), Real(0.0f));
    const Real bell = x * (Edge + (1.0f - Edge) * (x * x * x));
    return (1.0f + shape) * static_cast<float>(FocusBellPeak) * bell - shape * gaussian;
  }
  const Real x = Larger(1.0f - q * (1.0f / reach), Real(0.0f));
  if (shape >= FirstSmoothShape)
  {
    const Real u = Smaller(x * (shape - FirstSmoothShape), Real(1.0f));
    return u * u * (3.0f - 2.0f * u);
  }
  return x * (x + shape * (Edge + (1.0f - Edge) * (x * x * x) - x));
}
}
}
