// SPDX-License-Identifier: BSD-3-Clause
/**
 * Tangent plane, spacing and tangential extent of a point, and what they are made from.
 */
#pragma once

#include "Filters/Common/RawVector.h"
#include "Filters/Common/StageProgress.h"
#include "Filters/Common/VectorMath.h"
#include "Filters/Neighbors/NeighborGraph.h"

#include <cstddef>
#include <vector>

class vtkDataArray;

namespace SurfelGeometry
{
struct LocalCloud;
class NeighborSearch;

struct FitSettings
{
  bool UseRadius = false; // neighbours within Radius instead of the nearest ones
  int NumberOfNeighbors = 16;
  double Radius = 0.0;                // world units
  int MaximumNumberOfNeighbors = 128; // bounds UseRadius
  double IsolationFactor = 6.0;
};

/// Properties of the surface at a point, estimated from its neighbours. Lengths in world units.
struct PlaneFit
{
  Float3 Normal;          // unit; of arbitrary sign until it is oriented
  Float3 AxisU;           // unit, tangential: direction of the larger variance
  float VarianceU = 0.0f; // of the neighbours along AxisU, scaled so that sqrt(VarianceU VarianceV)
  float VarianceV = 0.0f; // = Spacing^2; or of the kernel (VoronoiCell.h)
  float Spacing = 0.0f;   // square root of the area per point
  float Reach = 0.0f;     // distance to the neighbour of rank ReachRank
  float Flatness = 0.0f;  // variance along the normal over the smaller tangential one; 0 = plane
  bool Degenerate = false; // too few neighbours, or all on a line
  bool Isolated = false;
  bool Given = false;       // the normal was given, not fitted
  bool SideGiven = false;   // and its sign tells the outside
  bool OnPlate = false;     // of two sheets; the normal points outward (Orientation/ThinPlates.h)
  bool Sharp = false;       // of one of the planes that meet at a fold (SharpNormals.h)
  bool OnScanLines = false; // of a surface that a scanner with lines far apart has measured
  bool OnRod = false; // of a line with nothing beside it (ScanLines.h), or thin (ThinPoints.h)

  /// Whether the point has a tangent plane. Others are drawn round, and from both sides.
  bool HasPlane() const { return !this->Isolated && !this->Degenerate && !this->OnRod; }

  void MakeRound(double spacing)
  {
    this->Spacing = static_cast<float>(spacing);
    this->VarianceU = this->VarianceV = this->Spacing * this->Spacing;
  }
};

using PlaneFits = RawVector<PlaneFit>;

/// Rank of the neighbour whose distance decides whether a point is isolated.
constexpr int ReachRank = 6;

/// A neighbour is on the same sheet if the cosine of the normals is at least this (signed between
/// one-sided points) and the sine of the edge's angle to the tangent plane is at most this.
constexpr double SheetCosine = 0.3;
constexpr double SheetClimb = 0.6;

/// Whether two points whose difference is d can be on the same sheet of surface: their normals
/// agree (up to sign if eitherTwoSided), and d does not leave a's tangent plane by much.
inline bool AreOfOneSheet(
  const PlaneFit& a, const PlaneFit& b, bool eitherTwoSided, const Vector3& d)
{
  const double cosine = Dot(a.Normal, b.Normal);
  const double climb = Dot(a.Normal, d);
  return (eitherTwoSided ? std::abs(cosine) : cosine) >= SheetCosine &&
    climb * climb <= SheetClimb * SheetClimb * Dot(d, d);
}

/// Input of the plane fits.
struct FitInput
{
  const LocalCloud& Cloud;
  const NeighborSearch& Tree;
  const FitSettings& Settings;
  const std::vector<float>& GivenNormals; // [3n], (0, 0, 0) where a point has none; or empty
  bool AreSidesGiven;                     // whether their signs tell the outside
  vtkDataArray* ToScanner; // vectors from the input's points to their scanners; null: not known

  /// Three numbers, or null.
  const float* GivenNormal(int i) const
  {
    return this->GivenNormals.empty() ? nullptr
                                      : this->GivenNormals.data() + 3 * static_cast<size_t>(i);
  }
};

/// A cloud after orientation: it is known which neighbours are on the same sheet.
struct OrientedCloud
{
  const LocalCloud& Cloud;
  const NeighborSearch& Tree;
  const NeighborGraph& Graph;
  const std::vector<unsigned char>& TwoSided; // [n]
  vtkDataArray* ToScanner;                    // as in FitInput
};
}
