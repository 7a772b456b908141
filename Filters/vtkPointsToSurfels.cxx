// SPDX-License-Identifier: BSD-3-Clause
#include "vtkPointsToSurfels.h"

#include "Filters/Arrays/ScanSensor.h"
#include "Filters/Arrays/SurfelOutput.h"
#include "Filters/Common/AvailableMemory.h"
#include "Filters/Common/Intrinsics.h"
#include "Filters/Common/StageProgress.h"
#include "Filters/Common/WorkerListener.h"
#include "Filters/Neighbors/NeighborGraph.h"
#include "Filters/SensorSettings.h"
#include "Parallel/ControllerRanks.h"
#include "vtkPointCloudCleaning.h"
#include "vtkSurfelEstimation.h"
#include "vtkSurfelHierarchy.h"
#include "vtkSurfelNormalization.h"

#include "vtkCommand.h"
#include "vtkDataArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMultiProcessController.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPointSet.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

using namespace SurfelGeometry;

vtkStandardNewMacro(vtkPointsToSurfels);

/// One execution. The filters work without a pipeline: their settings and counts stay in place.
class vtkPointsToSurfels::Execution
{
public:
  explicit Execution(vtkPointsToSurfels* self)
    : Self(self)
  {
    self->Cleaning->Searched = self->Estimation->Searched = &this->Searched;
    self->Estimation->Neighbors = self->Normalization->Neighbors = &this->Neighbors;
    self->Hierarchy->Neighbors = &this->Neighbors;
  }
  ~Execution()
  {
    this->Self->Cleaning->Searched = this->Self->Estimation->Searched = nullptr;
    this->Self->Estimation->Neighbors = this->Self->Normalization->Neighbors = nullptr;
    this->Self->Hierarchy->Neighbors = nullptr;
  }
  Execution(const Execution&) = delete;
  void operator=(const Execution&) = delete;

  std::string Error, Warnings;

  /// Returns false if stopped, or after an error, which is in Error.
  bool Run(vtkPointSet* input, vtkPolyData* output)
  {
    vtkNew<vtkPolyData> clean, surfels, weighted;
    if (this->Self->CleanPoints)
    {
      if (!this->Work(this->Self->Cleaning.Get(), 0.0, 0.15, input, clean.Get()))
      {
        return false;
      }
      clean->SetVerts(nullptr); // frees memory: nobody sees these points
      input = clean;
    }
    if (!this->Work(this->Self->Estimation.Get(), 0.15, 0.5, input, surfels.Get()))
    {
      return false;
    }
    if (this->Self->BuildHierarchy)
    {
      surfels->SetVerts(nullptr); // frees memory: the hierarchy has its own
    }
    return this->Work(this->Self->Normalization.Get(), 0.5, 0.85, surfels.Get(), weighted.Get()) &&
      this->Finish(surfels, weighted, output);
  }

private:
  bool Finish(vtkPolyData* surfels, vtkPolyData* weighted, vtkPolyData* output)
  {
    surfels->Initialize(); // frees the areas before the normalization
    this->Neighbors.Graph = NeighborGraph();
    if (this->Self->BuildHierarchy)
    {
      return this->Work(this->Self->Hierarchy.Get(), 0.85, 1.0, weighted, output);
    }
    this->SortByInput(weighted);
    output->ShallowCopy(weighted);
    return true;
  }

  /// Puts the surfels, which are in the order of the cloud so far, into that of the input.
  void SortByInput(vtkPolyData* surfels)
  {
    const std::vector<int>& order = this->Neighbors.Order;
    if (order.empty())
    {
      return; // no surfels; or several processes, which keep the order
    }
    vtkNew<vtkPoints> points;
    points->SetData(Sorted(surfels->GetPoints()->GetData(), order));
    surfels->SetPoints(points);
    for (const char* name : SurfelOutput::Names)
    {
      vtkPointData* data = surfels->GetPointData();
      data->AddArray(Sorted(data->GetArray(name), order));
    }
  }

  /// @param order [tuples] the source's tuple of each one
  static vtkSmartPointer<vtkDataArray> Sorted(vtkDataArray* source, const std::vector<int>& order)
  {
    vtkSmartPointer<vtkDataArray> array;
    array.TakeReference(source->NewInstance());
    array->SetName(source->GetName());
    array->SetNumberOfComponents(source->GetNumberOfComponents());
    const auto count = static_cast<vtkIdType>(order.size());
    array->SetNumberOfTuples(count);
    const auto size =
      static_cast<std::size_t>(source->GetNumberOfComponents() * source->GetDataTypeSize());
    const auto* from = static_cast<const unsigned char*>(source->GetVoidPointer(0));
    auto* to = static_cast<unsigned char*>(array->GetVoidPointer(0));
    ParallelFor(0, count, [&](vtkIdType i, vtkIdType end) {
      constexpr vtkIdType distance = 16;
      for (; i < end; ++i)
      {
        const auto next = static_cast<std::size_t>(order[std::min(i + distance, count - 1)]);
        SURFEL_PREFETCH(from + size * next);
        std::memcpy(to + size * i, from + size * static_cast<std::size_t>(order[i]), size);
      }
    });
    return array;
  }

  template <typename Filter, typename Input>
  bool Work(Filter* filter, double from, double to, Input* input, vtkPolyData* output)
  {
    const WorkerListener listener(StageProgress(this->Self, from, to), filter);
    filter->InvokeEvent(vtkCommand::StartEvent);
    const bool succeeded = filter->Execute(input, output) != 0;
    filter->InvokeEvent(vtkCommand::EndEvent);
    this->Warnings += listener.Warning;
    this->Error = succeeded ? std::string() : listener.Error;
    return succeeded && !listener.Stopped;
  }

  vtkPointsToSurfels* Self;
  SearchedCloud Searched;
  SurfelNeighbors Neighbors;
};

//------------------------------------------------------------------------------
vtkPointsToSurfels::vtkPointsToSurfels() = default;
vtkPointsToSurfels::~vtkPointsToSurfels() = default;

//------------------------------------------------------------------------------
void vtkPointsToSurfels::SetController(vtkMultiProcessController* controller)
{
  this->Cleaning->SetController(controller);
  this->Estimation->SetController(controller);
  this->Normalization->SetController(controller);
}

//------------------------------------------------------------------------------
vtkMTimeType vtkPointsToSurfels::GetMTime()
{
  return std::max(this->Superclass::GetMTime(), this->Hierarchy->GetMTime());
}

//------------------------------------------------------------------------------
int vtkPointsToSurfels::RequestData(vtkInformation* vtkNotUsed(request),
  vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  vtkPointSet* input = vtkPointSet::GetData(inputVector[0]);
  vtkPolyData* output = vtkPolyData::GetData(outputVector);
  const std::string memory = this->CheckMemory(input);
  if (!memory.empty())
  {
    vtkErrorMacro(<< memory << " vtkPartitionedSurfelEstimation processes the cloud in parts.");
    return 0;
  }
  SensorSettings settings(this->Cleaning, this->Estimation);
  ScanSensor sensor;
  vtkSmartPointer<vtkPointSet> known = input;
  if (this->UseSensor)
  {
    SurfelSplatting::ControllerRanks ranks(this->Estimation->GetController());
    sensor = FindSensor(input, this->IsAlone() ? nullptr : &ranks);
    known = this->IsAlone() ? this->WithScanners(input, sensor) : known;
    settings.Use(sensor, this->SeesBacksOfDepthImages);
  }
  settings.SetNumberOfNeighbors(this->NumberOfNeighbors, sensor);
  Execution execution(this);
  const bool finished = execution.Run(known, output);
  if (!execution.Error.empty())
  {
    vtkErrorMacro(<< execution.Error);
    return 0;
  }
  if (!finished)
  {
    output->Initialize();
    return 1; // stopped by the user: empty output
  }
  if (!execution.Warnings.empty())
  {
    vtkWarningMacro(<< execution.Warnings);
  }
  this->UpdateProgress(1.0);
  return 1;
}

//------------------------------------------------------------------------------
bool vtkPointsToSurfels::FindViewpoint(vtkPointSet* points, double viewpoint[3])
{
  const ScanSensor sensor = FindSensor(points, nullptr);
  std::copy_n(sensor.Viewpoint, 3, viewpoint);
  return sensor.HasViewpoint;
}

//------------------------------------------------------------------------------
int vtkPointsToSurfels::FindColumns(vtkPointSet* points)
{
  return FindSensor(points, nullptr).Columns;
}

//------------------------------------------------------------------------------
bool vtkPointsToSurfels::IsAlone()
{
  vtkMultiProcessController* controller = this->Estimation->GetController();
  return !controller || controller->GetNumberOfProcesses() <= 1;
}

//------------------------------------------------------------------------------
std::string vtkPointsToSurfels::CheckMemory(vtkPointSet* input)
{
  return input && this->IsAlone() // several processes check together, in the estimation
    ? SurfelGeometry::CheckMemory(
        input->GetNumberOfPoints(), BytesPerPointOfBoth, AvailableMemory())
    : std::string();
}

//------------------------------------------------------------------------------
void vtkPointsToSurfels::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "BuildHierarchy: " << this->BuildHierarchy << "\n";
  os << indent << "Hierarchy:\n";
  this->Hierarchy->PrintSelf(os, indent.GetNextIndent());
}
