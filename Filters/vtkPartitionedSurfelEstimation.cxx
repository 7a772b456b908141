// SPDX-License-Identifier: BSD-3-Clause
#include "vtkPartitionedSurfelEstimation.h"

#include "Core/Surfels/SurfelArrays.h"
#include "Filters/Arrays/InputArrays.h"
#include "Filters/Arrays/PointColors.h"
#include "Filters/Arrays/ScanSensor.h"
#include "Filters/Arrays/SurfelOutput.h"
#include "Filters/Common/AvailableMemory.h"
#include "Filters/Common/StageProgress.h"
#include "Filters/Common/WorkerListener.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Partition/CloudRegions.h"
#include "Filters/Partition/PartitionedSurfels.h"
#include "Filters/SensorSettings.h"
#include "vtkPointCloudCleaning.h"
#include "vtkPointsToSurfels.h"
#include "vtkSurfelEstimation.h"
#include "vtkSurfelNormalization.h"

#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
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

/// Memory besides the input in bytes: for each point of the cloud (local position and output), and
/// for each point of the part that is processed (its copy and the filters' memory).
constexpr double BytesPerCloudPoint = 12.0 + 62.0, BytesPerPartPoint = BytesPerPointOfBoth + 30.0;

constexpr double CleaningShare = 0.15; ///< of the progress
}

/// One execution. Surfels are stored at the index of their input point; then gaps are closed.
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
    this->ToScanner = FindScanners(input);
    this->Colors =
      self->Estimation->GetInterpolateColors() ? FindColorsToInterpolate(input) : nullptr;
  }

  /// Returns false if stopped, or after an error, which is in Error.
  bool Run(const StageProgress& progress)
  {
    const vtkIdType count = this->Input->GetNumberOfPoints();
    this->Kept.assign(static_cast<size_t>(count), 0);
    this->Surfels = SurfelOutput(count);
    if (this->Colors)
    {
      this->Interpolated = NewColorsLike(this->Colors, count);
    }
    for (size_t i = 0; i < this->Parts.size(); ++i)
    {
      const double n = static_cast<double>(this->Parts.size());
      const auto done = static_cast<double>(i);
      if (!this->RunPart(this->Parts[i], progress.Part(done / n, (done + 1.0) / n)))
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
    PassPointData(this->Input, this->Kept, output);
    this->Surfels.Write(this->LocalOrigin, output);
    if (this->Colors)
    {
      ReplaceColors(this->Interpolated, output);
    }
  }

  std::string Error;

private:
  /// Processes a part, with a halo as wide as it needs to be.
  bool RunPart(const CloudPart& part, const StageProgress& progress)
  {
    const bool alone = this->Parts.size() == 1;
    double haloWidth = this->Spacing > 0.0
      ? HaloSpacings * this->Spacing
      : HaloSpacings * part.Diagonal / std::sqrt(static_cast<double>(part.Size));
    if (this->Self->Estimation->GetNeighborhoodMode() == vtkSurfelEstimation::RADIUS)
    {
      haloWidth = std::max(haloWidth, 2.0 * this->Self->Estimation->GetRadius());
    }
    double done = 0.0, next = 0.9; // wider halos, which few parts need, share the rest
    for (int widenings = 0;; ++widenings, haloWidth *= 2.0)
    {
      vtkSmartPointer<vtkPolyData> surfels;
      if (!this->Estimate(part.Region.Grown(haloWidth), alone, progress.Part(done, next), surfels))
      {
        return false;
      }
      done = next;
      next = 0.5 * (1.0 + next);
      const vtkIdType uncertain = this->Keep(part, haloWidth, surfels);
      if (uncertain <= ToleratedShare * static_cast<double>(part.Size) ||
        widenings == MaximumWidenings)
      {
        this->Self->NumberOfDoubtfulSurfels += uncertain;
        return true;
      }
    }
  }

  /// Those of some points, as floats.
  static vtkSmartPointer<vtkFloatArray> VectorsOf(
    vtkDataArray* vectors, const char* name, const std::vector<vtkIdType>& ids)
  {
    const auto count = static_cast<vtkIdType>(ids.size());
    vtkSmartPointer<vtkFloatArray> some = MakeArray<vtkFloatArray>(name, 3, count);
    for (vtkIdType i = 0; i < count; ++i)
    {
      double vector[3]; // they may be double
      vectors->GetTuple(ids[i], vector);
      some->SetTuple(i, vector);
    }
    return some;
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
    part->GetFieldData()->ShallowCopy(this->Input->GetFieldData());
    part->GetFieldData()->AddArray(origin);
    if (this->Normals)
    {
      part->GetPointData()->SetNormals(VectorsOf(this->Normals, "Normals", ids));
    }
    if (this->ToScanner)
    {
      part->GetPointData()->AddArray(VectorsOf(this->ToScanner, ToScannerArray, ids));
    }
    if (this->Colors)
    {
      const auto colors = NewColorsLike(this->Colors, count);
      for (vtkIdType i = 0; i < count; ++i)
      {
        colors->SetTuple(i, ids[i], this->Colors);
      }
      part->GetPointData()->SetScalars(colors);
    }
    return part;
  }

  bool Estimate(const CloudRegion& region, bool alone, const StageProgress& progress,
    vtkSmartPointer<vtkPolyData>& surfels)
  {
    vtkNew<vtkPointsToSurfels> worker;
    vtkSurfelEstimation* estimation = worker->GetEstimation();
    vtkSurfelNormalization* normalization = worker->GetNormalization();
    worker->CleanPointsOff(); // a part does not know what is usual in the cloud
    worker->UseSensorOff();   // the settings have it
    worker->BuildHierarchyOff();
    estimation->CopySettings(this->Self->Estimation);
    estimation->SetNormalsArrayName(nullptr); // parts have them as their active normals
    normalization->CopySettings(this->Self->Normalization);
    estimation->SetController(nullptr); // each process cuts its own points
    normalization->SetController(nullptr);
    estimation->IsPart = !alone;
    const WorkerListener listener(progress.Part(0.05, 1.0), worker);
    worker->SetInputData(this->Extract(region));
    worker->Update();
    this->Spacing = estimation->GetMedianSpacing();
    int& use = this->Self->Estimation->NormalsUse;
    use = std::max(use, estimation->GetNormalsUse());
    surfels = worker->GetOutput();
    return this->Finished(listener);
  }

  bool Finished(const WorkerListener& listener)
  {
    this->Error = listener.Error;
    return !listener.Stopped && listener.Error.empty();
  }

  /// Keeps the surfels of a part. Returns how many of them may have neighbours beyond the halo.
  vtkIdType Keep(const CloudPart& part, double haloWidth, vtkPolyData* surfels)
  {
    vtkPointData* data = surfels->GetPointData();
    const auto* ids = vtkIdTypeArray::SafeDownCast(data->GetArray(IdArray));
    auto* covariances = vtkFloatArray::SafeDownCast(data->GetArray(Arrays::Covariance));
    auto* areas = vtkFloatArray::SafeDownCast(data->GetArray(Arrays::AreaVector));
    auto* twoSided = vtkUnsignedCharArray::SafeDownCast(data->GetArray(Arrays::TwoSided));
    auto* overlaps = vtkUnsignedCharArray::SafeDownCast(data->GetArray(Arrays::Overlap));
    vtkDataArray* colors = this->Colors ? FindColors(surfels) : nullptr;
    double origin[3];
    ReadOrigin(surfels, origin);
    vtkIdType uncertain = 0;
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
      this->Surfels.Positions->SetTuple(to, p);
      std::copy_n(covariances->GetPointer(6 * i), 6, this->Surfels.Covariances->GetPointer(6 * to));
      const float* a = areas->GetPointer(3 * i);
      std::copy_n(a, 3, this->Surfels.AreaVectors->GetPointer(3 * to));
      this->Surfels.TwoSided->SetValue(to, twoSided->GetValue(i));
      this->Surfels.Overlaps->SetValue(to, overlaps->GetValue(i));
      if (colors)
      {
        this->Interpolated->SetTuple(to, i, colors);
      }
      const double area = std::hypot(a[0], a[1], a[2]);
      const double reach = haloWidth + part.Region.DistanceToSide(position);
      uncertain += MayReachBeyond(area, reach) ? 1 : 0;
    }
    return uncertain;
  }

  /// Moves the kept surfels to the front, in order. Returns their number.
  vtkIdType CloseGaps()
  {
    std::vector<vtkDataArray*> arrays = { this->Surfels.Positions, this->Surfels.Covariances,
      this->Surfels.AreaVectors, this->Surfels.TwoSided, this->Surfels.Overlaps };
    if (this->Interpolated)
    {
      arrays.push_back(this->Interpolated);
    }
    vtkIdType to = 0;
    for (vtkIdType from = 0; from < static_cast<vtkIdType>(this->Kept.size()); ++from)
    {
      if (!this->Kept[from])
      {
        continue;
      }
      for (vtkDataArray* array : arrays)
      {
        if (to < from)
        {
          array->SetTuple(to, from, array);
        }
      }
      ++to;
    }
    for (vtkDataArray* array : arrays)
    {
      array->SetNumberOfTuples(to);
    }
    return to;
  }

  vtkPartitionedSurfelEstimation* Self;
  vtkPointSet* Input;
  vtkDataArray *Normals, *ToScanner, *Colors; ///< null: none; colours stay as they are
  double Origin[3] = { 0.0, 0.0, 0.0 }, LocalOrigin[3] = { 0.0, 0.0, 0.0 };
  std::vector<float> Positions;
  std::vector<CloudPart> Parts;
  double Spacing = 0.0; ///< of the last part
  std::vector<char> Kept;
  SurfelOutput Surfels{ 0 };
  vtkSmartPointer<vtkUnsignedCharArray> Interpolated; ///< colours
};

//------------------------------------------------------------------------------
vtkPartitionedSurfelEstimation::vtkPartitionedSurfelEstimation()
{
  this->Cleaning->SetController(nullptr); // each process has a cloud of its own
}

vtkPartitionedSurfelEstimation::~vtkPartitionedSurfelEstimation() = default;

//------------------------------------------------------------------------------
int vtkPartitionedSurfelEstimation::RequestData(vtkInformation* vtkNotUsed(request),
  vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  vtkPointSet* input = vtkPointSet::GetData(inputVector[0]);
  vtkPolyData* output = vtkPolyData::GetData(outputVector);
  this->NumberOfParts = 0;
  this->NumberOfNonFinitePoints = this->NumberOfDuplicatePoints = 0;
  this->NumberOfDoubtfulSurfels = 0;
  this->Estimation->NormalsUse = vtkSurfelEstimation::NO_NORMALS;
  if (!input)
  {
    vtkErrorMacro("There is no input, or it is not a vtkPointSet: connect a data set with points.");
    return 0;
  }
  const vtkIdType count = input->GetNumberOfPoints();
  const double part = static_cast<double>(std::min(count, this->PointsPerPart));
  const std::string memory = CheckMemory(count,
    BytesPerCloudPoint + BytesPerPartPoint * part / std::max(1.0, static_cast<double>(count)),
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
  SensorSettings settings(this->Cleaning, this->Estimation);
  const vtkSmartPointer<vtkPointSet> fitting = WithFittingArrays(input, this);
  ScanSensor sensor = this->UseSensor ? FindSensor(fitting, nullptr) : ScanSensor();
  const vtkSmartPointer<vtkPointSet> known = this->WithScanners(fitting, sensor);
  input = known;
  settings.Use(sensor, false);
  settings.SetNumberOfNeighbors(this->NumberOfNeighbors, sensor);
  vtkNew<vtkPolyData> clean;
  if (this->CleanPoints)
  {
    std::string error;
    if (!this->Clean(input, clean, error))
    {
      return this->EndEarly(error);
    }
    input = clean;
  }
  Execution execution(this, input);
  if (!execution.Run(StageProgress(this, this->CleanPoints ? CleaningShare : 0.0, 1.0)))
  {
    return this->EndEarly(execution.Error);
  }
  execution.Write(output);
  this->WarnOfTroubles();
  this->UpdateProgress(1.0);
  return 1;
}

//------------------------------------------------------------------------------
void vtkPartitionedSurfelEstimation::WarnOfTroubles()
{
  std::string message = ListCounts({ DroppedPoints(this->NumberOfNonFinitePoints),
    { this->NumberOfDuplicatePoints, "duplicate", "dropped" } });
  const std::string problem = this->Estimation->GetNormalsProblem();
  if (!problem.empty())
  {
    message += (message.empty() ? "" : "; ") + problem + " (AS_GIVEN keeps them)";
  }
  if (!message.empty())
  {
    vtkWarningMacro(<< message << '.');
  }
}

//------------------------------------------------------------------------------
int vtkPartitionedSurfelEstimation::EndEarly(const std::string& error)
{
  if (error.empty())
  {
    return 1; // stopped by the user: empty output
  }
  vtkErrorMacro(<< error);
  return 0;
}

//------------------------------------------------------------------------------
bool vtkPartitionedSurfelEstimation::Clean(
  vtkPointSet* input, vtkPolyData* output, std::string& error)
{
  const WorkerListener listener(StageProgress(this, 0.0, CleaningShare), this->Cleaning);
  this->Cleaning->Execute(input, output);
  if (!listener.Warning.empty())
  {
    vtkWarningMacro(<< listener.Warning);
  }
  error = listener.Error;
  return error.empty() && !listener.Stopped;
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
}
