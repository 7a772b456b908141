// SPDX-License-Identifier: BSD-3-Clause
/**
 * The points of all ranks, distributed by location: each rank gets the points of a region of the
 * cloud and of a halo around it, whichever rank has them, and returns its results to the ranks that
 * have the points.
 */
#pragma once

#include "Core/Base/Ranks.h"
#include "Filters/Partition/CloudRegions.h"

#include "vtkSmartPointer.h"
#include "vtkType.h"

#include <cstdint>
#include <vector>

class vtkDataArray;
class vtkPointSet;
class vtkPolyData;

namespace SurfelGeometry
{
/// Which rank has a point, and its id there.
struct PointKey
{
  std::int32_t Rank;
  vtkIdType Id;
};

class PartitionedCloud
{
public:
  /// Collective. @param input this rank's points; null or empty if it has none
  PartitionedCloud(SurfelSplatting::Ranks& ranks, vtkPointSet* input);

  /// An array that is fetched with the points, as floats; Values null: zeros for this rank's
  /// points.
  struct Array
  {
    const char* Name;
    int Components;
    vtkDataArray* Values;
  };

  /// Collective. Those of the arrays that any rank has.
  static std::vector<Array> OfAny(SurfelSplatting::Ranks& ranks, const std::vector<Array>& arrays);

  /**
   * Collective. Fetches the points in this rank's region and in a halo of this width around it,
   * relative to Origin(), in the order of one process with all points. The point array IdArray has
   * their indices.
   */
  vtkSmartPointer<vtkPolyData> Fetch(double haloWidth, const std::vector<Array>& arrays);
  static constexpr const char* IdArray = "RegionPointId";

  /// Position of a point of the last Fetch, relative to Origin().
  const float* Position(vtkIdType i) const
  {
    return this->FetchedPositions.data() + 3 * static_cast<std::size_t>(i);
  }
  /// Ids of the fetched points in one process with the points of all ranks, rank after rank.
  std::vector<vtkIdType> GlobalIds() const;

  /// The id of this rank's first point there.
  vtkIdType FirstId() const { return this->FirstIds[static_cast<std::size_t>(this->Group.Rank())]; }

  /// Whether a fetched point is in this rank's region, not in its halo.
  bool IsInRegion(vtkIdType i) const { return this->Region().Contains(this->Position(i)); }
  const CloudRegion& Region() const
  {
    return this->Regions[static_cast<std::size_t>(this->Group.Rank())];
  }

  /// Halo width of this many spacings, for a surface through the region.
  double HaloWidth(double spacings) const
  {
    return spacings * this->Spacings[static_cast<std::size_t>(this->Group.Rank())];
  }

  /// Results for points of this rank's region.
  struct Results
  {
    int Components = 0;
    std::vector<vtkIdType> Points; ///< which fetched points
    std::vector<float> Values;     ///< [Points.size()][Components]
  };

  /// The results for this rank's input.
  struct Returned
  {
    std::vector<char> Has;     ///< [input points]
    std::vector<float> Values; ///< [input points][Components]
  };

  /// Collective. Sends every result to the rank that has the point.
  Returned Return(const Results& results);

  /// Points of all ranks.
  vtkIdType NumberOfPoints() const { return this->Total; }

  const double* Origin() const { return this->CommonOrigin; }
  vtkIdType NumberOfNonFinitePoints() const { return this->NonFinite; }

private:
  void ShareOrigin(vtkPointSet* input);
  SurfelSplatting::Message PackInside(
    const CloudRegion& region, const std::vector<Array>& arrays) const;
  vtkSmartPointer<vtkPolyData> Unpack(
    const std::vector<SurfelSplatting::Message>& messages, const std::vector<Array>& arrays);
  void Cut();

  SurfelSplatting::Ranks& Group;
  double CommonOrigin[3] = { 0.0, 0.0, 0.0 };
  std::vector<vtkIdType> FirstIds; // [rank] number of points of the ranks before
  vtkIdType Total = 0;
  std::vector<float> Positions; // of this rank's input, relative to the origin; NaN: unusable
  vtkIdType NonFinite = 0;
  std::vector<CloudRegion> Regions; // [rank]
  std::vector<double> Spacings;     // [rank] of a surface through the region, world units
  std::vector<PointKey> Fetched;
  std::vector<float> FetchedPositions;
};
}
