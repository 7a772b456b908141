// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelNormalization.h"

#include "Core/Surfels/SurfelArrays.h"
#include "Filters/Arrays/InputArrays.h"
#include "Filters/Common/AvailableMemory.h"
#include "Filters/Common/Intrinsics.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Neighbors/NeighborGraph.h"
#include "Filters/Normalization/KernelWeights.h"
#include "Filters/Partition/PartitionedSurfels.h"
#include "Parallel/ControllerRanks.h"
#include "SurfelData/SurfelCheck.h"

#include "vtkDataArray.h"
#include "vtkFloatArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMultiProcessController.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

using namespace SurfelGeometry;
namespace Arrays = SurfelSplatting::Arrays;

vtkStandardNewMacro(vtkSurfelNormalization);

namespace
{
/// The tuples of an array; without virtual calls if it has the type that it nearly always has.
template <typename TypedArray, int Components>
class TupleReader
{
public:
  explicit TupleReader(vtkDataArray* array)
    : Array(array)
  {
    if (auto* typed = TypedArray::FastDownCast(array))
    {
      this->Values = typed->GetPointer(0);
    }
  }

  bool HasArray() const { return this->Array != nullptr; }

  void Read(vtkIdType id, double (&tuple)[Components]) const
  {
    if (this->Values)
    {
      std::copy_n(this->Values + Components * id, Components, tuple);
    }
    else
    {
      this->Array->GetTuple(id, tuple);
    }
  }

  void Prefetch(vtkIdType id) const
  {
    if (this->Values)
    {
      SURFEL_PREFETCH(this->Values + Components * id);
    }
  }

private:
  vtkDataArray* Array;
  const typename TypedArray::ValueType* Values = nullptr; // null: of another type
};

/// Arrays are in the order of the input, which may be any: so many tuples are being loaded at a
/// time.
constexpr vtkIdType PrefetchDistance = 16;

/// Makes kernels from the input's arrays, which are read again for each part of the cloud that
/// needs them: all together would take 50 bytes a surfel.
class KernelReader : public KernelSource
{
public:
  /// @param ids [n] of the surfels in the input; null: they are in the order of the cloud
  KernelReader(vtkPolyData* input, const int* ids)
    : Ids(ids)
    , AreaVectors(input->GetPointData()->GetArray(Arrays::AreaVector))
    , Covariances(input->GetPointData()->GetArray(Arrays::Covariance))
    , TwoSided(input->GetPointData()->GetArray(Arrays::TwoSided))
  {
  }

  WeightedKernel Make(int i) const override
  {
    const vtkIdType id = this->Ids ? this->Ids[i] : i;
    double areaVector[3], covariance[6], twoSided[1] = { 0.0 };
    this->AreaVectors.Read(id, areaVector);
    this->Covariances.Read(id, covariance);
    if (this->TwoSided.HasArray())
    {
      this->TwoSided.Read(id, twoSided);
    }
    WeightedKernel kernel = MakeWeightedKernel(areaVector, covariance);
    kernel.TwoSided = twoSided[0] != 0.0;
    return kernel;
  }

  void Prefetch(int i) const override
  {
    if (this->Ids)
    {
      const vtkIdType id = this->Ids[i];
      this->AreaVectors.Prefetch(id);
      this->Covariances.Prefetch(id);
      this->TwoSided.Prefetch(id);
    }
  }

private:
  const int* Ids;
  TupleReader<vtkFloatArray, 3> AreaVectors;
  TupleReader<vtkFloatArray, 6> Covariances;
  TupleReader<vtkUnsignedCharArray, 1> TwoSided;
};
}

/// One execution: unpacks the arrays, solves, packs.
class vtkSurfelNormalization::Execution
{
public:
  explicit Execution(vtkSurfelNormalization* self)
    : Self(self)
  {
  }

  /// Returns false if stopped.
  /// @param result gets the arrays
  /// @param ranks  the ranks that weight one cloud together, or null
  /// @param region with ranks: the cloud whose region and halo the input is
  bool Run(vtkPolyData* input, vtkPolyData* result, SurfelSplatting::Ranks* ranks = nullptr,
    const PartitionedCloud* region = nullptr)
  {
    const bool knowsNeighbors = !ranks && this->KnowsNeighbors(input);
    if (knowsNeighbors)
    {
      this->TakeOrder(input->GetPoints());
    }
    else if (input->GetPoints())
    {
      const double origin[3] = { 0.0, 0.0, 0.0 };
      GatherCloud(input->GetPoints(), origin, this->Cloud);
    }
    if (!ranks && !knowsNeighbors && this->KnowsOrder(input))
    {
      const RawVector<int> ids = this->Self->Neighbors->InputRanks();
      this->Cloud.SampleIds.assign(ids.begin(), ids.end());
    }
    this->IsSorted = knowsNeighbors;
    WeightSharing sharing;
    if (ranks)
    {
      this->Cloud.SampleIds = region->GlobalIds();
      this->Share(*ranks, *region, sharing);
    }
    RawVector<double> areas;
    const WeightSettings settings = this->GetWeightSettings();
    const KernelReader kernels(input, this->IsSorted ? nullptr : this->Cloud.InputIds.data());
    const WeightProblem problem{ this->Cloud, kernels, settings, ranks ? &sharing : nullptr,
      knowsNeighbors ? &this->Self->Neighbors->Graph : nullptr };
    if (!SolveWeights(problem, StageProgress(this->Self, 0.1, 1.0), areas, this->Report))
    {
      return false;
    }
    vtkNew<vtkFloatArray> areaVectors;
    this->WriteAreas(areas, input, areaVectors);
    result->ShallowCopy(input);
    result->GetPointData()->AddArray(areaVectors);
    result->GetPointData()->AddArray(this->MakeOverlaps(input->GetNumberOfPoints()));
    this->WriteReport(areas, sharing.IsOwn);
    return true;
  }

private:
  /// Whether the estimation has left the neighbours of these points, and enough of them.
  bool KnowsNeighbors(vtkPolyData* input) const
  {
    const SurfelNeighbors* known = this->Self->Neighbors;
    const auto count = static_cast<std::size_t>(input->GetNumberOfPoints());
    return this->KnowsOrder(input) && known->Graph.AreNearest &&
      known->Graph.Ids.size() == KeptNeighbors * count &&
      this->Self->NumberOfNeighbors <= KeptNeighbors;
  }

  /// Whether the input is in the order of the estimation's cloud.
  bool KnowsOrder(vtkPolyData* input) const
  {
    const SurfelNeighbors* known = this->Self->Neighbors;
    return known && known->Order.size() == static_cast<std::size_t>(input->GetNumberOfPoints());
  }

  /// Orders the cloud like the estimation's, without sorting again.
  void TakeOrder(vtkPoints* points)
  {
    this->Cloud.InputIds = this->Self->Neighbors->InputRanks();
    const auto count = static_cast<vtkIdType>(this->Cloud.InputIds.size());
    this->Cloud.Positions.resize(3 * this->Cloud.InputIds.size());
    ParallelFor(0, count, [&](vtkIdType i, vtkIdType end) {
      for (; i < end; ++i)
      {
        double p[3];
        points->GetPoint(i, p);
        std::copy_n(p, 3, this->Cloud.Positions.data() + 3 * i);
      }
    });
  }

  void Share(
    SurfelSplatting::Ranks& ranks, const PartitionedCloud& region, WeightSharing& sharing) const
  {
    for (const int id : this->Cloud.InputIds)
    {
      sharing.IsOwn.push_back(region.IsInRegion(id) ? 1 : 0);
    }
    sharing.Sum = [&ranks](bool running, SumMoments& moments) {
      const auto pack = [own = moments] { return SurfelSplatting::MessageOf(own); };
      moments = SumMoments();
      for (const SurfelSplatting::Message& other : ranks.Share(pack))
      {
        moments.Add(SurfelSplatting::MessageReader(other).Get<SumMoments>());
      }
      return ranks.All(running);
    };
  }

  WeightSettings GetWeightSettings() const
  {
    WeightSettings settings;
    settings.SamplesPerPoint = this->Self->SamplesPerPoint;
    settings.NumberOfIterations = this->Self->NumberOfIterations;
    settings.NumberOfNeighbors = this->Self->NumberOfNeighbors;
    settings.Support = this->Self->Support;
    settings.SampleRadius = this->Self->SampleRadius;
    settings.NormalOffset = this->Self->NormalOffset;
    settings.MinimumFactor = this->Self->MinimumFactor;
    settings.MaximumFactor = this->Self->MaximumFactor;
    return settings;
  }

  void WriteAreas(const RawVector<double>& areas, vtkPolyData* input, vtkFloatArray* result)
  {
    vtkDataArray* areaVectors = input->GetPointData()->GetArray(Arrays::AreaVector);
    result->SetName(Arrays::AreaVector);
    result->SetNumberOfComponents(3);
    result->SetNumberOfTuples(areaVectors->GetNumberOfTuples());
    const TupleReader<vtkFloatArray, 3> reader(areaVectors);
    ParallelFor(0, result->GetNumberOfTuples(), [&](vtkIdType i, vtkIdType end) {
      for (; i < end; ++i)
      {
        double area[3];
        reader.Read(i, area);
        Store(Vector3{ area[0], area[1], area[2] }, result->GetPointer(3 * i));
      }
    });
    ParallelFor(0, this->Cloud.Size(), [&](vtkIdType begin, vtkIdType end) {
      for (vtkIdType i = begin; i < end; ++i)
      {
        const vtkIdType next = std::min<vtkIdType>(i + PrefetchDistance, end - 1);
        SURFEL_PREFETCH(result->GetPointer(3 * this->IdOf(next)));
        float* area = result->GetPointer(3 * this->IdOf(i));
        if (this->IsUsable(i))
        {
          Store(areas[i] * Normalized(Load(area), {}), area);
        }
      }
    });
    if (this->Cloud.Duplicates > 0)
    {
      std::vector<char> seen(input->GetNumberOfPoints(), 0);
      for (const int id : this->Cloud.InputIds)
      {
        seen[id] = 1;
      }
      for (vtkIdType id = 0; id < input->GetNumberOfPoints(); ++id)
      {
        double p[3];
        input->GetPoint(id, p);
        if (!seen[id] && std::abs(p[0]) + std::abs(p[1]) + std::abs(p[2]) < CoordinateLimit)
        {
          Store(Vector3{}, result->GetPointer(3 * id));
        }
      }
    }
  }

  vtkSmartPointer<vtkUnsignedCharArray> MakeOverlaps(vtkIdType count) const
  {
    auto overlaps = MakeArray<vtkUnsignedCharArray>(Arrays::Overlap, 1, count);
    overlaps->FillValue(0);
    ParallelFor(0, this->Cloud.Size(), [&](vtkIdType begin, vtkIdType end) {
      for (vtkIdType i = begin; i < end; ++i)
      {
        const float overlap = this->Report.Overlaps[static_cast<std::size_t>(i)];
        overlaps->SetValue(this->IdOf(i), static_cast<unsigned char>(255.0f * overlap + 0.5f));
      }
    });
    return overlaps;
  }

  /// @param isOwn whether a surfel is in this process's region and counts; empty: all count
  void WriteReport(const RawVector<double>& areas, const std::vector<char>& isOwn)
  {
    vtkSurfelNormalization* self = this->Self;
    self->MeanBefore = this->Report.Before.Mean;
    self->StandardDeviationBefore = this->Report.Before.StandardDeviation;
    self->MinimumBefore = this->Report.Before.Minimum;
    self->MaximumBefore = this->Report.Before.Maximum;
    self->MeanAfter = this->Report.After.Mean;
    self->StandardDeviationAfter = this->Report.After.StandardDeviation;
    self->MinimumAfter = this->Report.After.Minimum;
    self->MaximumAfter = this->Report.After.Maximum;
    self->NumberOfSamples = this->Report.NumberOfSamples;
    self->NumberOfDuplicateSurfels = this->Cloud.Duplicates;
    self->NumberOfUnusableSurfels = this->Cloud.NonFinite;
    for (size_t i = 0; i < areas.size(); ++i)
    {
      if (!isOwn.empty() && !isOwn[i])
      {
        continue;
      }
      self->TotalAreaBefore += this->Report.InitialAreas[i];
      self->TotalAreaAfter += areas[i];
      self->NumberOfUnusableSurfels += this->IsUsable(i) ? 0 : 1;
    }
  }

  /// The surfel's id in the input.
  vtkIdType IdOf(vtkIdType i) const
  {
    return this->IsSorted ? i : vtkIdType{ this->Cloud.InputIds[static_cast<std::size_t>(i)] };
  }

  /// Whether a surfel has a kernel.
  bool IsUsable(std::size_t i) const { return this->Report.InitialAreas[i] > 0.0f; }

  vtkSurfelNormalization* Self;
  LocalCloud Cloud;
  bool IsSorted = false; // the input is in the order of the cloud
  WeightReport Report;
};

//------------------------------------------------------------------------------
vtkSurfelNormalization::vtkSurfelNormalization()
  : Controller(vtkMultiProcessController::GetGlobalController())
{
}

vtkSurfelNormalization::~vtkSurfelNormalization() = default;

//------------------------------------------------------------------------------
vtkCxxSetSmartPointerMacro(vtkSurfelNormalization, Controller, vtkMultiProcessController);

//------------------------------------------------------------------------------
vtkMultiProcessController* vtkSurfelNormalization::GetController()
{
  return this->Controller;
}

//------------------------------------------------------------------------------
int vtkSurfelNormalization::RequestData(vtkInformation* vtkNotUsed(request),
  vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  return this->Execute(vtkPolyData::GetData(inputVector[0]), vtkPolyData::GetData(outputVector));
}

//------------------------------------------------------------------------------
int vtkSurfelNormalization::Execute(vtkPolyData* input, vtkPolyData* output)
{
  this->ResetReport();
  try
  {
    if (this->Controller && this->Controller->GetNumberOfProcesses() > 1)
    {
      SurfelSplatting::ControllerRanks ranks(this->Controller);
      return this->RequestDistributed(ranks, input, output);
    }
    return this->ExecuteAlone(input, output);
  }
  catch (const std::bad_alloc&)
  {
    this->ResetReport();
    output->Initialize();
    vtkErrorMacro(<< LackOfMemory(input->GetNumberOfPoints()));
    return 0;
  }
}

//------------------------------------------------------------------------------
int vtkSurfelNormalization::ExecuteAlone(vtkPolyData* input, vtkPolyData* output)
{
  if (!this->CheckInput(input))
  {
    return 0;
  }
  Execution execution(this);
  if (!execution.Run(input, output))
  {
    return 1; // stopped by the user: empty output
  }
  this->WarnOfTroubles();
  this->UpdateProgress(1.0);
  return 1;
}

//------------------------------------------------------------------------------
int vtkSurfelNormalization::RequestDistributed(
  SurfelSplatting::Ranks& ranks, vtkPolyData* input, vtkPolyData* output)
{
  // A process without points does not need the arrays.
  const bool isEmpty = input && input->GetNumberOfPoints() == 0;
  bool isReady = false;
  ranks.DoOwn([&] { isReady = isEmpty || this->CheckInput(input); });
  if (!ranks.All(isReady))
  {
    if (isReady)
    {
      vtkErrorMacro("No surfels were weighted: another process reported an error.");
    }
    return 0;
  }
  vtkPointData* data = input->GetPointData();
  PartitionedCloud cloud(ranks, input);
  std::vector<PartitionedCloud::Array> arrays = { { Arrays::Covariance, 6,
                                                    data->GetArray(Arrays::Covariance) },
    { Arrays::AreaVector, 3, data->GetArray(Arrays::AreaVector) } };
  vtkDataArray* twoSided = data->GetArray(Arrays::TwoSided);
  if (ranks.Any(twoSided != nullptr))
  {
    arrays.push_back({ Arrays::TwoSided, 1, twoSided });
  }
  const auto weight = [&](vtkPolyData* region) -> vtkSmartPointer<vtkPolyData> {
    Execution execution(this);
    this->ResetReport();
    auto weighted = vtkSmartPointer<vtkPolyData>::New();
    bool finished = false;
    ranks.DoTogether([&] { finished = execution.Run(region, weighted, &ranks, &cloud); });
    return finished ? weighted : nullptr;
  };
  const vtkSmartPointer<vtkPolyData> surfels = WorkOnRegion(ranks, cloud, arrays, 0.0, weight);
  if (!surfels)
  {
    return 1; // stopped by a user: empty output on all processes
  }
  output->ShallowCopy(input);
  WritePartitionedAreas(ranks, cloud, surfels, output);
  this->WarnOfTroubles();
  this->UpdateProgress(1.0);
  return 1;
}

//------------------------------------------------------------------------------
bool vtkSurfelNormalization::CheckInput(vtkPolyData* input)
{
  std::string problem = SurfelSplatting::CheckSurfels(input);
  if (problem.empty())
  {
    problem = CheckNumberOfPoints(input->GetNumberOfPoints());
  }
  if (problem.empty())
  {
    problem = CheckMemory(input->GetNumberOfPoints(),
      this->Neighbors ? BytesPerPointBesidesNeighbors : BytesPerPoint, AvailableMemory());
  }
  if (!problem.empty())
  {
    vtkErrorMacro(<< problem);
    return false;
  }
  return true;
}

//------------------------------------------------------------------------------
void vtkSurfelNormalization::CopySettings(vtkSurfelNormalization* other)
{
  this->SetSamplesPerPoint(other->SamplesPerPoint);
  this->SetNumberOfIterations(other->NumberOfIterations);
  this->SetNumberOfNeighbors(other->NumberOfNeighbors);
  this->SetSupport(other->Support);
  this->SetSampleRadius(other->SampleRadius);
  this->SetNormalOffset(other->NormalOffset);
  this->SetMinimumFactor(other->MinimumFactor);
  this->SetMaximumFactor(other->MaximumFactor);
}

//------------------------------------------------------------------------------
void vtkSurfelNormalization::ResetReport()
{
  this->MeanBefore = this->StandardDeviationBefore = 0.0;
  this->MinimumBefore = this->MaximumBefore = 0.0;
  this->MeanAfter = this->StandardDeviationAfter = 0.0;
  this->MinimumAfter = this->MaximumAfter = 0.0;
  this->TotalAreaBefore = this->TotalAreaAfter = 0.0;
  this->NumberOfSamples = 0;
  this->NumberOfUnusableSurfels = 0;
  this->NumberOfDuplicateSurfels = 0;
}

//------------------------------------------------------------------------------
void vtkSurfelNormalization::WarnOfTroubles()
{
  const std::string message =
    ListCounts({ { this->NumberOfUnusableSurfels, "surfel",
                   "left unchanged (values not finite, no area or no extent)" },
      { this->NumberOfDuplicateSurfels, "surfel",
        "at the position of another one got the weight 0" } });
  if (!message.empty())
  {
    vtkWarningMacro(<< message << '.');
  }
}

//------------------------------------------------------------------------------
void vtkSurfelNormalization::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "SamplesPerPoint: " << this->SamplesPerPoint << "\n";
  os << indent << "NumberOfIterations: " << this->NumberOfIterations << "\n";
  os << indent << "NumberOfNeighbors: " << this->NumberOfNeighbors << "\n";
  os << indent << "Support: " << this->Support << "\n";
  os << indent << "SampleRadius: " << this->SampleRadius << "\n";
  os << indent << "NormalOffset: " << this->NormalOffset << "\n";
  os << indent << "MinimumFactor: " << this->MinimumFactor << "\n";
  os << indent << "MaximumFactor: " << this->MaximumFactor << "\n";
  os << indent << "Controller: " << this->Controller.Get() << "\n";
  os << indent << "Sum before: mean " << this->MeanBefore << ", standard deviation "
     << this->StandardDeviationBefore << ", range " << this->MinimumBefore << " to "
     << this->MaximumBefore << "\n";
  os << indent << "Sum after: mean " << this->MeanAfter << ", standard deviation "
     << this->StandardDeviationAfter << ", range " << this->MinimumAfter << " to "
     << this->MaximumAfter << "\n";
  os << indent << "TotalAreaBefore: " << this->TotalAreaBefore << "\n";
  os << indent << "TotalAreaAfter: " << this->TotalAreaAfter << "\n";
  os << indent << "NumberOfSamples: " << this->NumberOfSamples << "\n";
  os << indent << "NumberOfUnusableSurfels: " << this->NumberOfUnusableSurfels << "\n";
  os << indent << "NumberOfDuplicateSurfels: " << this->NumberOfDuplicateSurfels << "\n";
}
