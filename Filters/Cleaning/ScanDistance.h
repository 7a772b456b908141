// SPDX-License-Identifier: BSD-3-Clause
/**
 * How far the second of two scans is from the first, in space and in colour. A quadric through the
 * points of the first scan about each sample stays, while the samples move.
 */
#pragma once

#include "Filters/Common/IdType.h"
#include "Filters/Common/VectorMath.h"

#include <vector>

namespace SurfelGeometry
{
struct CleaningProblem;
struct SampledColors;

/// A rigid motion of all points with an id from First on.
struct ScanMotion
{
  vtkIdType First;     // by LocalCloud::SampleId
  Vector3 Center;      // of the rotation, where all processes have it
  Vector3 Shift;       // of the center, world units
  Vector3 Rotation[3]; // rows of the matrix

  /// By how much a point at this place moves.
  Vector3 ShiftOf(const Vector3& place) const;
};

/// From the first scan to a place, as all processes have it.
struct ScanDistance
{
  float Place[3];
  float Normal[3];
  float Height;      // along the normal, world units
  float Gradient[3]; // of the first scan's shade along its surface, 1 / world units; unknown: 0
  float Shade;       // of the sample, minus the first scan's; unknown: 0
  float Spacing;     // of the first scan, world units
};

/// The first scan about samples of the first or the second one.
class ScanFits
{
public:
  /// @param samples of this process
  ScanFits(const CleaningProblem& problem, const SampledColors& colors,
    const std::vector<int>& samples, vtkIdType first, bool ofSecond);
  ~ScanFits();

  /// Collective: the distances of the moved samples, in an order that does not depend on the
  /// processes. Returns false if a process was stopped.
  bool Measure(bool running, const ScanMotion& motion, std::vector<ScanDistance>& distances) const;

private:
  struct Fit;

  const CleaningProblem& Problem;
  std::vector<Fit> Fits;
};
}
