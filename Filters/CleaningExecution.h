// SPDX-License-Identifier: BSD-3-Clause
/**
 * One execution of vtkPointCloudCleaning: alone (CleaningExecution.cxx) or together with other
 * processes (DistributedCleaning.cxx).
 */
#pragma once

#include "Filters/Arrays/PointColors.h"
#include "Filters/Common/StageProgress.h"
#include "Filters/Common/VectorMath.h"
#include "Filters/Neighbors/NeighborGraph.h"
#include "Filters/Partition/PartitionedCloud.h"

#include "vtkSmartPointer.h"

#include <vector>

class vtkAlgorithm;
class vtkPoints;
class vtkPointSet;
class vtkPolyData;

namespace SurfelSplatting
{
class Ranks;
}

namespace SurfelGeometry
{
struct CleaningProblem;
struct CleaningSharing;
struct SmoothPoints;

/// As vtkPointCloudCleaning has them.
struct CleaningSettings
{
  bool RemoveStrayPoints, Smoothing;
  int Columns;
  bool UseViewpoint;
  double Viewpoint[3];
  bool GenerateShifts;
  bool KeepsNeighbors; // for the next filter; they take twice the memory
};

struct CleaningCounts
{
  vtkIdType NonFinite = 0, Duplicate = 0, Stray = 0, Twin = 0, Joined = 0, Moved = 0, Recolored = 0,
            Thick = 0;
};

/// Which points of the input are kept, which are stray, and where they move.
class CleaningExecution
{
public:
  /// @param filter gets the progress
  CleaningExecution(const CleaningSettings& settings, vtkAlgorithm* filter)
    : Settings(settings)
    , Filter(filter)
  {
  }

  /// Returns false if stopped.
  bool Run(vtkPointSet* input);

  /// The same together with other processes.
  bool RunDistributed(SurfelSplatting::Ranks& ranks, vtkPointSet* input);

  bool AreMoved() const { return !this->Shifts.empty(); }

  /// If they are: gives the points of the output, which are the input's, their places and colours.
  void MovePoints(vtkPolyData* output) const;

  /// Hands the search over to the estimation of the output, whose points have other ids.
  void HandOver(SearchedCloud& searched);

  CleaningCounts Count(vtkPointSet* input) const;

  std::vector<char> Kept, Strayed, Twins; // [input points] 1: yes

private:
  static constexpr int ResultComponents = 4; // what becomes of it, shift; then the colour, if known

  /// The points of `input`, each at its shift, world units.
  static vtkSmartPointer<vtkPoints> Shifted(vtkPointSet* input, const std::vector<Float3>& shifts);

  void Begin(vtkPointSet* input);
  void Gather(vtkPointSet* input);

  /// The vectors to the scanners, or to the viewpoint if that is one; null: not known.
  vtkSmartPointer<vtkDataArray> ToScanners(vtkPointSet* input) const;

  /// Returns false if stopped.
  bool SmoothDepths(vtkPointSet* input, const StageProgress& progress);

  /// Collective. Returns false if stopped.
  bool CleanRegion(SurfelSplatting::Ranks& ranks, const PartitionedCloud& cloud,
    vtkPolyData* region, const StageProgress& progress);

  /// Collective, if shared. Returns false if stopped.
  bool Clean(vtkPointSet* input, CleaningSharing* sharing, const StageProgress& progress);

  /// @param smooth of the cloud's points
  void Keep(const SmoothPoints& smooth);

  /// Removes points of the cloud, not of the input.
  void Drop(const std::vector<unsigned char>& dropped, CleaningSharing* sharing);

  /// Removes copies of points beside them. Collective, if shared. Returns false if stopped.
  bool DropCopies(const CleaningProblem& problem, vtkPointSet* input, CleaningSharing* sharing,
    const StageProgress& progress);

  /// Moves the second of two scans to the first one. Collective, if shared. Returns false if
  /// stopped.
  bool JoinScans(const CleaningProblem& problem, vtkPointSet* input, CleaningSharing* sharing,
    const StageProgress& progress);

  /// Of the points in this process's region.
  /// @param areColored whether any process has changed colours
  PartitionedCloud::Results Results(const PartitionedCloud& cloud, bool areColored) const;

  /// @param hasColors whether this process's input has colours
  void Take(const PartitionedCloud::Returned& returned, bool areColored, bool hasColors);

  CleaningSettings Settings;
  vtkAlgorithm* Filter;
  SearchedCloud Searched;
  std::vector<Float3> Shifts; // [input points] or empty, world units
  CloudColors Colors;         // [3 input points] or empty: as they are
  vtkIdType NonFinite = 0, Thick = 0;
  vtkIdType Second = VTK_ID_MAX; // first id of a second scan that has moved
};
}
