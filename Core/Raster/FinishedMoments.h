// SPDX-License-Identifier: BSD-3-Clause
/**
 * The moments over the lens (Core/Lens/LensVisibility.h) of what shines through the finished layers
 * of a block.
 *
 * Included by the translation units of the raster's targets (RasterTarget.h), whose own this code
 * is.
 */
#pragma once

#include "Core/Lens/LensVisibility.h"
#include "Core/Raster/RasterTarget.h"
#include "Core/Simd/Lanes.h"

namespace SurfelSplatting
{
namespace
{
/// A block where 4 |t1| of T is less than this has no moments.
constexpr float MinTilt = 1.0f / 512.0f;

using FinishedField = float (FinishedLayers::*)[PixelsPerBlock];

/// The finished layers of a block.
struct OneBlock
{
  using Real = Lanes;
  FinishedLayers& A;

  SURFELSPLATTING_INLINE Real Load(FinishedField f) const { return Lanes::Load(this->A.*f); }
  SURFELSPLATTING_INLINE void Store(FinishedField f, const Real& x) const { x.Store(this->A.*f); }
};

template <class Blocks>
SURFELSPLATTING_INLINE LensMoments<typename Blocks::Real> MomentsOf(const Blocks& done)
{
  return { done.Load(&FinishedLayers::ThroughX), done.Load(&FinishedLayers::ThroughY),
    done.Load(&FinishedLayers::ThroughRim), done.Load(&FinishedLayers::ThroughAcross),
    done.Load(&FinishedLayers::ThroughDiagonal) };
}

/// Whether first moments of T matter. @param squared length
SURFELSPLATTING_INLINE bool AreLong(const Lanes& squared)
{
  return Any(squared > MinTilt * MinTilt / 16.0f);
}

/// Stores the moments of T: the first no longer than that of a segment, the second no larger than
/// that of a disc or a ring.
/// @return the squared length of the first one before
template <class Blocks, class Real = typename Blocks::Real>
SURFELSPLATTING_INLINE Real StoreMoments(
  const Blocks& done, const LensMoments<Real>& t, const Real& after)
{
  // Without a branch, which would be taken half of the time.
  const Real squared = t.X * t.X + t.Y * t.Y, shorten = ShortenToLargest(after, squared);
  done.Store(&FinishedLayers::ThroughX, t.X * shorten);
  done.Store(&FinishedLayers::ThroughY, t.Y * shorten);
  const Real most = after * (1.0f - after), least = 0.0f - most;
  done.Store(&FinishedLayers::ThroughRim, Smaller(Larger(t.Rim, least), most));
  done.Store(&FinishedLayers::ThroughAcross, Smaller(Larger(t.Across, least), most));
  done.Store(&FinishedLayers::ThroughDiagonal, Smaller(Larger(t.Diagonal, least), most));
  return squared;
}
}
}
