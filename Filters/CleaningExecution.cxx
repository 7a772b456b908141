// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/CleaningExecution.h"

#include "Filters/Arrays/InputArrays.h"
#include "Filters/Arrays/PointColors.h"
#include "Filters/Cleaning/CleaningProblem.h"
#include "Filters/Cleaning/DepthSteps.h"
#include "Filters/Cleaning/NearCopies.h"
#include "Filters/Cleaning/ScanRegistration.h"
#include "Filters/Cleaning/Smoothing.h"
#include "Filters/Cleaning/StrayPoints.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Neighbors/LocalCloud.h"

#include "vtkDataArray.h"
#include "vtkFloatArray.h"
#include "vtkPointData.h"
#include "vtkPointSet.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"

#include <algorithm>
#include <utility>

namespace SurfelGeometry
{
vtkSmartPointer<vtkPoints> CleaningExecution::Shifted(
  vtkPointSet* input, const std::vector<Float3>& shifts)
{
  auto points = vtkSmartPointer<vtkPoints>::New();
  points->SetDataType(input->GetPoints()->GetDataType());
  points->DeepCopy(input->GetPoints());
  for (size_t i = 0; i < shifts.size(); ++i)
  {
    const Vector3 shift = shifts[i];
    double p[3];
    points->GetPoint(static_cast<vtkIdType>(i), p);
    points->SetPoint(static_cast<vtkIdType>(i), p[0] + shift[0], p[1] + shift[1], p[2] + shift[2]);
  }
  return points;
}

bool CleaningExecution::Run(vtkPointSet* input)
{
  this->Begin(input);
  const StageProgress progress(this->Filter, 0.0, 1.0);
  if (!input->GetPoints())
  {
    return true;
  }
  if (!this->SmoothDepths(input, progress.Part(0.0, 0.1)))
  {
    return false;
  }
  this->Gather(input);
  LocalCloud& cloud = this->Searched.Cloud;
  for (size_t i = 0; !this->Shifts.empty() && i < cloud.InputIds.size(); ++i)
  {
    const Float3& shift = this->Shifts[cloud.InputIds[i]];
    cloud.Positions[3 * i] += shift.X;
    cloud.Positions[3 * i + 1] += shift.Y;
    cloud.Positions[3 * i + 2] += shift.Z;
  }
  return progress.Step(0.2) && this->Clean(input, nullptr, progress.Part(0.2, 0.9));
}

void CleaningExecution::MovePoints(vtkPolyData* output) const
{
  std::vector<Float3> kept;
  std::vector<int> ids;
  for (size_t i = 0; i < this->Kept.size(); ++i)
  {
    if (this->Kept[i])
    {
      kept.push_back(this->Shifts[i]);
      ids.push_back(static_cast<int>(i));
    }
  }
  output->SetPoints(Shifted(output, kept));
  if (!this->Colors.empty())
  {
    WriteColors(this->Colors, ids, output);
  }
  if (this->Settings.GenerateShifts)
  {
    const auto count = static_cast<vtkIdType>(kept.size());
    auto array = MakeArray<vtkFloatArray>("CleaningShift", 3, count);
    for (vtkIdType i = 0; i < count; ++i)
    {
      Store(kept[i], array->GetPointer(3 * i));
    }
    output->GetPointData()->AddArray(array);
  }
}

void CleaningExecution::HandOver(SearchedCloud& searched)
{
  if (this->AreMoved() || !this->Searched.Tree)
  {
    return; // its points have other neighbours
  }
  if (std::find(this->Kept.begin(), this->Kept.end(), 0) == this->Kept.end())
  {
    searched = std::move(this->Searched);
    return; // their ids stay
  }
  std::vector<int> ids;
  ids.reserve(this->Kept.size());
  int next = 0;
  for (const char kept : this->Kept)
  {
    ids.push_back(next);
    next += kept;
  }
  searched = std::move(this->Searched);
  searched.Cloud.NonFinite = searched.Cloud.Duplicates = 0;
  for (int& id : searched.Cloud.InputIds)
  {
    id = ids[id];
  }
}

CleaningCounts CleaningExecution::Count(vtkPointSet* input) const
{
  const auto count = [](const std::vector<char>& flags) {
    return static_cast<vtkIdType>(std::count(flags.begin(), flags.end(), char{ 1 }));
  };
  CleaningCounts counts;
  counts.NonFinite = this->NonFinite;
  counts.Stray = count(this->Strayed);
  counts.Twin = count(this->Twins);
  counts.Thick = this->Thick;
  counts.Duplicate = static_cast<vtkIdType>(this->Kept.size()) - this->NonFinite -
    count(this->Kept) - counts.Stray - counts.Twin;
  for (size_t i = 0; i < this->Shifts.size(); ++i)
  {
    const bool isMoved = this->Kept[i] && SingleDot(this->Shifts[i], this->Shifts[i]) > 0.0f;
    const bool isJoined = static_cast<vtkIdType>(i) >= this->Second;
    (isJoined ? counts.Joined : counts.Moved) += isMoved ? 1 : 0;
  }
  vtkDataArray* colors = this->Colors.empty() ? nullptr : FindColors(input);
  for (size_t i = 0; colors && i < this->Kept.size(); ++i)
  {
    double before[ColorComponents + 1];
    colors->GetTuple(static_cast<vtkIdType>(i), before);
    const auto after = this->Colors.begin() + static_cast<std::ptrdiff_t>(ColorComponents * i);
    counts.Recolored += this->Kept[i] && !std::equal(before, before + ColorComponents, after);
  }
  return counts;
}

void CleaningExecution::Begin(vtkPointSet* input)
{
  this->Kept.assign(input->GetNumberOfPoints(), 0);
  this->Strayed.assign(input->GetNumberOfPoints(), 0);
  this->Twins.assign(input->GetNumberOfPoints(), 0);
}

void CleaningExecution::Gather(vtkPointSet* input)
{
  double origin[3] = { 0.0, 0.0, 0.0 };
  ReadOrigin(input, origin);
  GatherCloud(input->GetPoints(), origin, this->Searched.Cloud);
  this->NonFinite = this->Searched.Cloud.NonFinite;
}

vtkSmartPointer<vtkDataArray> CleaningExecution::ToScanners(vtkPointSet* input) const
{
  vtkDataArray* known = FindScanners(input);
  if (known || !this->Settings.UseViewpoint)
  {
    return known;
  }
  double o[3];
  ReadOrigin(input, o);
  const double* v = this->Settings.Viewpoint;
  const auto ways = vtkSmartPointer<vtkFloatArray>::New();
  ways->SetNumberOfComponents(3);
  ways->SetNumberOfTuples(input->GetNumberOfPoints());
  ParallelFor(0, input->GetNumberOfPoints(), [&](vtkIdType i, vtkIdType end) {
    for (; i < end; ++i)
    {
      double p[3];
      input->GetPoints()->GetPoint(i, p);
      Store(
        { v[0] - o[0] - p[0], v[1] - o[1] - p[1], v[2] - o[2] - p[2] }, ways->GetPointer(3 * i));
    }
  });
  return ways;
}

bool CleaningExecution::SmoothDepths(vtkPointSet* input, const StageProgress& progress)
{
  if (!this->Settings.Smoothing || this->Settings.Columns == 0 || input->GetNumberOfPoints() == 0)
  {
    return true;
  }
  double o[3];
  ReadOrigin(input, o);
  const double* v = this->Settings.Viewpoint;
  const DepthImage image{ input->GetPoints(), this->Settings.Columns,
    { v[0] - o[0], v[1] - o[1], v[2] - o[2] } };
  return SmoothDepthSteps(image, progress, this->Shifts);
}

bool CleaningExecution::Clean(
  vtkPointSet* input, CleaningSharing* sharing, const StageProgress& progress)
{
  const LocalCloud& cloud = this->Searched.Cloud;
  this->Searched.Index();
  const CleaningProblem problem{ this->Searched, sharing };
  if (!this->DropCopies(problem, input, sharing, progress.Part(0.0, 0.05)))
  {
    return false;
  }
  std::vector<unsigned char> stray(cloud.Size(), 0);
  const bool isStored =
    !this->Settings.KeepsNeighbors || this->Searched.FindNeighbors(progress.Part(0.05, 0.2));
  if (!problem.All(isStored) ||
    (this->Settings.RemoveStrayPoints &&
      !problem.All(
        FindStrayPoints(problem, this->ToScanners(input), progress.Part(0.2, 0.4), stray))))
  {
    return false;
  }
  ParallelFor(0, cloud.Size(), [&](vtkIdType i, vtkIdType end) {
    for (; i < end; ++i)
    {
      (stray[i] ? this->Strayed : this->Kept)[cloud.InputIds[i]] = 1;
    }
  });
  this->Drop(stray, sharing);
  if (!this->Settings.Smoothing)
  {
    return true;
  }
  SmoothPoints smooth;
  if (!this->JoinScans(problem, input, sharing, progress.Part(0.4, 0.5)) ||
    !SmoothNoise(problem, input, progress.Part(0.5, 1.0), smooth))
  {
    return false;
  }
  this->Keep(smooth);
  return true;
}

bool CleaningExecution::DropCopies(const CleaningProblem& problem, vtkPointSet* input,
  CleaningSharing* sharing, const StageProgress& progress)
{
  std::vector<unsigned char> copies;
  if (this->Settings.RemoveStrayPoints &&
    !problem.All(FindNearCopies(problem, FindNormals(input, nullptr), progress, copies)))
  {
    return false;
  }
  this->Drop(copies, sharing);
  return true;
}

bool CleaningExecution::JoinScans(const CleaningProblem& problem, vtkPointSet* input,
  CleaningSharing* sharing, const StageProgress& progress)
{
  std::optional<ScanMotion> motion;
  if (this->Settings.Columns > 0)
  {
    return true; // a depth image is one scan
  }
  if (!FindSecondScan(problem, input, progress.Part(0.0, 0.8), motion))
  {
    return false;
  }
  if (!motion)
  {
    return true;
  }
  this->Second = motion->First;
  LocalCloud& cloud = this->Searched.Cloud;
  this->Shifts.resize(this->Kept.size());
  for (int i = 0; i < cloud.Size(); ++i)
  {
    if (cloud.SampleId(i) >= motion->First)
    {
      const Float3 shift = motion->ShiftOf(problem.SharedPosition(i));
      this->Shifts[cloud.InputIds[i]] = shift;
      Store(Load(cloud.Position(i)) + shift, &cloud.Positions[3 * static_cast<size_t>(i)]);
    }
  }
  this->Searched.Graph = NeighborGraph();
  this->Searched.Index();
  std::vector<unsigned char> twins;
  if (!problem.All(FindTwins(problem, motion->First, progress.Part(0.8, 1.0), twins)))
  {
    return false;
  }
  for (int i = 0; i < cloud.Size(); ++i)
  {
    this->Kept[cloud.InputIds[i]] &= twins[i] ? 0 : 1;
    this->Twins[cloud.InputIds[i]] = twins[i] ? 1 : 0;
  }
  this->Drop(twins, sharing);
  return true;
}

void CleaningExecution::Keep(const SmoothPoints& smooth)
{
  const RawVector<int>& ids = this->Searched.Cloud.InputIds;
  this->Thick = smooth.Thick;
  this->Shifts.resize(smooth.Shifts.empty() ? this->Shifts.size() : this->Kept.size());
  for (size_t i = 0; i < smooth.Shifts.size(); ++i)
  {
    Float3& shift = this->Shifts[ids[i]];
    shift = Vector3(shift) + Vector3(smooth.Shifts[i]);
  }
  this->Colors.resize(smooth.Colors.empty() ? 0 : ColorComponents * this->Kept.size());
  for (size_t i = 0; i < smooth.Colors.size() / ColorComponents; ++i)
  {
    std::copy_n(smooth.Colors.data() + ColorComponents * i, ColorComponents,
      this->Colors.data() + ColorComponents * static_cast<size_t>(ids[i]));
  }
}

void CleaningExecution::Drop(const std::vector<unsigned char>& dropped, CleaningSharing* sharing)
{
  if (std::find(dropped.begin(), dropped.end(), 1) == dropped.end())
  {
    return;
  }
  this->Searched.Drop(dropped);
  if (sharing)
  {
    size_t kept = 0;
    for (size_t i = 0; i < dropped.size(); ++i)
    {
      sharing->IsOwn[kept] = sharing->IsOwn[i];
      kept += dropped[i] ? 0 : 1;
    }
  }
}
}
