// SPDX-License-Identifier: BSD-3-Clause
/**
 * One execution of vtkSurfelEstimation: from the input's points to the output's arrays, alone or
 * for the region of one of several ranks.
 */
#pragma once

#include "Filters/Arrays/PointColors.h"
#include "Filters/Estimation/GivenNormals.h"
#include "Filters/Estimation/PlaneFit.h"
#include "Filters/Estimation/SurfaceHeights.h"
#include "Filters/Estimation/SurfelKernel.h"
#include "Filters/Estimation/VoronoiCell.h"
#include "Filters/Neighbors/NeighborGraph.h"
#include "Filters/SurfelSides.h"

#include <functional>
#include <vector>

class vtkAlgorithm;
class vtkPointSet;
class vtkPolyData;

namespace SurfelGeometry
{
class SharedOrientation;

/// As vtkSurfelEstimation has them.
struct EstimationSettings
{
  FitSettings Fit;
  bool HasCells, IsElliptical; // the kernels; neither: they are round
  double KernelScale, CellBlur, MaximumAxisRatio;
  bool KeepNormals, JudgeNormals; // whether they are kept, and looked at before
  bool IsPart;                    // of a cloud: its shape does not tell the outside
  const char* NormalsArrayName;   // may be null
  SideRule Rule;
  bool UseViewpoint;
  double Viewpoint[3];
  bool InterpolateColors;
};

/// What an execution gets from the filter before it and leaves for the one behind it; null:
/// nothing.
struct EstimationNeighbors
{
  SearchedCloud* Before = nullptr;
  SurfelNeighbors* Behind = nullptr;
};

/// The ranks that estimate one cloud together.
struct EstimationSharing
{
  SharedOrientation* Orientation;
  std::function<bool(vtkIdType)> IsOwn; // whether statistics count a point of the input
};

struct EstimationCounts
{
  vtkIdType NonFinite = 0, Duplicate = 0, Isolated = 0, Degenerate = 0, InvalidNormals = 0,
            TwoSided = 0, Components = 0, ClosedComponents = 0;
  double MedianSpacing = 0.0;
  NormalsUse Normals = NormalsUse::None;
};

class EstimationExecution
{
public:
  /// @param filter gets the progress @param sharing null: alone
  EstimationExecution(const EstimationSettings& settings, vtkAlgorithm* filter,
    const EstimationNeighbors& neighbors, const EstimationSharing* sharing)
    : Settings(settings)
    , Filter(filter)
    , Neighbors(neighbors)
    , Sharing(sharing)
  {
  }

  /// Collective, if shared. Returns false if stopped.
  bool Run(vtkPointSet* input);

  void Write(vtkPointSet* input, vtkPolyData* output);

  EstimationCounts Count() const;

private:
  const LocalCloud& Cloud() const { return this->Searched.Cloud; }

  /// Takes the search of the filter before over, or makes one.
  void Search(vtkPointSet* input);
  void ReadNormals(vtkPointSet* input);

  /// Decides what becomes of the given normals: on all ranks the worst that one of them finds.
  void JudgeNormals();

  /// These return false if stopped.
  bool Fit(vtkPointSet* input, const StageProgress& progress);
  bool Orient(vtkPointSet* input, const StageProgress& progress);

  bool Shape(vtkPointSet* input, const StageProgress& progress);
  bool MakeKernels(
    vtkPointSet* input, const OrientedCloud& oriented, const StageProgress& progress);

  /// Frees what the output is not made of.
  void Release();

  /// Kernel of the cloud's point i.
  SurfelKernel KernelOf(int i) const;

  /// Where that is, relative to the cloud's origin.
  Vector3 CenterOf(int i) const;
  bool HasCell(int i) const { return !this->Cells.empty() && this->Cells[i].Area > 0.0f; }

  void WriteSurfels(vtkPolyData* output);

  /// Starts loading what point i of the output is made of: in the order of the input, which may be
  /// any, it is not in the caches.
  void Prefetch(vtkIdType i) const;

  bool LeavesNeighbors() const { return this->Neighbors.Behind && !this->Sharing; }
  bool IsCounted(int i) const
  {
    return !this->Sharing || this->Sharing->IsOwn(this->Cloud().InputIds[i]);
  }

  /// Whether the work succeeds, on all ranks that estimate one cloud. If one of them lacks memory
  /// for it, all throw.
  bool All(const std::function<bool()>& work) const;

  EstimationSettings Settings;
  vtkAlgorithm* Filter;
  EstimationNeighbors Neighbors;
  const EstimationSharing* Sharing;
  SearchedCloud Searched;
  std::vector<float> Given;
  PlaneFits Fits;
  std::vector<int> Order; // output id -> cloud index
  OrientationResult Result;
  VoronoiCells Cells;
  SurfaceHeights Heights; // with cells only
  CloudColors Colors;     // empty: those of the input stay
  vtkIdType InvalidNormals = 0;
  NormalsUse Normals = NormalsUse::None;
};
}
