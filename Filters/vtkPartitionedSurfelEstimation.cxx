// SPDX-License-Identifier: BSD-3-Clause
#include "vtkPartitionedSurfelEstimation.h"

#include "Core/Surfels/SurfelArrays.h"
#include "Filters/Common/AvailableMemory.h"
#include "Filters/Common/InputArrays.h"
#include "Filters/Common/LocalCloud.h"
#include "Filters/Common/PointCells.h"
#include "Filters/Common/StageProgress.h"
#include "Filters/Partition/CloudRegions.h"
#include "Filters/Partition/PartitionedSurfels.h"
#include "vtkSurfelEstimation.h"
#include "vtkSurfelNormalization.h"

#include "vtkCallbackCommand.h"
#include "vtkDoubleArray.h"
#include "vtkExecutive.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkIdList.h"
#include "vtkIdTypeArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPointSet.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <cmath>
#include <string>

using namespace SurfelGeometry;
namespace Arrays = SurfelSplatting::Arrays;

vtkStandardNewMacro(vtkPartitionedSurfelEstimation);

namespace
{
const char* const IdArray = "PartitionedPointId";

/// Besides input and part: local positions and output.
constexpr double BytesPerPoint = 12.0 + 57.0, BytesPerPointOfPart = 320.0;

void CopySettings(vtkSurfelEstimation* from, vtkSurfelEstimation* to)
{
  to->SetNeighborhoodMode(from->GetNeighborhoodMode());
  to->SetNumberOfNeighbors(from->GetNumberOfNeighbors());
  to->SetRadius(from->GetRadius());
  to->SetMaximumNumberOfNeighbors(from->GetMaximumNumberOfNeighbors());
  to->SetKernelMode(from->GetKernelMode());
  to->SetKernelScale(from->GetKernelScale());
  to->SetCellBlur(from->GetCellBlur());
  to->SetMaximumAxisRatio(from->GetMaximumAxisRatio());
  to->SetKeepNormals(from->GetKeepNormals());
  to->SetNormalsArrayName(nullptr); // parts have them as their normals
  to->SetOrientationMode(from->GetOrientationMode());
  to->SetViewpoint(from->GetViewpoint());
  to->SetUseViewpoint(from->GetUseViewpoint());
  to->SetIsolationFactor(from->GetIsolationFactor());
}

void CopySettings(vtkSurfelNormalization* from, vtkSurfelNormalization* to)
{
  to->SetSamplesPerPoint(from->GetSamplesPerPoint());
  to->SetNumberOfIterations(from->GetNumberOfIterations());
  to->SetNumberOfNeighbors(from->GetNumberOfNeighbors());
  to->SetSupport(from->GetSupport());
  to->SetSampleRadius(from->GetSampleRadius());
  to->SetNormalOffset(from->GetNormalOffset());
  to->SetMinimumFactor(from->GetMinimumFactor());
  to->SetMaximumFactor(from->GetMaximumFactor());
}

/// Listens to a filter that works on a part: passes progress on, stops it, and keeps its messages,
/// which count border points twice.
class Listener
{
public:
  Listener(const StageProgress& monitor, vtkAlgorithm* worker)
    : Monitor(monitor)
    , Worker(worker)
  {
    this->Command->SetClientData(this);
    this->Command->SetCallback(&Listener::Hear);
    for (const unsigned long event :
      { vtkCommand::ProgressEvent, vtkCommand::WarningEvent, vtkCommand::ErrorEvent })
    {
      worker->AddObserver(event, this->Command);
    }
    worker->GetExecutive()->AddObserver(vtkCommand::ErrorEvent, this->Command);
  }
  ~Listener()
  {
    this->Worker->RemoveObserver(this->Command);
    this->Worker->GetExecutive()->RemoveObserver(this->Command);
  }
  Listener(const Listener&) = delete;
  void operator=(const Listener&) = delete;

  bool Stopped = false;
  std::string Error;

private:
  static void Hear(vtkObject*, unsigned long event, void* listener, void* data)
  {
    auto* self = static_cast<Listener*>(listener);
    if (event == vtkCommand::ErrorEvent)
    {
      // The first is the cause; the pipeline's own follows.
      const char* text = data ? static_cast<const char*>(data) : "unknown error";
      self->Error = self->Error.empty() ? text : self->Error;
    }
    else if (event == vtkCommand::ProgressEvent &&
      !self->Monitor.Step(*static_cast<const double*>(data)))
    {
      self->Stopped = true;
      self->Worker->SetAbortExecute(1);
    }
  }

  StageProgress Monitor;
  vtkAlgorithm* Worker;
  vtkNew<vtkCallbackCommand> Command;
};
}

/// One execution. Surfels are written where their points are in the input; then gaps are closed.
class vtkPartitionedSurfelEstimation::Execution
{
public:
  Execution(vtkPartitionedSurfelEstimation* self, vtkPointSet* input)
    : Self(self)
    , Input(input)
  {
    ReadOrigin(input, this->Origin);
    self->NumberOfNonFinitePoints =
      PlacePoints(input->GetPoints(), this->Origin, this->LocalOrigin, this->Positions);
    this->Parts = CutCloud(this->Positions, self->PointsPerPart);
    self->NumberOfParts = static_cast<int>(this->Parts.size());
    this->Normals = self->Estimation->GetKeepNormals()
      ? FindNormals(input, self->Estimation->GetNormalsArrayName())
      : nullptr;
  }

  /// False where stopped, or Error is set.
  bool Run()
  {
    const vtkIdType count = this->Input->GetNumberOfPoints();
    this->Kept.assign(static_cast<size_t>(count), 0);
    this->Surfels = MakeArray<vtkFloatArray>("Points", 3, count);
    this->Covariances = MakeArray<vtkFloatArray>(Arrays::Covariance, 6, count);
    this->Areas = MakeArray<vtkFloatArray>(Arrays::AreaVector, 3, count);
    this->TwoSided = MakeArray<vtkUnsignedCharArray>(Arrays::TwoSided, 1, count);
    for (size_t i = 0; i < this->Parts.size(); ++i)
    {
      const double n = static_cast<double>(this->Parts.size());
      const StageProgress monitor(
        this->Self, static_cast<double>(i) / n, (static_cast<double>(i) + 1.0) / n);
      if (!this->RunPart(this->Parts[i], monitor))
      {
        return false;
      }
    }
    return true;
  }

  void Write(vtkPolyData* output)
  {
    const vtkIdType count = this->CloseGaps();
    this->Self->NumberOfDuplicatePoints =
      this->Input->GetNumberOfPoints() - this->Self->NumberOfNonFinitePoints - count;
    vtkNew<vtkPoints> points;
    points->SetData(this->Surfels);
    output->SetPoints(points);
    output->SetVerts(MakePointCell(count));
    this->PassArrays(count, output);
    output->GetPointData()->AddArray(this->Covariances);
    output->GetPointData()->AddArray(this->Areas);
    output->GetPointData()->AddArray(this->TwoSided);
    auto origin = MakeArray<vtkDoubleArray>(Arrays::Origin, 3, 1);
    origin->SetTuple(0, this->LocalOrigin);
    output->GetFieldData()->AddArray(origin);
  }

  std::string Error;

private:
  /// With borders as wide as they have to be.
  bool RunPart(const CloudPart& part, const StageProgress& monitor)
  {
    const bool alone = this->Parts.size() == 1;
    double margin = this->Spacing > 0.0
      ? BorderSpacings * this->Spacing
      : BorderSpacings * part.Diagonal / std::sqrt(static_cast<double>(part.Size));
    if (this->Self->Estimation->GetNeighborhoodMode() == vtkSurfelEstimation::RADIUS)
    {
      margin = std::max(margin, 2.0 * this->Self->Estimation->GetRadius());
    }
    for (int widenings = 0;; ++widenings, margin *= 2.0)
    {
      vtkSmartPointer<vtkPolyData> surfels;
      if (!this->Estimate(part.Region.Grown(margin), alone, monitor, surfels))
      {
        return false;
      }
      const vtkIdType doubtful = this->Take(part, margin, surfels);
      if (doubtful <= LeastDoubt * static_cast<double>(part.Size) || widenings == MostWidenings)
      {
        this->Self->NumberOfDoubtfulSurfels += doubtful;
        return true;
      }
    }
  }

  vtkSmartPointer<vtkPolyData> Extract(const CloudRegion& region) const
  {
    const std::vector<vtkIdType> ids = FindInside(this->Positions, region);
    const auto count = static_cast<vtkIdType>(ids.size());
    auto part = vtkSmartPointer<vtkPolyData>::New();
    vtkNew<vtkPoints> points;
    points->SetDataTypeToFloat();
    points->SetNumberOfPoints(count);
    auto from = MakeArray<vtkIdTypeArray>(IdArray, 1, count);
    float* p = static_cast<vtkFloatArray*>(points->GetData())->GetPointer(0);
    for (vtkIdType i = 0; i < count; ++i)
    {
      from->SetValue(i, ids[i]);
      std::copy_n(this->Positions.data() + 3 * ids[i], 3, p + 3 * i);
    }
    part->SetPoints(points);
    part->GetPointData()->AddArray(from);
    auto origin = MakeArray<vtkDoubleArray>(Arrays::Origin, 3, 1);
    origin->SetTuple(0, this->LocalOrigin);
    part->GetFieldData()->AddArray(origin);
    if (this->Normals)
    {
      auto normals = MakeArray<vtkFloatArray>("Normals", 3, count);
      for (vtkIdType i = 0; i < count; ++i)
      {
        normals->SetTuple(i, ids[i], this->Normals);
      }
      part->GetPointData()->SetNormals(normals);
    }
    return part;
  }

  bool Estimate(const CloudRegion& region, bool alone, const StageProgress& monitor,
    vtkSmartPointer<vtkPolyData>& surfels)
  {
    vtkNew<vtkSurfelEstimation> estimation;
    vtkNew<vtkSurfelNormalization> normalization;
    CopySettings(this->Self->Estimation, estimation);
    CopySettings(this->Self->Normalization, normalization);
    estimation->SetController(nullptr); // each process cuts its own points
    normalization->SetController(nullptr);
    if (!alone && estimation->GetOrientationMode() == vtkSurfelEstimation::CONSISTENT)
    {
      estimation->SetOrientationMode(
        this->Normals ? vtkSurfelEstimation::AS_GIVEN : vtkSurfelEstimation::TWO_SIDED);
    }
    {
      const Listener listener(monitor.Part(0.05, 0.6), estimation);
      estimation->SetInputData(this->Extract(region));
      estimation->Update();
      if (!this->Finished(listener))
      {
        return false;
      }
    }
    this->Spacing = estimation->GetMedianSpacing();
    surfels = estimation->GetOutput();
    estimation->SetInputData(nullptr); // the memory of the points
    const Listener listener(monitor.Part(0.6, 1.0), normalization);
    normalization->SetInputData(surfels);
    normalization->Update();
    surfels = normalization->GetOutput();
    return this->Finished(listener);
  }

  bool Finished(const Listener& listener)
  {
    this->Error = listener.Error;
    return !listener.Stopped && listener.Error.empty();
  }

  /// Keeps what is inside; returns the number of surfels whose neighbours may be beyond the border.
  vtkIdType Take(const CloudPart& part, double margin, vtkPolyData* surfels)
  {
    vtkPointData* data = surfels->GetPointData();
    const auto* ids = vtkIdTypeArray::SafeDownCast(data->GetArray(IdArray));
    auto* covariances = vtkFloatArray::SafeDownCast(data->GetArray(Arrays::Covariance));
    auto* areas = vtkFloatArray::SafeDownCast(data->GetArray(Arrays::AreaVector));
    auto* twoSided = vtkUnsignedCharArray::SafeDownCast(data->GetArray(Arrays::TwoSided));
    double origin[3];
    ReadOrigin(surfels, origin);
    vtkIdType doubtful = 0;
    for (vtkIdType i = 0; i < surfels->GetNumberOfPoints(); ++i)
    {
      const vtkIdType to = ids->GetValue(i);
      const float* position = this->Positions.data() + 3 * to;
      if (!part.Region.Contains(position))
      {
        continue;
      }
      this->Kept[to] = 1;
      double p[3];
      surfels->GetPoint(i, p);
      for (int c = 0; c < 3; ++c)
      {
        p[c] += origin[c] - this->LocalOrigin[c];
      }
      this->Surfels->SetTuple(to, p);
      std::copy_n(covariances->GetPointer(6 * i), 6, this->Covariances->GetPointer(6 * to));
      const float* a = areas->GetPointer(3 * i);
      std::copy_n(a, 3, this->Areas->GetPointer(3 * to));
      this->TwoSided->SetValue(to, twoSided->GetValue(i));
      const double area = std::hypot(a[0], a[1], a[2]);
      doubtful += IsDoubtful(area, margin + part.Region.DistanceToSide(position)) ? 1 : 0;
    }
    return doubtful;
  }

  /// Moves what is kept to the front, in order; returns its number.
  vtkIdType CloseGaps()
  {
    vtkIdType to = 0;
    for (vtkIdType from = 0; from < static_cast<vtkIdType>(this->Kept.size()); ++from)
    {
      if (!this->Kept[from])
      {
        continue;
      }
      if (to < from)
      {
        std::copy_n(this->Surfels->GetPointer(3 * from), 3, this->Surfels->GetPointer(3 * to));
        std::copy_n(
          this->Covariances->GetPointer(6 * from), 6, this->Covariances->GetPointer(6 * to));
        std::copy_n(this->Areas->GetPointer(3 * from), 3, this->Areas->GetPointer(3 * to));
        this->TwoSided->SetValue(to, this->TwoSided->GetValue(from));
      }
      ++to;
    }
    for (vtkDataArray* array : std::initializer_list<vtkDataArray*>{
           this->Surfels, this->Covariances, this->Areas, this->TwoSided })
    {
      array->SetNumberOfTuples(to);
    }
    return to;
  }

  void PassArrays(vtkIdType count, vtkPolyData* output) const
  {
    output->GetFieldData()->PassData(this->Input->GetFieldData());
    if (count == this->Input->GetNumberOfPoints())
    {
      output->GetPointData()->PassData(this->Input->GetPointData());
      return;
    }
    vtkNew<vtkIdList> from;
    vtkNew<vtkIdList> to;
    from->SetNumberOfIds(count);
    to->SetNumberOfIds(count);
    vtkIdType next = 0;
    for (size_t i = 0; i < this->Kept.size(); ++i)
    {
      if (this->Kept[i])
      {
        from->SetId(next, static_cast<vtkIdType>(i));
        to->SetId(next, next);
        ++next;
      }
    }
    output->GetPointData()->CopyAllOn();
    output->GetPointData()->CopyAllocate(this->Input->GetPointData(), count);
    output->GetPointData()->CopyData(this->Input->GetPointData(), from, to);
  }

  vtkPartitionedSurfelEstimation* Self;
  vtkPointSet* Input;
  vtkDataArray* Normals;
  double Origin[3] = { 0.0, 0.0, 0.0 }, LocalOrigin[3] = { 0.0, 0.0, 0.0 };
  std::vector<float> Positions;
  std::vector<CloudPart> Parts;
  double Spacing = 0.0; ///< of the last part
  std::vector<char> Kept;
  vtkSmartPointer<vtkFloatArray> Surfels, Covariances, Areas;
  vtkSmartPointer<vtkUnsignedCharArray> TwoSided;
};

//------------------------------------------------------------------------------
vtkPartitionedSurfelEstimation::vtkPartitionedSurfelEstimation() = default;
vtkPartitionedSurfelEstimation::~vtkPartitionedSurfelEstimation() = default;

//------------------------------------------------------------------------------
int vtkPartitionedSurfelEstimation::FillInputPortInformation(
  int vtkNotUsed(port), vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPointSet");
  return 1;
}

//------------------------------------------------------------------------------
vtkMTimeType vtkPartitionedSurfelEstimation::GetMTime()
{
  return std::max({ this->Superclass::GetMTime(), this->Estimation->GetMTime(),
    this->Normalization->GetMTime() });
}

//------------------------------------------------------------------------------
int vtkPartitionedSurfelEstimation::RequestData(vtkInformation* vtkNotUsed(request),
  vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  vtkPointSet* input = vtkPointSet::GetData(inputVector[0]);
  vtkPolyData* output = vtkPolyData::GetData(outputVector);
  this->NumberOfParts = 0;
  this->NumberOfNonFinitePoints = this->NumberOfDuplicatePoints = 0;
  this->NumberOfDoubtfulSurfels = 0;
  if (!input)
  {
    vtkErrorMacro("No input, or an input that is no vtkPointSet: connect one with points.");
    return 0;
  }
  const vtkIdType count = input->GetNumberOfPoints();
  const double part = static_cast<double>(std::min(count, this->PointsPerPart));
  const std::string memory = CheckMemory(count,
    BytesPerPoint + BytesPerPointOfPart * part / std::max(1.0, static_cast<double>(count)),
    AvailableMemory());
  if (!memory.empty())
  {
    vtkErrorMacro(<< memory);
    return 0;
  }
  if (count == 0)
  {
    return 1;
  }
  Execution execution(this, input);
  if (!execution.Run())
  {
    if (!execution.Error.empty())
    {
      vtkErrorMacro(<< execution.Error);
      return 0;
    }
    return 1; // stopped by the user: empty output
  }
  execution.Write(output);
  const std::string message = ListCounts(
    { { this->NumberOfNonFinitePoints, "points with NaN or infinite coordinates dropped" },
      { this->NumberOfDuplicatePoints, "duplicates dropped" } });
  if (!message.empty())
  {
    vtkWarningMacro(<< message << '.');
  }
  this->UpdateProgress(1.0);
  return 1;
}

//------------------------------------------------------------------------------
void vtkPartitionedSurfelEstimation::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "PointsPerPart: " << this->PointsPerPart << "\n";
  os << indent << "NumberOfParts: " << this->NumberOfParts << "\n";
  os << indent << "NumberOfNonFinitePoints: " << this->NumberOfNonFinitePoints << "\n";
  os << indent << "NumberOfDuplicatePoints: " << this->NumberOfDuplicatePoints << "\n";
  os << indent << "NumberOfDoubtfulSurfels: " << this->NumberOfDoubtfulSurfels << "\n";
  os << indent << "Estimation:\n";
  this->Estimation->PrintSelf(os, indent.GetNextIndent());
  os << indent << "Normalization:\n";
  this->Normalization->PrintSelf(os, indent.GetNextIndent());
}
