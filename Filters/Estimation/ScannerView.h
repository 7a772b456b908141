// SPDX-License-Identifier: BSD-3-Clause
/**
 * A point and its neighbours as the scanner of the point sees them.
 *
 * Scanners measure in steps of nearly the same angle. Where one looks along a surface, its lines
 * are far apart in space, though each is the next one seen from the scanner: then it has seen
 * nothing between them because it did not look there, and the surface goes on. Of a hole that it
 * looked through, many steps have no point.
 */
#pragma once

#include "Filters/Common/VectorMath.h"

#include <vector>

class vtkDataArray;

namespace SurfelGeometry
{
struct LocalCloud;
struct Neighbors;

class ScannerView
{
public:
  /// @param toScanner vectors from the input's points to their scanners; null: none is known
  ScannerView(const LocalCloud& cloud, vtkDataArray* toScanner)
    : Cloud(cloud)
    , ToScanner(toScanner)
  {
  }

  /// Looks at point i. Returns false if its scanner is not known.
  bool LookAt(int i);

  /// The steps of the scanner at that point, an angle: to the nearest of the given points that it
  /// has measured, too. Infinite if there is none.
  /// @param ids [count]
  double StepAmong(const int* ids, int count) const;

  /// The cosine of the angle between a normal and the line of sight.
  double Facing(const Vector3& normal) const { return std::abs(Dot(normal, this->Direction)); }

  /// The angle between point j and that point, seen from the scanner of the latter; infinite if
  /// another one has measured j.
  double AngleTo(int j) const;

  /// Whether the scanner has seen on both sides of that point, on a line in direction `along`, the
  /// next lines of one surface.
  bool IsBetweenLines(const Vector3& along, const Neighbors& neighbors);

  /// Whether other scanners have measured most of these points.
  bool AreMostOfOthers(const Neighbors& neighbors) const;

private:
  /// A neighbour beside the line.
  struct Beside
  {
    Vector3 Way; // across the line, world units
    bool IsLeft;
  };

  /// Direction from the scanner to point j less that to the point, small angles; false if another
  /// scanner has measured j, or none that is known.
  bool See(int j, Vector3& angles) const;
  bool GetScanner(int j, Vector3& scanner) const;
  double StepAlong(const Vector3& row, const Vector3& across, const Neighbors& neighbors);

  const LocalCloud& Cloud;
  vtkDataArray* ToScanner;
  Vector3 Point{}, Scanner{}, Direction{};
  double Range = 0.0;
  std::vector<double> Steps;
  std::vector<Beside> Sides;
};
}
