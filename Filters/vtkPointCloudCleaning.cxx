// SPDX-License-Identifier: BSD-3-Clause
#include "vtkPointCloudCleaning.h"

#include "Filters/Cleaning/DepthSteps.h"
#include "Filters/Cleaning/Smoothing.h"
#include "Filters/Cleaning/StrayPoints.h"
#include "Filters/Common/AvailableMemory.h"
#include "Filters/Common/InputArrays.h"
#include "Filters/Common/LocalCloud.h"
#include "Filters/Common/NeighborSearch.h"
#include "Filters/Common/PointCells.h"
#include "Filters/Common/SurfelOutput.h"

#include "vtkDataArray.h"
#include "vtkFloatArray.h"
#include "vtkIdList.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPointSet.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

using namespace SurfelGeometry;

vtkStandardNewMacro(vtkPointCloudCleaning);

namespace
{
/// As the header says.
constexpr double CleaningBytesPerPoint = 100.0;

/// Writes the points with kept[i] == 1, and their point data.
void WritePoints(vtkPointSet* input, const std::vector<char>& kept, vtkPolyData* output)
{
  PassPointData(input, kept, output);
  const vtkIdType count = static_cast<vtkIdType>(std::count(kept.begin(), kept.end(), char{ 1 }));
  if (count == input->GetNumberOfPoints() && input->GetPoints())
  {
    output->SetPoints(input->GetPoints());
  }
  else
  {
    vtkNew<vtkIdList> ids;
    ids->SetNumberOfIds(count);
    for (vtkIdType i = 0, k = 0; i < input->GetNumberOfPoints(); ++i)
    {
      if (kept[i])
      {
        ids->SetId(k++, i);
      }
    }
    vtkNew<vtkPoints> points;
    if (input->GetPoints())
    {
      points->SetDataType(input->GetPoints()->GetDataType());
      input->GetPoints()->GetPoints(ids, points);
    }
    output->SetPoints(points);
  }
  output->SetVerts(MakePointCell(count));
}

/// Removes the points i with dropped[i] == 1.
void DropPoints(const std::vector<unsigned char>& dropped, LocalCloud& cloud)
{
  size_t kept = 0;
  for (size_t i = 0; i < dropped.size(); ++i)
  {
    if (!dropped[i])
    {
      cloud.InputIds[kept] = cloud.InputIds[i];
      std::copy_n(cloud.Positions.begin() + 3 * i, 3, cloud.Positions.begin() + 3 * kept);
      ++kept;
    }
  }
  cloud.InputIds.resize(kept);
  cloud.Positions.resize(3 * kept);
}

/// [3n] in the order of the cloud; empty if the scalars are not colours.
std::vector<unsigned char> ColorsOf(vtkUnsignedCharArray* scalars, const LocalCloud& cloud)
{
  std::vector<unsigned char> colors;
  if (scalars && scalars->GetNumberOfComponents() >= 3)
  {
    colors.reserve(3 * cloud.InputIds.size());
    for (const vtkIdType id : cloud.InputIds)
    {
      const unsigned char* rgb = scalars->GetPointer(id * scalars->GetNumberOfComponents());
      colors.insert(colors.end(), rgb, rgb + 3);
    }
  }
  return colors;
}
}

/// One execution: which points of the input are kept, and which are stray.
class vtkPointCloudCleaning::Execution
{
public:
  explicit Execution(vtkPointCloudCleaning* self)
    : Self(self)
  {
  }

  /// Returns false if stopped.
  bool Run(vtkPointSet* input)
  {
    this->Kept.assign(input->GetNumberOfPoints(), 0);
    this->Strayed.assign(input->GetNumberOfPoints(), 0);
    if (!input->GetPoints())
    {
      return true;
    }
    double origin[3] = { 0.0, 0.0, 0.0 };
    ReadOrigin(input, origin);
    LocalCloud cloud;
    GatherCloud(input->GetPoints(), origin, cloud);
    this->Scalars = vtkUnsignedCharArray::SafeDownCast(input->GetPointData()->GetScalars());
    this->Self->NumberOfNonFinitePoints = cloud.NonFinite;
    this->Self->NumberOfDuplicatePoints = cloud.Duplicates;
    const StageProgress progress(this->Self, 0.0, 1.0);
    return progress.Step(0.1) && this->SmoothDepths(input, cloud, progress.Part(0.1, 0.2)) &&
      this->Clean(cloud, progress.Part(0.2, 0.9));
  }

  /// Moves the points of the output, which are the input's.
  void MovePoints(vtkPolyData* output) const
  {
    vtkNew<vtkPoints> points;
    points->SetDataType(output->GetPoints()->GetDataType());
    points->DeepCopy(output->GetPoints());
    auto array = MakeArray<vtkFloatArray>("CleaningShift", 3, points->GetNumberOfPoints());
    vtkIdType next = 0;
    for (size_t i = 0; i < this->Kept.size(); ++i)
    {
      if (this->Kept[i])
      {
        const Vector3 shift = this->Shifts[i];
        double p[3];
        points->GetPoint(next, p);
        points->SetPoint(next, p[0] + shift[0], p[1] + shift[1], p[2] + shift[2]);
        array->SetTuple(next++, shift.data());
      }
    }
    output->SetPoints(points);
    if (this->Self->GenerateShifts)
    {
      output->GetPointData()->AddArray(array);
    }
  }

  bool AreMoved() const { return !this->Shifts.empty(); }

  std::vector<char> Kept, Strayed; // [input points] 1: yes

private:
  /// Returns false if stopped.
  bool SmoothDepths(vtkPointSet* input, LocalCloud& cloud, const StageProgress& progress)
  {
    if (!this->Self->Smoothing || this->Self->Columns == 0)
    {
      return true;
    }
    const double* v = this->Self->Viewpoint;
    const DepthImage image{ input->GetPoints(), this->Self->Columns, { v[0], v[1], v[2] } };
    const bool finished = SmoothDepthSteps(image, progress, this->Shifts);
    for (size_t i = 0; finished && !this->Shifts.empty() && i < cloud.InputIds.size(); ++i)
    {
      const Float3& shift = this->Shifts[cloud.InputIds[i]];
      cloud.Positions[3 * i] += shift.X;
      cloud.Positions[3 * i + 1] += shift.Y;
      cloud.Positions[3 * i + 2] += shift.Z;
    }
    return finished;
  }

  /// Returns false if stopped.
  bool Clean(LocalCloud& cloud, const StageProgress& progress)
  {
    auto tree = std::make_unique<NeighborSearch>(cloud.Positions.data(), cloud.Size());
    std::vector<unsigned char> stray(cloud.Size(), 0);
    if (this->Self->RemoveStrayPoints &&
      !FindStrayPoints(cloud, *tree, progress.Part(0.0, 0.3), stray))
    {
      return false;
    }
    for (int i = 0; i < cloud.Size(); ++i)
    {
      (stray[i] ? this->Strayed : this->Kept)[cloud.InputIds[i]] = 1;
      this->Self->NumberOfStrayPoints += stray[i];
    }
    if (!this->Self->Smoothing)
    {
      return true;
    }
    if (this->Self->NumberOfStrayPoints > 0)
    {
      DropPoints(stray, cloud);
      tree = std::make_unique<NeighborSearch>(cloud.Positions.data(), cloud.Size());
    }
    std::vector<Float3> shifts;
    if (!SmoothNoise(cloud, *tree, ColorsOf(this->Scalars, cloud), progress.Part(0.4, 1.0), shifts))
    {
      return false;
    }
    this->Shifts.resize(shifts.empty() ? this->Shifts.size() : this->Kept.size());
    for (size_t i = 0; i < shifts.size(); ++i)
    {
      Float3& shift = this->Shifts[cloud.InputIds[i]];
      shift = Vector3(shift) + Vector3(shifts[i]);
    }
    for (size_t i = 0; i < this->Shifts.size(); ++i)
    {
      const bool isMoved = this->Kept[i] && SingleDot(this->Shifts[i], this->Shifts[i]) > 0.0f;
      this->Self->NumberOfMovedPoints += isMoved ? 1 : 0;
    }
    return true;
  }

  vtkPointCloudCleaning* Self;
  vtkUnsignedCharArray* Scalars = nullptr;
  std::vector<Float3> Shifts; // [input points] or empty, world units
};

//------------------------------------------------------------------------------
vtkPointCloudCleaning::vtkPointCloudCleaning()
{
  this->SetNumberOfOutputPorts(2);
}

vtkPointCloudCleaning::~vtkPointCloudCleaning() = default;

//------------------------------------------------------------------------------
int vtkPointCloudCleaning::FillInputPortInformation(int vtkNotUsed(port), vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPointSet");
  return 1;
}

//------------------------------------------------------------------------------
int vtkPointCloudCleaning::RequestData(vtkInformation* vtkNotUsed(request),
  vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  return this->Execute(vtkPointSet::GetData(inputVector[0]), vtkPolyData::GetData(outputVector, 0),
    this->GenerateStrayPoints ? vtkPolyData::GetData(outputVector, 1) : nullptr);
}

//------------------------------------------------------------------------------
int vtkPointCloudCleaning::Execute(
  vtkPointSet* input, vtkPolyData* output, vtkPolyData* strayPoints)
{
  this->NumberOfNonFinitePoints = 0;
  this->NumberOfDuplicatePoints = 0;
  this->NumberOfStrayPoints = 0;
  this->NumberOfMovedPoints = 0;
  if (!this->CheckInput(input))
  {
    return 0;
  }
  Execution execution(this);
  if (!execution.Run(input))
  {
    return 1; // stopped by the user: empty output
  }
  WritePoints(input, execution.Kept, output);
  if (execution.AreMoved())
  {
    execution.MovePoints(output);
  }
  if (strayPoints)
  {
    WritePoints(input, execution.Strayed, strayPoints);
  }
  this->WarnOfTroubles();
  this->UpdateProgress(1.0);
  return 1;
}

//------------------------------------------------------------------------------
bool vtkPointCloudCleaning::CheckInput(vtkPointSet* input)
{
  if (!input)
  {
    vtkErrorMacro("There is no input, or it is not a vtkPointSet: connect a data set with points.");
    return false;
  }
  std::string problem = CheckNumberOfPoints(input->GetNumberOfPoints());
  if (problem.empty())
  {
    problem = CheckMemory(input->GetNumberOfPoints(), CleaningBytesPerPoint, AvailableMemory());
  }
  if (problem.empty() && this->Columns > 0 && input->GetNumberOfPoints() % this->Columns != 0)
  {
    problem = "Columns is " + std::to_string(this->Columns) + ", but the input has " +
      std::to_string(input->GetNumberOfPoints()) +
      " points, which are no whole rows: set the columns of the depth image, or 0.";
  }
  if (!problem.empty())
  {
    vtkErrorMacro(<< problem);
    return false;
  }
  return true;
}

//------------------------------------------------------------------------------
void vtkPointCloudCleaning::WarnOfTroubles()
{
  const std::string message = ListCounts(
    { { this->NumberOfNonFinitePoints, "points with NaN or infinite coordinates dropped" },
      { this->NumberOfDuplicatePoints, "duplicates dropped" },
      { this->NumberOfStrayPoints, "stray points removed" },
      { this->NumberOfMovedPoints, "noisy points moved to a smooth surface" } });
  if (!message.empty())
  {
    vtkWarningMacro(<< message << '.');
  }
}

//------------------------------------------------------------------------------
void vtkPointCloudCleaning::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "RemoveStrayPoints: " << this->RemoveStrayPoints << "\n";
  os << indent << "Smoothing: " << this->Smoothing << "\n";
  os << indent << "Columns: " << this->Columns << "\n";
  os << indent << "Viewpoint: " << this->Viewpoint[0] << " " << this->Viewpoint[1] << " "
     << this->Viewpoint[2] << "\n";
  os << indent << "GenerateShifts: " << this->GenerateShifts << "\n";
  os << indent << "GenerateStrayPoints: " << this->GenerateStrayPoints << "\n";
  os << indent << "NumberOfNonFinitePoints: " << this->NumberOfNonFinitePoints << "\n";
  os << indent << "NumberOfDuplicatePoints: " << this->NumberOfDuplicatePoints << "\n";
  os << indent << "NumberOfStrayPoints: " << this->NumberOfStrayPoints << "\n";
  os << indent << "NumberOfMovedPoints: " << this->NumberOfMovedPoints << "\n";
}
