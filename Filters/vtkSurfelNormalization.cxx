// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelNormalization.h"

#include "Core/Surfels/SurfelArrays.h"
#include "Filters/Common/AvailableMemory.h"
#include "Filters/Common/InputArrays.h"
#include "Filters/Common/LocalCloud.h"
#include "Filters/Normalization/KernelWeights.h"
#include "Filters/Partition/PartitionedSurfels.h"
#include "Parallel/ControllerRanks.h"

#include "vtkDataArray.h"
#include "vtkFloatArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMultiProcessController.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"

#include <limits>
#include <sstream>

using namespace SurfelGeometry;
namespace Arrays = SurfelSplatting::Arrays;

vtkStandardNewMacro(vtkSurfelNormalization);

namespace
{
/// Without a virtual call for what the array nearly always is.
template <int Components>
void ReadTuple(vtkDataArray* array, vtkIdType id, double (&tuple)[Components])
{
  if (auto* floats = vtkFloatArray::FastDownCast(array))
  {
    std::copy_n(floats->GetPointer(Components * id), Components, tuple);
    return;
  }
  array->GetTuple(id, tuple);
}
}

/// One execution: unpacks the arrays, solves, packs.
class vtkSurfelNormalization::Execution
{
public:
  explicit Execution(vtkSurfelNormalization* self)
    : Self(self)
  {
  }

  /// Returns false if stopped. @param ranks that weight one cloud with this one, whose dealt points
  /// the input has, or null
  bool Run(vtkPolyData* input, vtkFloatArray* result, SurfelSplatting::Ranks* ranks = nullptr,
    const PartitionedCloud* dealt = nullptr)
  {
    vtkDataArray* areaVectors = input->GetPointData()->GetArray(Arrays::AreaVector);
    result->DeepCopy(areaVectors);
    result->SetName(Arrays::AreaVector);
    const double origin[3] = { 0.0, 0.0, 0.0 };
    if (input->GetPoints())
    {
      GatherCloud(input->GetPoints(), origin, this->Cloud);
    }
    WeightSharing sharing;
    if (ranks)
    {
      this->Cloud.SampleIds = dealt->GlobalIds();
      this->Share(*ranks, *dealt, sharing);
    }
    this->ReadSurfels(input);
    std::vector<double> areas(this->Surfels.size());
    for (size_t i = 0; i < areas.size(); ++i)
    {
      areas[i] = this->Surfels[i].Usable ? this->Surfels[i].Area : 0.0;
      this->Self->TotalAreaBefore += sharing.Mine.empty() || sharing.Mine[i] ? areas[i] : 0.0;
    }
    if (!SolveWeights(this->Cloud, this->Surfels, this->Settings(), ranks ? &sharing : nullptr,
          StageProgress(this->Self, 0.1, 1.0), areas, this->Report))
    {
      return false;
    }
    this->WriteAreas(areas, input, result);
    this->WriteReport(areas, sharing.Mine);
    return true;
  }

private:
  void Share(
    SurfelSplatting::Ranks& ranks, const PartitionedCloud& dealt, WeightSharing& sharing) const
  {
    for (const vtkIdType id : this->Cloud.InputIds)
    {
      sharing.Mine.push_back(dealt.IsMine(id) ? 1 : 0);
    }
    sharing.Sum = [&ranks](bool good, SumMoments& moments) {
      SurfelSplatting::Message message;
      SurfelSplatting::Put(moments, message);
      moments = SumMoments();
      for (const SurfelSplatting::Message& other : ranks.Share(message))
      {
        moments.Add(SurfelSplatting::MessageReader(other).Get<SumMoments>());
      }
      return ranks.All(good);
    };
  }

  WeightSettings Settings() const
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

  void ReadSurfels(vtkPolyData* input)
  {
    vtkDataArray* areaVectors = input->GetPointData()->GetArray(Arrays::AreaVector);
    vtkDataArray* covariances = input->GetPointData()->GetArray(Arrays::Covariance);
    vtkDataArray* twoSided = input->GetPointData()->GetArray(Arrays::TwoSided);
    this->Surfels.resize(this->Cloud.Size());
    vtkSMPTools::For(0, this->Cloud.Size(), [&](vtkIdType begin, vtkIdType end) {
      for (vtkIdType i = begin; i < end; ++i)
      {
        const vtkIdType id = this->Cloud.InputIds[i];
        double areaVector[3];
        double covariance[6];
        ReadTuple(areaVectors, id, areaVector);
        ReadTuple(covariances, id, covariance);
        this->Surfels[i] = MakeWeightSurfel(areaVector, covariance);
        this->Surfels[i].TwoSided = twoSided && twoSided->GetComponent(id, 0) != 0.0;
      }
    });
  }

  void WriteAreas(const std::vector<double>& areas, vtkPolyData* input, vtkFloatArray* result)
  {
    std::vector<char> seen(input->GetNumberOfPoints(), 0);
    for (size_t i = 0; i < areas.size(); ++i)
    {
      const vtkIdType id = this->Cloud.InputIds[i];
      seen[id] = 1;
      if (this->Surfels[i].Usable)
      {
        Store(areas[i] * this->Surfels[i].Normal, result->GetPointer(3 * id));
      }
    }
    if (this->Cloud.Duplicates > 0)
    {
      for (vtkIdType id = 0; id < input->GetNumberOfPoints(); ++id)
      {
        double p[3];
        input->GetPoint(id, p);
        if (!seen[id] && std::abs(p[0]) + std::abs(p[1]) + std::abs(p[2]) < LargestCoordinate)
        {
          Store(Vector3{}, result->GetPointer(3 * id));
        }
      }
    }
  }

  /// @param mine which surfels count; empty: all
  void WriteReport(const std::vector<double>& areas, const std::vector<char>& mine)
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
      if (!mine.empty() && !mine[i])
      {
        continue;
      }
      self->TotalAreaAfter += areas[i];
      self->NumberOfUnusableSurfels += this->Surfels[i].Usable ? 0 : 1;
    }
  }

  vtkSurfelNormalization* Self;
  LocalCloud Cloud;
  std::vector<WeightSurfel> Surfels;
  WeightReport Report;
};

//------------------------------------------------------------------------------
vtkSurfelNormalization::vtkSurfelNormalization()
  : Controller(vtkMultiProcessController::GetGlobalController())
{
}

vtkSurfelNormalization::~vtkSurfelNormalization() = default;

//------------------------------------------------------------------------------
void vtkSurfelNormalization::SetController(vtkMultiProcessController* controller)
{
  if (this->Controller != controller)
  {
    this->Controller = controller;
    this->Modified();
  }
}

//------------------------------------------------------------------------------
vtkMultiProcessController* vtkSurfelNormalization::GetController()
{
  return this->Controller;
}

//------------------------------------------------------------------------------
int vtkSurfelNormalization::RequestData(vtkInformation* vtkNotUsed(request),
  vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  vtkPolyData* input = vtkPolyData::GetData(inputVector[0]);
  vtkPolyData* output = vtkPolyData::GetData(outputVector);
  this->ResetReport();
  if (this->Controller && this->Controller->GetNumberOfProcesses() > 1)
  {
    SurfelSplatting::ControllerRanks ranks(this->Controller);
    return this->RequestDistributed(ranks, input, output);
  }
  if (!this->CheckInput(input))
  {
    return 0;
  }
  vtkNew<vtkFloatArray> areaVectors;
  Execution execution(this);
  if (!execution.Run(input, areaVectors))
  {
    return 1; // stopped by the user: empty output
  }
  output->ShallowCopy(input);
  output->GetPointData()->AddArray(areaVectors);
  this->WarnOfTroubles();
  this->UpdateProgress(1.0);
  return 1;
}

//------------------------------------------------------------------------------
int vtkSurfelNormalization::RequestDistributed(
  SurfelSplatting::Ranks& ranks, vtkPolyData* input, vtkPolyData* output)
{
  // A process without points need not have the arrays either.
  const bool isEmpty = input && input->GetNumberOfPoints() == 0;
  const bool good = isEmpty || this->CheckInput(input);
  if (!ranks.All(good))
  {
    if (good)
    {
      vtkErrorMacro("No surfels were weighted: another process cannot, see its messages.");
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
  const auto weight = [&](vtkPolyData* dealt) -> vtkSmartPointer<vtkPolyData> {
    vtkNew<vtkFloatArray> areaVectors;
    Execution execution(this);
    this->ResetReport();
    if (!execution.Run(dealt, areaVectors, &ranks, &cloud))
    {
      return nullptr;
    }
    dealt->GetPointData()->AddArray(areaVectors);
    return dealt;
  };
  const vtkSmartPointer<vtkPolyData> surfels = WorkOnRegion(ranks, cloud, arrays, 0.0, weight);
  if (!surfels)
  {
    return 1; // stopped by a user: empty output, on all
  }
  output->ShallowCopy(input);
  WritePartitionedAreas(cloud, surfels, output);
  this->WarnOfTroubles();
  this->UpdateProgress(1.0);
  return 1;
}

//------------------------------------------------------------------------------
bool vtkSurfelNormalization::CheckInput(vtkPolyData* input)
{
  const std::string problem = CheckSurfels(input);
  if (!problem.empty())
  {
    vtkErrorMacro(<< problem);
    return false;
  }
  if (input->GetNumberOfPoints() > std::numeric_limits<int>::max() / 2)
  {
    vtkErrorMacro("The input has " << input->GetNumberOfPoints()
                                   << " surfels; the neighbour search takes up to "
                                   << std::numeric_limits<int>::max() / 2 << ". Split the cloud.");
    return false;
  }
  // At the filter's peak, its output included: 271 were measured with 4 million surfels.
  constexpr double bytesPerPoint = 285.0;
  const std::string memory = SurfelGeometry::CheckMemory(
    input->GetNumberOfPoints(), bytesPerPoint, SurfelGeometry::AvailableMemory());
  if (!memory.empty())
  {
    vtkErrorMacro(<< memory);
    return false;
  }
  return true;
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
  if (this->NumberOfUnusableSurfels > 0 || this->NumberOfDuplicateSurfels > 0)
  {
    vtkWarningMacro(<< this->NumberOfUnusableSurfels
                    << " surfels left as they were (values not finite, no area or no extent); "
                    << this->NumberOfDuplicateSurfels
                    << " surfels at the position of another one got the weight 0.");
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
