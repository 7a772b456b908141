// SPDX-License-Identifier: BSD-3-Clause
#include "vtkPointCloudCleaning.h"

#include "Filters/Cleaning/StrayPoints.h"
#include "Filters/Common/AvailableMemory.h"
#include "Filters/Common/InputArrays.h"
#include "Filters/Common/LocalCloud.h"
#include "Filters/Common/NeighborSearch.h"
#include "Filters/Common/PointCells.h"
#include "Filters/Common/SurfelOutput.h"

#include "vtkDataArray.h"
#include "vtkIdList.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointSet.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"

#include <algorithm>
#include <string>
#include <vector>

using namespace SurfelGeometry;

vtkStandardNewMacro(vtkPointCloudCleaning);

namespace
{
/// As the header says.
constexpr double CleaningBytesPerPoint = 80.0;

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
    ids->Allocate(count);
    for (vtkIdType i = 0; i < input->GetNumberOfPoints(); ++i)
    {
      if (kept[i])
      {
        ids->InsertNextId(i);
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
    this->Self->NumberOfNonFinitePoints = cloud.NonFinite;
    this->Self->NumberOfDuplicatePoints = cloud.Duplicates;
    const StageProgress progress(this->Self, 0.0, 1.0);
    std::vector<unsigned char> stray(cloud.Size(), 0);
    if (this->Self->RemoveStrayPoints)
    {
      const NeighborSearch tree(cloud.Positions.data(), cloud.Size());
      if (!progress.Step(0.2) || !FindStrayPoints(cloud, tree, progress.Part(0.2, 0.9), stray))
      {
        return false;
      }
    }
    for (int i = 0; i < cloud.Size(); ++i)
    {
      (stray[i] ? this->Strayed : this->Kept)[cloud.InputIds[i]] = 1;
      this->Self->NumberOfStrayPoints += stray[i];
    }
    return true;
  }

  vtkPointCloudCleaning* Self;
  std::vector<char> Kept, Strayed; // [input points] 1: yes
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
  vtkPointSet* input = vtkPointSet::GetData(inputVector[0]);
  this->NumberOfNonFinitePoints = 0;
  this->NumberOfDuplicatePoints = 0;
  this->NumberOfStrayPoints = 0;
  if (!this->CheckInput(input))
  {
    return 0;
  }
  Execution execution(this);
  if (!execution.Run(input))
  {
    return 1; // stopped by the user: empty output
  }
  WritePoints(input, execution.Kept, vtkPolyData::GetData(outputVector, 0));
  if (this->GenerateStrayPoints)
  {
    WritePoints(input, execution.Strayed, vtkPolyData::GetData(outputVector, 1));
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
      { this->NumberOfStrayPoints, "stray points removed" } });
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
  os << indent << "GenerateStrayPoints: " << this->GenerateStrayPoints << "\n";
  os << indent << "NumberOfNonFinitePoints: " << this->NumberOfNonFinitePoints << "\n";
  os << indent << "NumberOfDuplicatePoints: " << this->NumberOfDuplicatePoints << "\n";
  os << indent << "NumberOfStrayPoints: " << this->NumberOfStrayPoints << "\n";
}
