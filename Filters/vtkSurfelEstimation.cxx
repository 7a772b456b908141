// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelEstimation.h"

#include "Filters/Arrays/InputArrays.h"
#include "Filters/Arrays/PointColors.h"
#include "Filters/Common/AvailableMemory.h"
#include "Filters/EstimationExecution.h"
#include "Filters/Partition/PartitionedSurfels.h"
#include "Filters/Partition/SharedOrientation.h"
#include "Parallel/ControllerRanks.h"

#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMultiProcessController.h"
#include "vtkObjectFactory.h"
#include "vtkPointSet.h"
#include "vtkPolyData.h"

#include <algorithm>
#include <new>
#include <string>

using namespace SurfelGeometry;

vtkStandardNewMacro(vtkSurfelEstimation);

//------------------------------------------------------------------------------
vtkSurfelEstimation::vtkSurfelEstimation()
  : Controller(vtkMultiProcessController::GetGlobalController())
{
}

vtkSurfelEstimation::~vtkSurfelEstimation()
{
  this->SetNormalsArrayName(nullptr);
}

//------------------------------------------------------------------------------
vtkCxxSetSmartPointerMacro(vtkSurfelEstimation, Controller, vtkMultiProcessController);

//------------------------------------------------------------------------------
vtkMultiProcessController* vtkSurfelEstimation::GetController()
{
  return this->Controller;
}

//------------------------------------------------------------------------------
int vtkSurfelEstimation::FillInputPortInformation(int vtkNotUsed(port), vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPointSet");
  return 1;
}

//------------------------------------------------------------------------------
int vtkSurfelEstimation::RequestData(vtkInformation* vtkNotUsed(request),
  vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  return this->Execute(vtkPointSet::GetData(inputVector[0]), vtkPolyData::GetData(outputVector));
}

//------------------------------------------------------------------------------
int vtkSurfelEstimation::Execute(vtkPointSet* input, vtkPolyData* output)
{
  this->Take(EstimationCounts());
  const vtkSmartPointer<vtkPointSet> fitting = WithFittingArrays(input, this);
  try
  {
    if (this->Controller && this->Controller->GetNumberOfProcesses() > 1)
    {
      SurfelSplatting::ControllerRanks ranks(this->Controller);
      return this->RequestDistributed(ranks, fitting, output);
    }
    return this->ExecuteAlone(fitting, output);
  }
  catch (const std::bad_alloc&)
  {
    this->Take(EstimationCounts());
    output->Initialize();
    vtkErrorMacro(<< LackOfMemory(input->GetNumberOfPoints()));
    return 0;
  }
}

//------------------------------------------------------------------------------
int vtkSurfelEstimation::ExecuteAlone(vtkPointSet* input, vtkPolyData* output)
{
  if (!this->CheckSettings(input))
  {
    return 0;
  }
  const std::string memory =
    CheckMemory(input->GetNumberOfPoints(), BytesPerPoint, AvailableMemory());
  if (!memory.empty())
  {
    vtkErrorMacro(<< memory << " vtkPartitionedSurfelEstimation processes the cloud in parts.");
    return 0;
  }
  if (this->OrientationMode == SCANNERS && input->GetNumberOfPoints() > 0 && !FindScanners(input))
  {
    vtkErrorMacro("OrientationMode is SCANNERS but there is no point array \""
      << ToScannerArray << "\" of three components: give the points the vectors to their scanners,"
      << " or use CONSISTENT, VIEWPOINT or TWO_SIDED.");
    return 0;
  }
  EstimationExecution execution(
    this->GetSettings(input), this, { this->Searched, this->Neighbors }, nullptr);
  if (!execution.Run(input))
  {
    return 1; // stopped by the user: empty output
  }
  this->Take(execution.Count());
  execution.Write(input, output);
  this->WarnOfTroubles();
  this->UpdateProgress(1.0);
  return 1;
}

//------------------------------------------------------------------------------
int vtkSurfelEstimation::RequestDistributed(
  SurfelSplatting::Ranks& ranks, vtkPointSet* input, vtkPolyData* output)
{
  bool isReady = false;
  ranks.DoOwn([&] { isReady = this->CheckSettings(input); });
  if (!ranks.All(isReady))
  {
    if (isReady)
    {
      vtkErrorMacro("No surfels were estimated: another process reported an error.");
    }
    return 0;
  }
  PartitionedCloud cloud(ranks, input);
  vtkDataArray* normals = this->KeepNormals ? FindNormals(input, this->NormalsArrayName) : nullptr;
  const std::vector<PartitionedCloud::Array> arrays = PartitionedCloud::OfAny(ranks,
    { { "Normals", 3, normals },
      { FetchedColorsArray, ColorComponents,
        this->InterpolateColors ? FindColorsToInterpolate(input) : nullptr },
      { ToScannerArray, 3, FindScanners(input) } });
  const bool areGiven = ranks.All(!input || input->GetNumberOfPoints() == 0 || normals);
  const bool orients = ranks.IsRoot() && !areGiven &&
    (this->OrientationMode == CONSISTENT || this->OrientationMode == SCANNERS);
  if (!this->CheckDistributedMemory(ranks, cloud.NumberOfPoints(), orients))
  {
    return 0;
  }
  EstimationSettings settings = this->GetSettings(input);
  settings.JudgeNormals = !ranks.All(input->GetNumberOfPoints() == 0 || !settings.JudgeNormals);
  SharedOrientation shared(ranks, cloud);
  const EstimationSharing sharing{ &shared, [&cloud](vtkIdType i) { return cloud.IsInRegion(i); } };
  const auto estimate = [&](vtkPolyData* region) -> vtkSmartPointer<vtkPolyData> {
    EstimationExecution execution(settings, this, {}, &sharing);
    if (!execution.Run(region))
    {
      return nullptr;
    }
    auto surfels = vtkSmartPointer<vtkPolyData>::New();
    ranks.DoOwn([&] {
      this->Take(execution.Count());
      execution.Write(region, surfels);
    });
    return surfels;
  };
  const double haloWidth = this->NeighborhoodMode == RADIUS ? 2.0 * this->Radius : 0.0;
  const vtkSmartPointer<vtkPolyData> surfels =
    WorkOnRegion(ranks, cloud, arrays, haloWidth, estimate);
  if (!surfels)
  {
    return 1; // stopped by a user: empty output on all processes
  }
  const vtkIdType count = WritePartitionedSurfels(ranks, cloud, surfels, input, output);
  this->NumberOfNonFinitePoints = cloud.NumberOfNonFinitePoints();
  this->NumberOfDuplicatePoints =
    input->GetNumberOfPoints() - this->NumberOfNonFinitePoints - count;
  this->WarnOfTroubles();
  this->UpdateProgress(1.0);
  return 1;
}

//------------------------------------------------------------------------------
bool vtkSurfelEstimation::CheckDistributedMemory(
  SurfelSplatting::Ranks& ranks, vtkIdType points, bool orients)
{
  std::string problem;
  ranks.DoOwn([&] {
    const double available = AvailableMemory();
    problem = CheckMemory(points / ranks.Size(), BytesPerPoint, available);
    if (problem.empty() && orients)
    {
      problem = CheckMemory(points, OrientationBytesPerPoint, available);
    }
  });
  if (ranks.All(problem.empty()))
  {
    return true;
  }
  vtkErrorMacro(
    << (problem.empty() ? "Another process has too little memory; see its messages." : problem)
    << " Process 0 orients the whole cloud; the orientation modes VIEWPOINT and TWO_SIDED"
       " need no memory for that.");
  return false;
}

//------------------------------------------------------------------------------
EstimationSettings vtkSurfelEstimation::GetSettings(vtkPointSet* input) const
{
  EstimationSettings settings{};
  settings.Fit = { this->NeighborhoodMode == RADIUS, this->NumberOfNeighbors, this->Radius,
    this->MaximumNumberOfNeighbors, this->IsolationFactor };
  settings.HasCells = this->KernelMode == CELL;
  settings.IsElliptical = this->KernelMode == ELLIPTICAL;
  settings.KernelScale = this->KernelScale;
  settings.CellBlur = this->CellBlur;
  settings.MaximumAxisRatio = this->MaximumAxisRatio;
  settings.KeepNormals = this->KeepNormals != 0;
  settings.JudgeNormals = this->OrientationMode != AS_GIVEN && !HasNormalsOfFaces(input);
  settings.IsPart = this->IsPart;
  settings.NormalsArrayName = this->NormalsArrayName;
  settings.Rule = this->OrientationMode == VIEWPOINT ? SideRule::Viewpoint
    : this->OrientationMode == SCANNERS              ? SideRule::Scanners
    : this->OrientationMode == TWO_SIDED             ? SideRule::TwoSided
                                                     : SideRule::Shape;
  settings.UseViewpoint = this->UseViewpoint != 0;
  std::copy_n(this->Viewpoint, 3, settings.Viewpoint);
  settings.InterpolateColors = this->InterpolateColors != 0;
  return settings;
}

//------------------------------------------------------------------------------
void vtkSurfelEstimation::Take(const EstimationCounts& counts)
{
  this->NumberOfNonFinitePoints = counts.NonFinite;
  this->NumberOfDuplicatePoints = counts.Duplicate;
  this->NumberOfIsolatedPoints = counts.Isolated;
  this->NumberOfDegeneratePoints = counts.Degenerate;
  this->NumberOfInvalidNormals = counts.InvalidNormals;
  this->NumberOfTwoSidedSurfels = counts.TwoSided;
  this->NumberOfComponents = counts.Components;
  this->NumberOfClosedComponents = counts.ClosedComponents;
  this->MedianSpacing = counts.MedianSpacing;
  this->NormalsUse = static_cast<int>(counts.Normals);
}

//------------------------------------------------------------------------------
bool vtkSurfelEstimation::CheckSettings(vtkPointSet* input)
{
  if (!input)
  {
    vtkErrorMacro("There is no input, or it is not a vtkPointSet: connect a data set with points.");
    return false;
  }
  const std::string problem = CheckNumberOfPoints(input->GetNumberOfPoints());
  if (!problem.empty())
  {
    vtkErrorMacro(<< problem);
    return false;
  }
  if (this->NeighborhoodMode == RADIUS && !(this->Radius > 0.0))
  {
    vtkErrorMacro("NeighborhoodMode is RADIUS but Radius is "
      << this->Radius << ": set a Radius above 0, or use K_NEAREST.");
    return false;
  }
  if (this->OrientationMode == AS_GIVEN && input->GetNumberOfPoints() > 0 &&
    !(this->KeepNormals && FindNormals(input, this->NormalsArrayName)))
  {
    vtkErrorMacro("OrientationMode is AS_GIVEN but there are no normals to keep ("
      << (this->KeepNormals ? "no active normals and no three-component array \"Normals\""
                            : "KeepNormals is off")
      << "): give the input normals, or use CONSISTENT, VIEWPOINT or TWO_SIDED.");
    return false;
  }
  return true;
}

//------------------------------------------------------------------------------
void vtkSurfelEstimation::WarnOfTroubles()
{
  std::string message = ListCounts({ DroppedPoints(this->NumberOfNonFinitePoints),
    { this->NumberOfDuplicatePoints, "duplicate", "dropped" },
    { this->NumberOfIsolatedPoints, "isolated point", "kept with a bounded radius" },
    { this->NumberOfDegeneratePoints, "point",
      "with fewer than three neighbours, or all of them on a line: normals arbitrary" },
    { this->NumberOfInvalidNormals, "given normal", "zero or not finite, estimated instead" } });
  const std::string problem = this->GetNormalsProblem();
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
std::string vtkSurfelEstimation::GetNormalsProblem() const
{
  return this->NormalsUse == NORMALS_DROPPED
    ? "the normals are not those of the surface, and others are estimated"
    : this->NormalsUse == NORMALS_WITHOUT_SIDES
    ? "the normals point to both sides of one surface, and do not tell what is outside"
    : "";
}

//------------------------------------------------------------------------------
void vtkSurfelEstimation::CopySettings(vtkSurfelEstimation* other)
{
  this->SetNeighborhoodMode(other->NeighborhoodMode);
  this->SetNumberOfNeighbors(other->NumberOfNeighbors);
  this->SetRadius(other->Radius);
  this->SetMaximumNumberOfNeighbors(other->MaximumNumberOfNeighbors);
  this->SetKernelMode(other->KernelMode);
  this->SetKernelScale(other->KernelScale);
  this->SetCellBlur(other->CellBlur);
  this->SetMaximumAxisRatio(other->MaximumAxisRatio);
  this->SetKeepNormals(other->KeepNormals);
  this->SetNormalsArrayName(other->NormalsArrayName);
  this->SetOrientationMode(other->OrientationMode);
  this->SetViewpoint(other->Viewpoint);
  this->SetUseViewpoint(other->UseViewpoint);
  this->SetIsolationFactor(other->IsolationFactor);
  this->SetInterpolateColors(other->InterpolateColors);
}

//------------------------------------------------------------------------------
void vtkSurfelEstimation::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "NeighborhoodMode: " << this->NeighborhoodMode << "\n";
  os << indent << "NumberOfNeighbors: " << this->NumberOfNeighbors << "\n";
  os << indent << "Radius: " << this->Radius << "\n";
  os << indent << "MaximumNumberOfNeighbors: " << this->MaximumNumberOfNeighbors << "\n";
  os << indent << "KernelMode: " << this->KernelMode << "\n";
  os << indent << "KernelScale: " << this->KernelScale << "\n";
  os << indent << "CellBlur: " << this->CellBlur << "\n";
  os << indent << "MaximumAxisRatio: " << this->MaximumAxisRatio << "\n";
  os << indent << "KeepNormals: " << this->KeepNormals << "\n";
  os << indent
     << "NormalsArrayName: " << (this->NormalsArrayName ? this->NormalsArrayName : "(none)")
     << "\n";
  os << indent << "OrientationMode: " << this->OrientationMode << "\n";
  os << indent << "Viewpoint: (" << this->Viewpoint[0] << ", " << this->Viewpoint[1] << ", "
     << this->Viewpoint[2] << ")\n";
  os << indent << "UseViewpoint: " << this->UseViewpoint << "\n";
  os << indent << "IsolationFactor: " << this->IsolationFactor << "\n";
  os << indent << "InterpolateColors: " << this->InterpolateColors << "\n";
  os << indent << "Controller: " << this->Controller.Get() << "\n";
  os << indent << "NumberOfNonFinitePoints: " << this->NumberOfNonFinitePoints << "\n";
  os << indent << "NumberOfDuplicatePoints: " << this->NumberOfDuplicatePoints << "\n";
  os << indent << "NumberOfIsolatedPoints: " << this->NumberOfIsolatedPoints << "\n";
  os << indent << "NumberOfDegeneratePoints: " << this->NumberOfDegeneratePoints << "\n";
  os << indent << "NumberOfInvalidNormals: " << this->NumberOfInvalidNormals << "\n";
  os << indent << "NumberOfTwoSidedSurfels: " << this->NumberOfTwoSidedSurfels << "\n";
  os << indent << "NumberOfComponents: " << this->NumberOfComponents << "\n";
  os << indent << "NumberOfClosedComponents: " << this->NumberOfClosedComponents << "\n";
  os << indent << "NormalsUse: " << this->NormalsUse << "\n";
  os << indent << "MedianSpacing: " << this->MedianSpacing << "\n";
}
