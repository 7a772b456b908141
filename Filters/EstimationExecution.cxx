// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/EstimationExecution.h"

#include "Filters/Arrays/InputArrays.h"
#include "Filters/Arrays/SurfelOutput.h"
#include "Filters/Common/AvailableMemory.h"
#include "Filters/Common/Intrinsics.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Common/ParallelMedian.h"
#include "Filters/Estimation/CloudPlanes.h"
#include "Filters/Estimation/ColorInterpolation.h"
#include "Filters/Estimation/IsolatedPoints.h"
#include "Filters/Estimation/PointPlanes.h"
#include "Filters/Estimation/SharpNormals.h"
#include "Filters/Estimation/ThinPoints.h"
#include "Filters/Partition/SharedOrientation.h"

#include "vtkDataArray.h"
#include "vtkFloatArray.h"
#include "vtkPointSet.h"
#include "vtkPolyData.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <atomic>
#include <utility>

namespace SurfelGeometry
{
namespace
{
constexpr vtkIdType OutputPrefetch = 16; // points

/// Until then the search takes of the time of the fits.
constexpr double FitBegin = 1.0 / 6.0;

/// Beside a void a cell reaches into it, and its kernel lies so many spacings off the point,
/// which has its neighbours on one side then: for the weights that would be a border.
constexpr double FarShift = 0.55;
}

bool EstimationExecution::Run(vtkPointSet* input)
{
  const StageProgress progress(this->Filter, 0.0, 1.0);
  const auto search = [&] {
    this->Search(input);
    this->ReadNormals(input);
    return progress.Step(0.6 * FitBegin);
  };
  const auto fit = [&] { return this->Fit(input, progress.Part(0.6 * FitBegin, 0.6)); };
  const auto shape = [&] { return this->Shape(input, progress.Part(0.85, 0.98)); };
  if (!this->All(search))
  {
    this->Release();
    return false;
  }
  this->JudgeNormals();
  const bool finished =
    this->All(fit) && this->Orient(input, progress.Part(0.6, 0.85)) && this->All(shape);
  this->Release();
  return finished;
}

bool EstimationExecution::Fit(vtkPointSet* input, const StageProgress& progress)
{
  const FitSettings& settings = this->Settings.Fit;
  if (!FitPlanes({ this->Cloud(), *this->Searched.Tree, settings, this->Given,
                   this->Normals != NormalsUse::WithoutSides, FindScanners(input) },
        progress, this->Fits, this->Searched.Graph))
  {
    return false;
  }
  BoundIsolated(settings.IsolationFactor, this->Searched, this->Fits);
  ReturnFreeMemory(); // most of all is needed for the votes of the orientation
  return true;
}

void EstimationExecution::Search(vtkPointSet* input)
{
  if (!this->Sharing && this->Neighbors.Before && this->Neighbors.Before->Tree)
  {
    std::swap(this->Searched, *this->Neighbors.Before);
  }
  else
  {
    LocalCloud& cloud = this->Searched.Cloud;
    double origin[3] = { 0.0, 0.0, 0.0 };
    ReadOrigin(input, origin);
    std::copy_n(origin, 3, cloud.Origin);
    if (input->GetPoints())
    {
      GatherCloud(input->GetPoints(), origin, cloud);
    }
    this->Searched.Index();
  }
}

void EstimationExecution::ReadNormals(vtkPointSet* input)
{
  vtkDataArray* normals =
    this->Settings.KeepNormals ? FindNormals(input, this->Settings.NormalsArrayName) : nullptr;
  if (!normals)
  {
    return;
  }
  this->Given.assign(3 * static_cast<size_t>(this->Cloud().Size()), 0.0f);
  for (int i = 0; i < this->Cloud().Size(); ++i)
  {
    double tuple[3];
    normals->GetTuple(this->Cloud().InputIds[i], tuple);
    const Vector3 zero{};
    const Vector3 normal = Normalized({ tuple[0], tuple[1], tuple[2] }, zero);
    this->InvalidNormals += Dot(normal, normal) > 0.0 || !this->IsCounted(i) ? 0 : 1;
    Store(normal, this->Given.data() + 3 * static_cast<size_t>(i));
  }
}

void EstimationExecution::JudgeNormals()
{
  NormalsUse found = this->Given.empty() ? NormalsUse::None : NormalsUse::Kept;
  this->All([&] {
    if (!this->Given.empty() && this->Settings.JudgeNormals && this->Cloud().Size() > 0)
    {
      found = SurfelGeometry::JudgeNormals(this->Searched, this->Given);
    }
    return true;
  });
  const auto isFound = [&](NormalsUse use) { return !this->All([&] { return found < use; }); };
  SideRule& rule = this->Settings.Rule;
  const bool needsSides = rule == SideRule::Shape || rule == SideRule::Scanners;
  this->Normals = isFound(NormalsUse::Dropped)        ? NormalsUse::Dropped
    : needsSides && isFound(NormalsUse::WithoutSides) ? NormalsUse::WithoutSides
                                                      : std::min(found, NormalsUse::Kept);
  if (this->Normals == NormalsUse::Dropped)
  {
    this->Given.clear();
  }
  if (this->Settings.IsPart && rule == SideRule::Shape && this->Normals != NormalsUse::Kept)
  {
    rule = SideRule::TwoSided;
  }
}

bool EstimationExecution::Orient(vtkPointSet* input, const StageProgress& progress)
{
  const double* v = this->Settings.Viewpoint;
  return DecideSides({ this->Settings.Rule, this->Settings.UseViewpoint, { v[0], v[1], v[2] },
                       this->Sharing ? this->Sharing->Orientation : nullptr, this->Cloud(),
                       this->Searched.Graph, FindScanners(input) },
    progress, this->Fits, this->Result);
}

bool EstimationExecution::Shape(vtkPointSet* input, const StageProgress& progress)
{
  const OrientedCloud oriented{ this->Cloud(), *this->Searched.Tree, this->Searched.Graph,
    this->Result.TwoSided, FindScanners(input) };
  if (!RefineExtents(oriented, this->Settings.Fit, progress.Part(0.0, 0.4), this->Fits) ||
    !(this->Given.empty() || TurnToPoints(oriented, progress.Part(0.4, 0.42), this->Fits)) ||
    !SharpenNormals(oriented, progress.Part(0.42, 0.45), this->Fits) ||
    !RoundThinPoints(oriented, progress.Part(0.45, 0.46), this->Fits) ||
    !this->MakeKernels(input, oriented, progress.Part(0.46, 1.0)))
  {
    return false;
  }
  if (this->LeavesNeighbors() && this->Searched.Graph.AreNearest)
  {
    this->Searched.FindAround([this](int i) { return this->CenterOf(i); },
      [this](int i) { return FarShift * this->Fits[i].Spacing; });
  }
  return true;
}

bool EstimationExecution::MakeKernels(
  vtkPointSet* input, const OrientedCloud& oriented, const StageProgress& progress)
{
  const bool isCell = this->Settings.HasCells;
  const bool areColored = this->Settings.InterpolateColors && FindColorsToInterpolate(input);
  KernelSteering steering;
  this->Heights.Resize(isCell ? this->Fits.size() : 0);
  if (areColored)
  {
    this->Colors = GatherColors(input, this->Cloud());
    const double blur = isCell ? MeanBlur(this->Settings.CellBlur) : this->Settings.KernelScale;
    if (!InterpolateColors(oriented, this->Fits, blur, progress.Part(0.0, 0.4), this->Colors,
          { steering, isCell ? &this->Heights : nullptr }))
    {
      return false;
    }
  }
  return !isCell ||
    ((areColored || this->Heights.RiseAll(oriented, this->Fits, progress.Part(0.3, 0.4))) &&
      MeasureCells(oriented, { steering, this->Settings.CellBlur }, progress.Part(0.4, 1.0),
        this->Fits, this->Cells, this->Heights));
}

void EstimationExecution::Release()
{
  this->Searched.ReleaseTree();
  if (this->LeavesNeighbors())
  {
    this->Neighbors.Behind->Graph = std::move(this->Searched.Graph);
  }
  this->Searched.Graph = NeighborGraph();
  ReturnFreeMemory();
}

SurfelKernel EstimationExecution::KernelOf(int i) const
{
  const PlaneFit& fit = this->Fits[i];
  SurfelKernel kernel = this->HasCell(i)
    ? CellKernel(fit, this->Cells[i])
    : SpacingKernel(fit, this->Settings.KernelScale, this->Settings.IsElliptical);
  BoundAxes(this->Settings.MaximumAxisRatio, kernel);
  return kernel;
}

Vector3 EstimationExecution::CenterOf(int i) const
{
  const Vector3 p = Load(this->Cloud().Position(i));
  return this->HasCell(i)
    ? p + this->Cells[i].Centroid + double{ this->Heights.Final[i] } * this->Fits[i].Normal
    : p;
}

void EstimationExecution::Write(vtkPointSet* input, vtkPolyData* output)
{
  const auto points = static_cast<size_t>(input->GetNumberOfPoints());
  const bool areAll = this->Cloud().InputIds.size() == points;
  std::vector<char> kept(points, areAll ? 1 : 0);
  for (size_t i = 0; i < this->Cloud().InputIds.size() && !areAll; ++i)
  {
    kept[static_cast<size_t>(this->Cloud().InputIds[i])] = 1;
  }
  PassPointData(input, kept, output);
  this->Order = OrderOfInput(this->Cloud(), kept);
  this->WriteSurfels(output);
  if (!this->Colors.empty())
  {
    WriteColors(this->Colors, this->Order, output);
  }
  if (this->LeavesNeighbors())
  {
    this->Neighbors.Behind->Order = std::move(this->Order);
  }
}

void EstimationExecution::WriteSurfels(vtkPolyData* output)
{
  const vtkIdType count = this->Cloud().Size();
  const SurfelOutput surfels(count);
  const bool isSorted = !this->LeavesNeighbors();
  ParallelFor(0, count, [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      if (isSorted)
      {
        this->Prefetch(std::min(i + OutputPrefetch, count - 1));
      }
      const int from = isSorted ? this->Order[i] : static_cast<int>(i);
      const PlaneFit& fit = this->Fits[from];
      const SurfelKernel kernel = this->KernelOf(from);
      Store(this->CenterOf(from), surfels.Positions->GetPointer(3 * i));
      StoreCovariance(kernel, fit.Normal, surfels.Covariances->GetPointer(6 * i));
      Store(kernel.Area * fit.Normal, surfels.AreaVectors->GetPointer(3 * i));
      surfels.TwoSided->SetValue(i, this->Result.TwoSided[from]);
    }
  });
  surfels.Write(this->Cloud().Origin, output);
}

void EstimationExecution::Prefetch(vtkIdType i) const
{
  const auto from = static_cast<size_t>(this->Order[i]);
  SURFEL_PREFETCH(this->Cloud().Positions.data() + 3 * from);
  SURFEL_PREFETCH(this->Fits.data() + from);
  if (!this->Cells.empty())
  {
    SURFEL_PREFETCH(this->Cells.data() + from);
  }
}

EstimationCounts EstimationExecution::Count() const
{
  EstimationCounts counts;
  counts.NonFinite = this->Cloud().NonFinite;
  counts.Duplicate = this->Cloud().Duplicates;
  counts.InvalidNormals = this->InvalidNormals;
  counts.Normals = this->Normals;
  std::atomic<vtkIdType> isolated{ 0 }, degenerate{ 0 }, twoSided{ 0 };
  const auto count = static_cast<vtkIdType>(this->Fits.size());
  ParallelFor(0, count, [&](vtkIdType i, vtkIdType end) {
    vtkIdType sums[3] = { 0, 0, 0 };
    for (; i < end; ++i)
    {
      const bool isCounted = this->IsCounted(static_cast<int>(i));
      sums[0] += isCounted && this->Fits[i].Isolated ? 1 : 0;
      sums[1] += isCounted && this->Fits[i].Degenerate ? 1 : 0;
      sums[2] += isCounted ? this->Result.TwoSided[i] : 0;
    }
    isolated += sums[0];
    degenerate += sums[1];
    twoSided += sums[2];
  });
  counts.Isolated = isolated;
  counts.Degenerate = degenerate;
  counts.TwoSided = twoSided;
  counts.Components = this->Result.NumberOfComponents;
  counts.ClosedComponents = this->Result.NumberOfClosedComponents;
  counts.MedianSpacing = ParallelMedian(count, [this](vtkIdType i) {
    return this->IsCounted(static_cast<int>(i)) ? this->Fits[i].Spacing : -1.0f;
  });
  return counts;
}

bool EstimationExecution::All(const std::function<bool()>& work) const
{
  return this->Sharing ? this->Sharing->Orientation->All(work) : work();
}
}
