// SPDX-License-Identifier: BSD-3-Clause
#include "vtkPointCloudCleaning.h"

#include "Filters/Arrays/InputArrays.h"
#include "Filters/Arrays/PointCells.h"
#include "Filters/Arrays/SurfelOutput.h"
#include "Filters/CleaningExecution.h"
#include "Filters/Common/AvailableMemory.h"
#include "Parallel/ControllerRanks.h"

#include "vtkIdList.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMultiProcessController.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointSet.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"

#include <algorithm>
#include <new>
#include <string>
#include <vector>

using namespace SurfelGeometry;

vtkStandardNewMacro(vtkPointCloudCleaning);

namespace
{
/// As the header says.
constexpr double CleaningBytesPerPoint = 140.0;

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
}

//------------------------------------------------------------------------------
vtkPointCloudCleaning::vtkPointCloudCleaning()
  : Controller(vtkMultiProcessController::GetGlobalController())
{
  this->SetNumberOfOutputPorts(2);
}

vtkPointCloudCleaning::~vtkPointCloudCleaning() = default;

//------------------------------------------------------------------------------
vtkCxxSetSmartPointerMacro(vtkPointCloudCleaning, Controller, vtkMultiProcessController);

//------------------------------------------------------------------------------
vtkMultiProcessController* vtkPointCloudCleaning::GetController()
{
  return this->Controller;
}

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
  this->Take(CleaningCounts());
  const vtkSmartPointer<vtkPointSet> fitting = WithFittingArrays(input, this);
  try
  {
    return this->Clean(fitting, output, strayPoints);
  }
  catch (const std::bad_alloc&)
  {
    this->Take(CleaningCounts());
    output->Initialize();
    if (strayPoints)
    {
      strayPoints->Initialize();
    }
    vtkErrorMacro(<< LackOfMemory(input->GetNumberOfPoints()));
    return 0;
  }
}

//------------------------------------------------------------------------------
int vtkPointCloudCleaning::Clean(vtkPointSet* input, vtkPolyData* output, vtkPolyData* strayPoints)
{
  const double* v = this->Viewpoint;
  CleaningExecution execution(
    { this->RemoveStrayPoints != 0, this->Smoothing != 0, this->Columns, this->UseViewpoint != 0,
      { v[0], v[1], v[2] }, this->GenerateShifts != 0, this->Searched != nullptr },
    this);
  const auto write = [&] { this->Write(execution, input, output, strayPoints); };
  if (this->Controller && this->Controller->GetNumberOfProcesses() > 1)
  {
    SurfelSplatting::ControllerRanks ranks(this->Controller);
    if (!this->CheckInputs(ranks, input))
    {
      return 0;
    }
    if (!execution.RunDistributed(ranks, input))
    {
      return 1; // stopped by the user: empty output
    }
    ranks.DoOwn(write);
  }
  else
  {
    if (!this->CheckInput(input))
    {
      return 0;
    }
    if (!execution.Run(input))
    {
      return 1; // as above
    }
    write();
  }
  this->WarnOfTroubles();
  this->UpdateProgress(1.0);
  return 1;
}

//------------------------------------------------------------------------------
void vtkPointCloudCleaning::Write(
  CleaningExecution& execution, vtkPointSet* input, vtkPolyData* output, vtkPolyData* strayPoints)
{
  this->Take(execution.Count(input));
  WritePoints(input, execution.Kept, output);
  if (execution.AreMoved())
  {
    execution.MovePoints(output);
  }
  if (strayPoints)
  {
    WritePoints(input, execution.Strayed, strayPoints);
  }
  if (this->Searched)
  {
    execution.HandOver(*this->Searched);
  }
}

//------------------------------------------------------------------------------
void vtkPointCloudCleaning::Take(const CleaningCounts& counts)
{
  this->NumberOfNonFinitePoints = counts.NonFinite;
  this->NumberOfDuplicatePoints = counts.Duplicate;
  this->NumberOfStrayPoints = counts.Stray;
  this->NumberOfTwinPoints = counts.Twin;
  this->NumberOfJoinedPoints = counts.Joined;
  this->NumberOfMovedPoints = counts.Moved;
  this->NumberOfRecoloredPoints = counts.Recolored;
  this->NumberOfThickPoints = counts.Thick;
}

//------------------------------------------------------------------------------
bool vtkPointCloudCleaning::CheckInputs(SurfelSplatting::Ranks& ranks, vtkPointSet* input)
{
  bool isReady = false;
  ranks.DoOwn([&] { isReady = this->CheckInput(input); });
  const bool areReady = ranks.All(isReady);
  if (isReady && !areReady)
  {
    vtkErrorMacro("No points were cleaned: another process reported an error.");
  }
  return areReady;
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
  const std::string message = ListCounts({ DroppedPoints(this->NumberOfNonFinitePoints),
    { this->NumberOfDuplicatePoints, "duplicate", "dropped" },
    { this->NumberOfStrayPoints, "stray point", "removed" },
    { this->NumberOfTwinPoints, "point", "of a second scan dropped where the first has points" },
    { this->NumberOfJoinedPoints, "point", "of a second scan moved to the first" },
    { this->NumberOfMovedPoints, "noisy point", "moved to a smooth surface" },
    { this->NumberOfRecoloredPoints, "colour",
      "of noisy points chosen by a vote of their neighbours" } });
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
  os << indent << "UseViewpoint: " << this->UseViewpoint << "\n";
  os << indent << "Viewpoint: " << this->Viewpoint[0] << " " << this->Viewpoint[1] << " "
     << this->Viewpoint[2] << "\n";
  os << indent << "GenerateShifts: " << this->GenerateShifts << "\n";
  os << indent << "GenerateStrayPoints: " << this->GenerateStrayPoints << "\n";
  os << indent << "Controller: " << this->Controller.Get() << "\n";
  os << indent << "NumberOfNonFinitePoints: " << this->NumberOfNonFinitePoints << "\n";
  os << indent << "NumberOfDuplicatePoints: " << this->NumberOfDuplicatePoints << "\n";
  os << indent << "NumberOfStrayPoints: " << this->NumberOfStrayPoints << "\n";
  os << indent << "NumberOfTwinPoints: " << this->NumberOfTwinPoints << "\n";
  os << indent << "NumberOfJoinedPoints: " << this->NumberOfJoinedPoints << "\n";
  os << indent << "NumberOfMovedPoints: " << this->NumberOfMovedPoints << "\n";
  os << indent << "NumberOfRecoloredPoints: " << this->NumberOfRecoloredPoints << "\n";
  os << indent << "NumberOfThickPoints: " << this->NumberOfThickPoints << "\n";
}
