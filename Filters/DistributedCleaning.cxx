// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/CleaningExecution.h"

#include "Core/Base/Ranks.h"
#include "Filters/Arrays/InputArrays.h"
#include "Filters/Arrays/PointColors.h"
#include "Filters/Cleaning/CleaningProblem.h"
#include "Filters/Partition/PartitionedSurfels.h"

#include "vtkDataArray.h"
#include "vtkPointSet.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"

#include <algorithm>

namespace SurfelGeometry
{
namespace
{
/// What becomes of a point, as a value of the results.
constexpr float IsKept = 1.0f, IsStray = 0.0f, IsTwin = -1.0f;
}

bool CleaningExecution::RunDistributed(SurfelSplatting::Ranks& ranks, vtkPointSet* input)
{
  const StageProgress progress(this->Filter, 0.0, 1.0);
  vtkSmartPointer<vtkPointSet> smooth = input;
  vtkSmartPointer<vtkDataArray> toScanner;
  bool running = false;
  ranks.DoOwn([&] {
    this->Begin(input);
    running = this->SmoothDepths(input, progress.Part(0.0, 0.1));
    if (!this->Shifts.empty())
    {
      smooth.TakeReference(input->NewInstance());
      smooth->ShallowCopy(input);
      smooth->SetPoints(Shifted(input, this->Shifts));
    }
    toScanner = this->Settings.RemoveStrayPoints ? this->ToScanners(input) : nullptr;
  });
  if (!ranks.All(running))
  {
    return false;
  }
  PartitionedCloud cloud(ranks, smooth);
  std::vector<PartitionedCloud::Array> arrays;
  vtkDataArray* colors = FindColors(input);
  if (ranks.Any(colors != nullptr))
  {
    arrays.push_back({ FetchedColorsArray, ColorComponents, colors });
  }
  if (ranks.Any(toScanner != nullptr))
  {
    arrays.push_back({ ToScannerArray, 3, toScanner });
  }
  vtkDataArray* normals = FindNormals(input, nullptr);
  if (this->Settings.RemoveStrayPoints && ranks.Any(normals != nullptr))
  {
    arrays.push_back({ "Normals", 3, normals });
  }
  const auto region = cloud.Fetch(cloud.HaloWidth(HaloSpacings), arrays);
  CleaningExecution own(this->Settings, this->Filter);
  own.Settings.UseViewpoint = false; // it is that of this process's points only
  if (!own.CleanRegion(ranks, cloud, region, progress.Part(0.2, 0.9)))
  {
    return false;
  }
  this->NonFinite = cloud.NumberOfNonFinitePoints();
  this->Thick = own.Thick;
  this->Second = own.Second == VTK_ID_MAX ? own.Second : own.Second - cloud.FirstId();
  const bool areColored = ranks.Any(!own.Colors.empty());
  PartitionedCloud::Results results;
  ranks.DoOwn([&] { results = own.Results(cloud, areColored); });
  const PartitionedCloud::Returned returned = cloud.Return(results);
  ranks.DoOwn([&] { this->Take(returned, areColored, colors != nullptr); });
  return true;
}

bool CleaningExecution::CleanRegion(SurfelSplatting::Ranks& ranks, const PartitionedCloud& cloud,
  vtkPolyData* region, const StageProgress& progress)
{
  CleaningSharing sharing;
  sharing.Total = cloud.NumberOfPoints();
  std::copy_n(cloud.Origin(), 3, sharing.Origin);
  sharing.Gather = [&ranks](bool running, std::vector<float>& values) {
    const auto pack = [&values] {
      SurfelSplatting::Message message;
      SurfelSplatting::Put(values.data(), values.size(), message);
      values.clear();
      return message;
    };
    const std::vector<SurfelSplatting::Message> others = ranks.Share(pack);
    ranks.DoOwn([&] {
      for (const SurfelSplatting::Message& other : others)
      {
        const size_t at = values.size(), more = other.size() / sizeof(float);
        values.resize(at + more);
        SurfelSplatting::MessageReader(other).Get(values.data() + at, more);
      }
    });
    return ranks.All(running);
  };
  bool finished = false;
  ranks.DoTogether([&] {
    this->Begin(region);
    this->Gather(region);
    this->Searched.Cloud.SampleIds = cloud.GlobalIds();
    for (const int id : this->Searched.Cloud.InputIds)
    {
      sharing.IsOwn.push_back(cloud.IsInRegion(id) ? 1 : 0);
    }
    finished = this->Clean(region, &sharing, progress);
  });
  return ranks.All(finished);
}

PartitionedCloud::Results CleaningExecution::Results(
  const PartitionedCloud& cloud, bool areColored) const
{
  PartitionedCloud::Results results;
  results.Components = ResultComponents + (areColored ? ColorComponents : 0);
  for (size_t i = 0; i < this->Kept.size(); ++i)
  {
    const auto id = static_cast<vtkIdType>(i);
    if ((this->Kept[i] || this->Strayed[i] || this->Twins[i]) && cloud.IsInRegion(id))
    {
      const Float3 shift = this->Shifts.empty() ? Float3() : this->Shifts[i];
      const float fate = this->Kept[i] ? IsKept : this->Strayed[i] ? IsStray : IsTwin;
      results.Points.push_back(id);
      results.Values.insert(results.Values.end(), { fate, shift.X, shift.Y, shift.Z });
      if (areColored)
      {
        const auto color = this->Colors.begin() + static_cast<std::ptrdiff_t>(ColorComponents * i);
        results.Values.insert(results.Values.end(), color, color + ColorComponents);
      }
    }
  }
  return results;
}

void CleaningExecution::Take(
  const PartitionedCloud::Returned& returned, bool areColored, bool hasColors)
{
  const int components = ResultComponents + (areColored ? ColorComponents : 0);
  this->Colors.resize(areColored && hasColors ? ColorComponents * this->Kept.size() : 0);
  this->Shifts.resize(this->Colors.empty() ? this->Shifts.size() : this->Kept.size());
  const float* values = returned.Values.data();
  for (size_t i = 0; i < returned.Has.size(); ++i, values += components)
  {
    if (!returned.Has[i])
    {
      continue;
    }
    auto& same = values[0] == IsKept ? this->Kept
      : values[0] == IsStray         ? this->Strayed
                                     : this->Twins;
    same[i] = 1;
    const Vector3 shift = Load(values + 1);
    if (Dot(shift, shift) > 0.0)
    {
      this->Shifts.resize(this->Kept.size());
      this->Shifts[i] = Vector3(this->Shifts[i]) + shift;
    }
    for (int c = 0; c < ColorComponents && !this->Colors.empty(); ++c)
    {
      this->Colors[ColorComponents * i + c] =
        static_cast<unsigned char>(values[ResultComponents + c]);
    }
  }
}
}
