// SPDX-License-Identifier: BSD-3-Clause
/**
 * Whether points on a line are those of a surface whose scan lines are far apart, or of a rod.
 *
 * Scanners that turn have dense lines, far from each other, and so has each scanner on a floor that
 * it looks along: between the lines, the surface is closed. The points of a rod, a cable or a stem
 * are on a line as well, but beside it there is nothing. Rods beside each other, as those of a
 * railing, look like scan lines. But the scanner that saw them has equally dense points in both
 * directions: around a rod most things show that. Around a scan line, most points are on lines,
 * too, unless it is beside something else. Then its noise tells: it is along the line of sight, and
 * so within a surface that the scanner looks along. Rods are about as thick across any plane as in
 * it. Where rods have nothing but other rods around, as the wires of a power line, a line without
 * another one on both sides is a rod.
 */
#pragma once

#include "Filters/Common/RawVector.h"
#include "Filters/Common/VectorMath.h"

#include <Eigen/Core>

#include <memory>
#include <vector>

namespace SurfelGeometry
{
struct LocalCloud;
class NeighborSearch;
struct NeighborGraph;

/// How the nearest neighbours of a point are spread.
enum class Spread : unsigned char
{
  Round,
  Long,   // in one direction at least twice as far as in the other
  Narrow, // three times: a strip of two or three points across
  Line,   // seven times
};

/// Of the two larger variances of the neighbours.
Spread SpreadOf(double smaller, double larger);

using Spreads = RawVector<Spread>;

/// Whether points on a line are spread within the plane of more points around, and not across it.
/// @param line, around covariances
bool IsWithinSurface(const Eigen::Matrix3d& line, const Eigen::Matrix3d& around);

/// Whether two ways across a line go to the next lines of one surface: they are opposite, and none
/// is three times as long. From a rod, one goes to what is behind it.
bool AreToNextLines(const Vector3& a, const Vector3& b);

/// What a point may be on.
enum class LineKind : unsigned char
{
  Other,
  Rod,
  WithinSurface,
  BetweenLines, // of a surface, as its scanner sees it (ScannerView.h)
  Alone,        // among lines, but without one on both sides: a rod, or the edge of a surface
};

/// Whether point i is on a rod, by its kind and those of its neighbours.
bool IsOnRod(int i, const std::vector<LineKind>& kinds, const NeighborGraph& graph);

/// Neighbours of points on rods, which may be on the ends of these, without those.
/// @param rods ascending
std::vector<int> PointsBeside(const std::vector<int>& rods, const NeighborGraph& graph);

class ScanLines
{
public:
  /// Cloud and spreads must outlive this object.
  ScanLines(const LocalCloud& cloud, const Spreads& spreads);
  ~ScanLines();
  ScanLines(const ScanLines&) = delete;
  void operator=(const ScanLines&) = delete;

  /// Indices of the points whose neighbours are on a line, or a narrow strip.
  const std::vector<int>& Points() const { return this->Lines; }

  bool IsLine(int i) const { return this->Of[i] == Spread::Line; }

  /// Whether the lines around point i may be rods: it is on a line, of which the cloud has few.
  bool MayBeAlone(int i) const { return this->Tree && this->IsLine(i); }

  /// Whether half of the nearest neighbours are on lines and strips, too: random points are by
  /// chance.
  bool IsAmongStrips(int i, const NeighborGraph& graph) const;

  /// Room for the queries of one thread.
  struct Query
  {
    std::vector<int> Ids;
    std::vector<float> SquaredDistances;
  };

  /// Whether point i, one of these, is of a surface of such lines.
  bool IsOfSurface(int i, Query& query) const;

private:
  void MakeSample();

  const LocalCloud& Cloud;
  const Spreads& Of;
  std::vector<int> Lines;
  std::vector<float> Positions;         // [3m] of a sample of the cloud
  std::vector<unsigned char> AreLong;   // [m]
  std::unique_ptr<NeighborSearch> Tree; // of the sample; null: all lines are of surfaces
};
}
