// SPDX-License-Identifier: BSD-3-Clause
/**
 * Finds from where a scan was taken, where its file does not tell, by the order of its points: that
 * in which the scanner measured them, which files keep unless somebody thinned or sorted them. The
 * lines through the points before and behind the jumps of a scan meet near the scanner, and its
 * place is where the steps are most regular (ScanWindows.h). Scans one after another have a place
 * each.
 */
#pragma once

#include "Filters/Common/IdType.h"

#include <vector>

class vtkFloatArray;
class vtkPoints;

namespace SurfelGeometry
{
/// Consecutive points that one scanner has seen.
struct ScannedPoints
{
  vtkIdType Begin, End; // ids
  double Place[3];      // of the scanner, as the points
};

/// In the order of the points. Points of which nothing is known are in none; so are all if the
/// order does not tell. The same at any number of threads.
std::vector<ScannedPoints> FindScans(vtkPoints* points);

/// The vectors from points to their scanners, three components, 0 where none is known.
void WriteWays(vtkPoints* points, const std::vector<ScannedPoints>& scans, vtkFloatArray* ways);
}
