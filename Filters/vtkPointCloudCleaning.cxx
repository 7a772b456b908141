// SPDX-License-Identifier: BSD-3-Clause
#include "vtkPointCloudCleaning.h"

#include "Filters/Cleaning/CleaningProblem.h"
#include "Filters/Cleaning/DepthSteps.h"
#include "Filters/Cleaning/Smoothing.h"
#include "Filters/Cleaning/StrayPoints.h"
#include "Filters/Common/AvailableMemory.h"
#include "Filters/Common/InputArrays.h"
#include "Filters/Common/LocalCloud.h"
#include "Filters/Common/NeighborGraph.h"
#include "Filters/Common/PointCells.h"
#include "Filters/Common/SurfelOutput.h"
#include "Filters/Partition/PartitionedSurfels.h"
#include "Parallel/ControllerRanks.h"

#include "vtkDataArray.h"
#include "vtkFloatArray.h"
#include "vtkIdList.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMultiProcessController.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPointSet.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <string>
#include <utility>
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

constexpr const char* ColorsArray = "Colors";

/// Null if the points have no colours.
vtkDataArray* FindColors(vtkPointSet* input)
{
  vtkPointData* data = input->GetPointData();
  vtkDataArray* fetched = data->GetArray(ColorsArray);
  auto* scalars = vtkUnsignedCharArray::SafeDownCast(data->GetScalars());
  if (data->HasArray(PartitionedCloud::IdArray))
  {
    return fetched;
  }
  return scalars && scalars->GetNumberOfComponents() >= 3 ? scalars : nullptr;
}

/// [3n] in the order of the cloud; empty if there are none.
std::vector<unsigned char> ColorsOf(vtkPointSet* input, const LocalCloud& cloud)
{
  std::vector<unsigned char> colors;
  if (vtkDataArray* array = FindColors(input))
  {
    colors.reserve(3 * cloud.InputIds.size());
    for (const vtkIdType id : cloud.InputIds)
    {
      for (int c = 0; c < 3; ++c)
      {
        colors.push_back(static_cast<unsigned char>(array->GetComponent(id, c)));
      }
    }
  }
  return colors;
}

/// The points of `input`, each at its shift, world units.
vtkSmartPointer<vtkPoints> Shifted(vtkPointSet* input, const std::vector<Float3>& shifts)
{
  auto points = vtkSmartPointer<vtkPoints>::New();
  points->SetDataType(input->GetPoints()->GetDataType());
  points->DeepCopy(input->GetPoints());
  for (size_t i = 0; i < shifts.size(); ++i)
  {
    const Vector3 shift = shifts[i];
    double p[3];
    points->GetPoint(static_cast<vtkIdType>(i), p);
    points->SetPoint(static_cast<vtkIdType>(i), p[0] + shift[0], p[1] + shift[1], p[2] + shift[2]);
  }
  return points;
}
}

/// One execution: which points of the input are kept, which are stray, and where they move.
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
    this->Begin(input);
    const StageProgress progress(this->Self, 0.0, 1.0);
    if (!input->GetPoints())
    {
      return true;
    }
    if (!this->SmoothDepths(input, progress.Part(0.0, 0.1)))
    {
      return false;
    }
    this->Gather(input);
    LocalCloud& cloud = this->Searched.Cloud;
    for (size_t i = 0; !this->Shifts.empty() && i < cloud.InputIds.size(); ++i)
    {
      const Float3& shift = this->Shifts[cloud.InputIds[i]];
      cloud.Positions[3 * i] += shift.X;
      cloud.Positions[3 * i + 1] += shift.Y;
      cloud.Positions[3 * i + 2] += shift.Z;
    }
    return progress.Step(0.2) && this->Clean(input, nullptr, progress.Part(0.2, 0.9));
  }

  /// The same together with other processes.
  bool RunTogether(SurfelSplatting::Ranks& ranks, vtkPointSet* input)
  {
    this->Begin(input);
    const StageProgress progress(this->Self, 0.0, 1.0);
    if (!ranks.All(this->SmoothDepths(input, progress.Part(0.0, 0.1))))
    {
      return false;
    }
    vtkSmartPointer<vtkPointSet> smooth = input;
    if (!this->Shifts.empty())
    {
      smooth.TakeReference(input->NewInstance());
      smooth->ShallowCopy(input);
      smooth->SetPoints(Shifted(input, this->Shifts));
    }
    PartitionedCloud cloud(ranks, smooth);
    std::vector<PartitionedCloud::Array> arrays;
    vtkDataArray* colors = FindColors(input);
    if (ranks.Any(colors != nullptr))
    {
      arrays.push_back({ ColorsArray, 3, colors });
    }
    const auto region = cloud.Fetch(cloud.HaloWidth(HaloSpacings), arrays);
    Execution own(this->Self);
    if (!own.CleanRegion(ranks, cloud, region, progress.Part(0.2, 0.9)))
    {
      return false;
    }
    this->NonFinite = cloud.NumberOfNonFinitePoints();
    this->Take(cloud.Return(own.Results(cloud)));
    return true;
  }

  /// Moves the points of the output, which are the input's.
  void MovePoints(vtkPolyData* output) const
  {
    std::vector<Float3> kept;
    for (size_t i = 0; i < this->Kept.size(); ++i)
    {
      if (this->Kept[i])
      {
        kept.push_back(this->Shifts[i]);
      }
    }
    output->SetPoints(Shifted(output, kept));
    if (this->Self->GenerateShifts)
    {
      const auto count = static_cast<vtkIdType>(kept.size());
      auto array = MakeArray<vtkFloatArray>("CleaningShift", 3, count);
      for (vtkIdType i = 0; i < count; ++i)
      {
        Store(kept[i], array->GetPointer(3 * i));
      }
      output->GetPointData()->AddArray(array);
    }
  }

  bool AreMoved() const { return !this->Shifts.empty(); }

  /// Hands the search over to the estimation of the output, whose points have other ids.
  void HandOver(SearchedCloud& searched)
  {
    if (this->AreMoved() || !this->Searched.Tree)
    {
      return; // its points have other neighbours
    }
    std::vector<vtkIdType> ids;
    ids.reserve(this->Kept.size());
    vtkIdType next = 0;
    for (const char kept : this->Kept)
    {
      ids.push_back(next);
      next += kept;
    }
    searched = std::move(this->Searched);
    searched.Cloud.NonFinite = searched.Cloud.Duplicates = 0;
    for (vtkIdType& id : searched.Cloud.InputIds)
    {
      id = ids[id];
    }
  }

  void Count()
  {
    const auto count = [](const std::vector<char>& flags) {
      return static_cast<vtkIdType>(std::count(flags.begin(), flags.end(), char{ 1 }));
    };
    vtkPointCloudCleaning* self = this->Self;
    self->NumberOfNonFinitePoints = this->NonFinite;
    self->NumberOfStrayPoints = count(this->Strayed);
    self->NumberOfDuplicatePoints = static_cast<vtkIdType>(this->Kept.size()) - this->NonFinite -
      count(this->Kept) - self->NumberOfStrayPoints;
    for (size_t i = 0; i < this->Shifts.size(); ++i)
    {
      const bool isMoved = this->Kept[i] && SingleDot(this->Shifts[i], this->Shifts[i]) > 0.0f;
      self->NumberOfMovedPoints += isMoved ? 1 : 0;
    }
  }

  std::vector<char> Kept, Strayed; // [input points] 1: yes

private:
  static constexpr int ResultComponents = 4; // whether it is kept, shift

  void Begin(vtkPointSet* input)
  {
    this->Kept.assign(input->GetNumberOfPoints(), 0);
    this->Strayed.assign(input->GetNumberOfPoints(), 0);
  }

  void Gather(vtkPointSet* input)
  {
    double origin[3] = { 0.0, 0.0, 0.0 };
    ReadOrigin(input, origin);
    GatherCloud(input->GetPoints(), origin, this->Searched.Cloud);
    this->NonFinite = this->Searched.Cloud.NonFinite;
  }

  /// Returns false if stopped.
  bool SmoothDepths(vtkPointSet* input, const StageProgress& progress)
  {
    if (!this->Self->Smoothing || this->Self->Columns == 0 || input->GetNumberOfPoints() == 0)
    {
      return true;
    }
    const double* v = this->Self->Viewpoint;
    const DepthImage image{ input->GetPoints(), this->Self->Columns, { v[0], v[1], v[2] } };
    return SmoothDepthSteps(image, progress, this->Shifts);
  }

  /// Collective. Returns false if stopped.
  bool CleanRegion(SurfelSplatting::Ranks& ranks, const PartitionedCloud& cloud,
    vtkPolyData* region, const StageProgress& progress)
  {
    this->Begin(region);
    this->Gather(region);
    this->Searched.Cloud.SampleIds = cloud.GlobalIds();
    CleaningSharing sharing;
    sharing.Total = cloud.NumberOfPoints();
    std::copy_n(cloud.Origin(), 3, sharing.Origin);
    for (const vtkIdType id : this->Searched.Cloud.InputIds)
    {
      sharing.IsOwn.push_back(cloud.IsInRegion(id) ? 1 : 0);
    }
    sharing.Gather = [&ranks](bool running, std::vector<float>& values) {
      SurfelSplatting::Message message;
      SurfelSplatting::Put(values.data(), values.size(), message);
      values.clear();
      for (const SurfelSplatting::Message& other : ranks.Share(message))
      {
        const size_t at = values.size(), more = other.size() / sizeof(float);
        values.resize(at + more);
        SurfelSplatting::MessageReader(other).Get(values.data() + at, more);
      }
      return ranks.All(running);
    };
    return ranks.All(this->Clean(region, &sharing, progress));
  }

  /// Collective, if shared. Returns false if stopped.
  bool Clean(vtkPointSet* input, CleaningSharing* sharing, const StageProgress& progress)
  {
    const LocalCloud& cloud = this->Searched.Cloud;
    this->Searched.Index();
    const CleaningProblem problem{ this->Searched, sharing };
    std::vector<unsigned char> stray(cloud.Size(), 0);
    // Stored neighbours are for the next filter; they take twice the memory.
    const bool isStored =
      !this->Self->Searched || this->Searched.FindNeighbors(progress.Part(0.0, 0.2));
    if (!problem.All(isStored) ||
      (this->Self->RemoveStrayPoints &&
        !problem.All(FindStrayPoints(problem, progress.Part(0.2, 0.4), stray))))
    {
      return false;
    }
    for (int i = 0; i < cloud.Size(); ++i)
    {
      (stray[i] ? this->Strayed : this->Kept)[cloud.InputIds[i]] = 1;
    }
    this->DropStray(stray, sharing);
    std::vector<Float3> shifts;
    if (this->Self->Smoothing &&
      !SmoothNoise(problem, ColorsOf(input, cloud), progress.Part(0.4, 1.0), shifts))
    {
      return false;
    }
    this->Shifts.resize(shifts.empty() ? this->Shifts.size() : this->Kept.size());
    for (size_t i = 0; i < shifts.size(); ++i)
    {
      Float3& shift = this->Shifts[cloud.InputIds[i]];
      shift = Vector3(shift) + Vector3(shifts[i]);
    }
    return true;
  }

  void DropStray(const std::vector<unsigned char>& stray, CleaningSharing* sharing)
  {
    if (std::find(stray.begin(), stray.end(), 1) == stray.end())
    {
      return;
    }
    this->Searched.Drop(stray);
    if (sharing)
    {
      size_t kept = 0;
      for (size_t i = 0; i < stray.size(); ++i)
      {
        sharing->IsOwn[kept] = sharing->IsOwn[i];
        kept += stray[i] ? 0 : 1;
      }
    }
  }

  /// Of the points in this process's region.
  PartitionedCloud::Results Results(const PartitionedCloud& cloud) const
  {
    PartitionedCloud::Results results;
    results.Components = ResultComponents;
    for (size_t i = 0; i < this->Kept.size(); ++i)
    {
      const auto id = static_cast<vtkIdType>(i);
      if ((this->Kept[i] || this->Strayed[i]) && cloud.IsInRegion(id))
      {
        const Float3 shift = this->Shifts.empty() ? Float3() : this->Shifts[i];
        results.Points.push_back(id);
        results.Values.insert(
          results.Values.end(), { this->Kept[i] ? 1.0f : 0.0f, shift.X, shift.Y, shift.Z });
      }
    }
    return results;
  }

  void Take(const PartitionedCloud::Returned& returned)
  {
    const float* values = returned.Values.data();
    for (size_t i = 0; i < returned.Has.size(); ++i, values += ResultComponents)
    {
      if (returned.Has[i])
      {
        (values[0] > 0.0f ? this->Kept : this->Strayed)[i] = 1;
        const Vector3 shift = Load(values + 1);
        if (Dot(shift, shift) > 0.0)
        {
          this->Shifts.resize(this->Kept.size());
          this->Shifts[i] = Vector3(this->Shifts[i]) + shift;
        }
      }
    }
  }

  vtkPointCloudCleaning* Self;
  SearchedCloud Searched;
  std::vector<Float3> Shifts; // [input points] or empty, world units
  vtkIdType NonFinite = 0;
};

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
  this->NumberOfNonFinitePoints = 0;
  this->NumberOfDuplicatePoints = 0;
  this->NumberOfStrayPoints = 0;
  this->NumberOfMovedPoints = 0;
  const bool isAlone = !this->Controller || this->Controller->GetNumberOfProcesses() <= 1;
  Execution execution(this);
  bool finished = false;
  if (isAlone)
  {
    if (!this->CheckInput(input))
    {
      return 0;
    }
    finished = execution.Run(input);
  }
  else
  {
    SurfelSplatting::ControllerRanks ranks(this->Controller);
    if (!this->CheckInputs(ranks, input))
    {
      return 0;
    }
    finished = execution.RunTogether(ranks, input);
  }
  if (!finished)
  {
    return 1; // stopped by the user: empty output
  }
  execution.Count();
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
  this->WarnOfTroubles();
  this->UpdateProgress(1.0);
  return 1;
}

//------------------------------------------------------------------------------
bool vtkPointCloudCleaning::CheckInputs(SurfelSplatting::Ranks& ranks, vtkPointSet* input)
{
  const bool isReady = this->CheckInput(input);
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
  os << indent << "Controller: " << this->Controller.Get() << "\n";
  os << indent << "NumberOfNonFinitePoints: " << this->NumberOfNonFinitePoints << "\n";
  os << indent << "NumberOfDuplicatePoints: " << this->NumberOfDuplicatePoints << "\n";
  os << indent << "NumberOfStrayPoints: " << this->NumberOfStrayPoints << "\n";
  os << indent << "NumberOfMovedPoints: " << this->NumberOfMovedPoints << "\n";
}
