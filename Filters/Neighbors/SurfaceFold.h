// SPDX-License-Identifier: BSD-3-Clause
/**
 * Folds of a surface: lines where the tangent planes of two neighbours meet between them, as at the
 * edges of a box. Turned about this line, the neighbour's plane becomes the point's own. With unit
 * normals n and m, and d from the point to the neighbour, the turn takes d to
 *
 *   d' = d - (d.n) (n + m) / (1 + n.m),
 *
 * which is as long as the way over the fold. Neighbours without a fold between them lie in the
 * plane at their distance in space, and so do those at small angles: smooth surfaces have no folds.
 */
#pragma once

#include <cmath>

namespace SurfelGeometry
{
/// Cosines of the angle between the normals: at the sharpest fold, an edge of 46 degrees; at folds
/// that are sharp enough to tell where they are; and at the flattest ones.
constexpr float SharpestFold = -0.7f, SharpFold = 0.6f, FlattestFold = 0.87f;

/// Of surfels that are two-sided, normals have the signs that agree. The cosine of less than this
/// does not tell; there the sign is that of a fold.
constexpr float TellingCosine = 0.3f;

/// The sign of the second of two normals, of surfels of which one is two-sided.
/// @param cosine     of the angle between both
/// @param climb      d.n, d from the first surfel to the second
/// @param otherClimb d.m
inline float AgreeingSign(float cosine, float climb, float otherClimb)
{
  const bool tells = std::abs(cosine) >= TellingCosine;
  return (tells & (cosine < 0.0f)) | (!tells & (climb * otherClimb > 0.0f)) ? -1.0f : 1.0f;
}

/// The line X x + Y y = Distance in a tangent plane, (X, Y) a unit vector.
struct FoldLine
{
  float X = 0.0f, Y = 0.0f, Distance = 0.0f;
};

/// A neighbour seen from a point. Of two-sided ones m has the sign that agrees with n.
struct FoldedNeighbor
{
  float X, Y;         // d in the tangent plane
  float Climb;        // d.n
  float OtherClimb;   // d.m
  float Cosine;       // n.m
  float TiltX, TiltY; // m in the tangent plane

  /// Whether each is above the other's plane, or each is below, at an angle.
  bool HasFold() const
  {
    return (this->Climb * this->OtherClimb < 0.0f) & (this->Cosine <= FlattestFold) &
      (this->Cosine >= SharpestFold);
  }

  /// Whether there is a fold within a distance of both.
  bool HasFoldWithin(float reach) const
  {
    const float limit = reach * reach * (1.0f - this->Cosine * this->Cosine);
    return this->HasFold() & (this->Climb * this->Climb <= limit) &
      (this->OtherClimb * this->OtherClimb <= limit);
  }

  /// The fold; of distance 0 if it is not sharp.
  FoldLine Line() const
  {
    if (!this->HasFold() || this->Cosine > SharpFold)
    {
      return FoldLine();
    }
    const float sine = std::sqrt(1.0f - this->Cosine * this->Cosine);
    const float scale = std::copysign(1.0f / sine, this->OtherClimb);
    return { scale * this->TiltX, scale * this->TiltY, scale * this->OtherClimb };
  }

  /// Moves (X, Y) to the place on the unrolled surface.
  void Unroll()
  {
    const float flat = this->X * this->X + this->Y * this->Y;
    const float squared = flat + this->Climb * this->Climb;
    const bool fold = this->HasFold();
    const float turn = fold ? this->Climb / (1.0f + this->Cosine) : 0.0f;
    const float scale = fold ? 1.0f : std::sqrt(squared / (flat > 0.0f ? flat : 1.0f));
    this->X = scale * this->X - turn * this->TiltX;
    this->Y = scale * this->Y - turn * this->TiltY;
  }
};
}
