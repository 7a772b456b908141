// SPDX-License-Identifier: BSD-3-Clause
/**
 * The points of all ranks, dealt out by place: each rank works on a region of the cloud, with the
 * points about it, whichever rank they came from, and gives the results back to where the points
 * are.
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
/// Where a point is, in the order of one process that has all points, rank after rank.
struct PointKey
{
  std::int32_t Rank;
  vtkIdType Id;
};

class PartitionedCloud
{
public:
  /// Collective. @param input of this rank; null or empty where it has no points
  PartitionedCloud(SurfelSplatting::Ranks& ranks, vtkPointSet* input);

  /// An array that goes along, as floats; Values null where this rank has none: zeros.
  struct Array
  {
    const char* Name;
    int Components;
    vtkDataArray* Values;
  };

  /**
   * Collective. The points in this rank's region, and all others within a margin of it, ordered as
   * by one process, about Origin(); point array IdArray has their indices.
   */
  vtkSmartPointer<vtkPolyData> Fetch(double margin, const std::vector<Array>& arrays);
  static constexpr const char* IdArray = "DealtPointId";

  /// Of the last Fetch.
  const std::vector<PointKey>& Keys() const { return this->Fetched; }
  const float* Position(vtkIdType dealt) const
  {
    return this->FetchedPositions.data() + 3 * static_cast<std::size_t>(dealt);
  }
  /// In the order of one process that has all points.
  std::vector<vtkIdType> GlobalIds() const;

  /// Whether a point is in this rank's region.
  bool IsMine(vtkIdType dealt) const { return this->Region().Contains(this->Position(dealt)); }
  const CloudRegion& Region() const
  {
    return this->Regions[static_cast<std::size_t>(this->Group.Rank())];
  }

  /// A width that a first border may have: so many spacings of a surface through the region.
  double Margin(double spacings) const
  {
    return spacings * this->Spacings[static_cast<std::size_t>(this->Group.Rank())];
  }

  /// Results for points of this rank's region.
  struct Results
  {
    int Components = 0;
    std::vector<vtkIdType> Dealt; ///< which points
    std::vector<float> Values;    ///< [Dealt.size()][Components]
  };

  /// What came back for this rank's input.
  struct Returned
  {
    std::vector<char> Has;     ///< [input points]
    std::vector<float> Values; ///< [input points][Components]
  };

  /// Collective. Every result to the rank that has the point.
  Returned Return(const Results& results);

  /// Of all ranks.
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
  std::vector<vtkIdType> FirstIds; // [rank] points of the ranks before
  vtkIdType Total = 0;
  std::vector<float> Positions; // of this rank's input, about the origin; NaN: takes no part
  vtkIdType NonFinite = 0;
  std::vector<CloudRegion> Regions; // [rank]
  std::vector<double> Spacings;     // [rank] of a surface through the region, world units
  std::vector<PointKey> Fetched;
  std::vector<float> FetchedPositions;
};
}
