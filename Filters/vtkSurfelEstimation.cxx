// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelEstimation.h"

#include "Filters/Arrays/InputArrays.h"
#include "Filters/Arrays/PointColors.h"
#include "Filters/Arrays/SurfelOutput.h"
#include "Filters/Common/AvailableMemory.h"
#include "Filters/Common/Intrinsics.h"
#include "Filters/Common/ParallelMedian.h"
#include "Filters/Estimation/ColorInterpolation.h"
#include "Filters/Estimation/IsolatedPoints.h"
#include "Filters/Estimation/PlaneFit.h"
#include "Filters/Estimation/PointPlanes.h"
#include "Filters/Estimation/SharpNormals.h"
#include "Filters/Estimation/SurfaceHeights.h"
#include "Filters/Estimation/SurfelKernel.h"
#include "Filters/Estimation/VoronoiCell.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Neighbors/NeighborGraph.h"
#include "Filters/Partition/PartitionedSurfels.h"
#include "Filters/Partition/SharedOrientation.h"
#include "Filters/SurfelSides.h"
#include "Parallel/ControllerRanks.h"

#include "vtkDataArray.h"
#include "vtkFloatArray.h"
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
#include <atomic>
#include <functional>
#include <string>
#include <utility>

using namespace SurfelGeometry;

vtkStandardNewMacro(vtkSurfelEstimation);

/// One execution: from the input's points to the output's arrays.
class vtkSurfelEstimation::Execution
{
public:
  /// @param shared  orientation together with other ranks, or null
  /// @param counted whether statistics count a point of the input; null: all points
  explicit Execution(vtkSurfelEstimation* self, SharedOrientation* shared = nullptr,
    const std::function<bool(vtkIdType)>& counted = nullptr)
    : Self(self)
    , Shared(shared)
    , Counted(counted)
  {
  }

  /// Returns false if stopped.
  bool Run(vtkPointSet* input)
  {
    this->Search(input);
    this->ReadNormals(input);
    const NeighborSearch& tree = *this->Searched.Tree;
    const StageProgress progress(this->Self, 0.0, 1.0);
    const FitSettings settings = this->GetFitSettings();
    const bool fitted = progress.Step(0.1) &&
      FitPlanes({ this->Cloud(), tree, settings, this->Given, FindScanners(input) },
        progress.Part(0.1, 0.6), this->Fits, this->Searched.Graph);
    if (fitted)
    {
      BoundIsolated(settings.IsolationFactor, this->Cloud(), this->Searched.Graph, this->Fits);
    }
    ReturnFreeMemory(); // most of all is needed for the votes of the orientation
    const OrientedCloud oriented{ this->Cloud(), tree, this->Searched.Graph, this->Result.TwoSided,
      FindScanners(input) };
    const bool finished = this->All(fitted) && this->Orient(input, progress.Part(0.6, 0.85)) &&
      RefineExtents(oriented, settings, progress.Part(0.85, 0.9), this->Fits) &&
      (this->Given.empty() || TurnToPoints(oriented, progress.Part(0.9, 0.905), this->Fits)) &&
      SharpenNormals(oriented, progress.Part(0.905, 0.91), this->Fits) &&
      this->MakeKernels(input, oriented, progress.Part(0.91, 0.98));
    if (finished && this->SharesNeighbors() && this->Searched.Graph.AreNearest)
    {
      this->Searched.FindAround([this](int i) { return this->CenterOf(i); },
        [this](int i) { return FarShift * this->Fits[i].Spacing; });
    }
    this->Searched.ReleaseTree(); // frees memory for the output, as the last lines do
    if (this->SharesNeighbors())
    {
      this->Self->Neighbors->Graph = std::move(this->Searched.Graph);
    }
    this->Searched.Graph = NeighborGraph();
    ReturnFreeMemory();
    return finished;
  }

  void Write(vtkPointSet* input, vtkPolyData* output)
  {
    const auto points = static_cast<size_t>(input->GetNumberOfPoints());
    const bool areAll = this->Cloud().InputIds.size() == points;
    std::vector<char> kept(points, areAll ? 1 : 0);
    for (size_t i = 0; i < this->Cloud().InputIds.size() && !areAll; ++i)
    {
      kept[static_cast<size_t>(this->Cloud().InputIds[i])] = 1;
    }
    PassPointData(input, kept, output);
    this->Order = OrderOfInput(this->Cloud(), kept);
    this->WriteSurfels(output);
    if (!this->Colors.empty())
    {
      WriteColors(this->Colors, this->Order, output);
    }
    if (this->SharesNeighbors())
    {
      this->Self->Neighbors->Order = std::move(this->Order);
    }
  }

  void Count()
  {
    vtkSurfelEstimation* self = this->Self;
    self->NumberOfNonFinitePoints = this->Cloud().NonFinite;
    self->NumberOfDuplicatePoints = this->Cloud().Duplicates;
    std::atomic<vtkIdType> isolated{ 0 }, degenerate{ 0 }, twoSided{ 0 };
    const auto count = static_cast<vtkIdType>(this->Fits.size());
    vtkSMPTools::For(0, count, [&](vtkIdType i, vtkIdType end) {
      vtkIdType sums[3] = { 0, 0, 0 };
      for (; i < end; ++i)
      {
        const bool isCounted = this->IsCounted(static_cast<int>(i));
        sums[0] += isCounted && this->Fits[i].Isolated ? 1 : 0;
        sums[1] += isCounted && this->Fits[i].Degenerate ? 1 : 0;
        sums[2] += isCounted ? this->Result.TwoSided[i] : 0;
      }
      isolated += sums[0];
      degenerate += sums[1];
      twoSided += sums[2];
    });
    self->NumberOfIsolatedPoints = isolated;
    self->NumberOfDegeneratePoints = degenerate;
    self->NumberOfTwoSidedSurfels = twoSided;
    self->NumberOfComponents = this->Result.NumberOfComponents;
    self->NumberOfClosedComponents = this->Result.NumberOfClosedComponents;
    self->MedianSpacing = ParallelMedian(count, [this](vtkIdType i) {
      return this->IsCounted(static_cast<int>(i)) ? this->Fits[i].Spacing : -1.0f;
    });
  }

private:
  const LocalCloud& Cloud() const { return this->Searched.Cloud; }

  /// Takes the search of the cleaning over, or makes one.
  void Search(vtkPointSet* input)
  {
    if (!this->Shared && this->Self->Searched && this->Self->Searched->Tree)
    {
      std::swap(this->Searched, *this->Self->Searched);
    }
    else
    {
      LocalCloud& cloud = this->Searched.Cloud;
      double origin[3] = { 0.0, 0.0, 0.0 };
      ReadOrigin(input, origin);
      std::copy_n(origin, 3, cloud.Origin);
      if (input->GetPoints())
      {
        GatherCloud(input->GetPoints(), origin, cloud);
      }
      this->Searched.Index();
    }
  }

  void ReadNormals(vtkPointSet* input)
  {
    vtkDataArray* normals =
      this->Self->KeepNormals ? FindNormals(input, this->Self->NormalsArrayName) : nullptr;
    if (!normals)
    {
      return;
    }
    this->Given.assign(3 * static_cast<size_t>(this->Cloud().Size()), 0.0f);
    for (int i = 0; i < this->Cloud().Size(); ++i)
    {
      double tuple[3];
      normals->GetTuple(this->Cloud().InputIds[i], tuple);
      const Vector3 zero{};
      const Vector3 normal = Normalized({ tuple[0], tuple[1], tuple[2] }, zero);
      this->Self->NumberOfInvalidNormals +=
        Dot(normal, normal) > 0.0 || !this->IsCounted(i) ? 0 : 1;
      Store(normal, this->Given.data() + 3 * static_cast<size_t>(i));
    }
  }

  FitSettings GetFitSettings() const
  {
    FitSettings settings;
    settings.UseRadius = this->Self->NeighborhoodMode == RADIUS;
    settings.NumberOfNeighbors = this->Self->NumberOfNeighbors;
    settings.Radius = this->Self->Radius;
    settings.MaximumNumberOfNeighbors = this->Self->MaximumNumberOfNeighbors;
    settings.IsolationFactor = this->Self->IsolationFactor;
    return settings;
  }

  /// Returns false if stopped.
  bool Orient(vtkPointSet* input, const StageProgress& progress)
  {
    const vtkSurfelEstimation* self = this->Self;
    const int mode = self->OrientationMode;
    const SideRule rule = mode == VIEWPOINT ? SideRule::Viewpoint
      : mode == SCANNERS                    ? SideRule::Scanners
      : mode == TWO_SIDED                   ? SideRule::TwoSided
                                            : SideRule::Shape;
    const double* v = self->Viewpoint;
    return DecideSides({ rule, self->UseViewpoint != 0, { v[0], v[1], v[2] }, this->Shared,
                         this->Cloud(), this->Searched.Graph, FindScanners(input) },
      progress, this->Fits, this->Result);
  }

  /// Returns false if stopped.
  bool MakeKernels(vtkPointSet* input, const OrientedCloud& oriented, const StageProgress& progress)
  {
    const bool isCell = this->Self->KernelMode == CELL;
    const bool areColored = this->Self->InterpolateColors && FindColorsToInterpolate(input);
    KernelSteering steering;
    this->Heights.Resize(isCell ? this->Fits.size() : 0);
    if (areColored)
    {
      this->Colors = GatherColors(input, this->Cloud());
      const double blur = isCell ? MeanBlur(this->Self->CellBlur) : this->Self->KernelScale;
      if (!SurfelGeometry::InterpolateColors(oriented, this->Fits, blur, progress.Part(0.0, 0.4),
            this->Colors, { steering, isCell ? &this->Heights : nullptr }))
      {
        return false;
      }
    }
    return !isCell ||
      ((areColored || this->Heights.RiseAll(oriented, this->Fits, progress.Part(0.3, 0.4))) &&
        MeasureCells(oriented, { steering, this->Self->CellBlur }, progress.Part(0.4, 1.0),
          this->Fits, this->Cells, this->Heights));
  }

  /// Kernel of the cloud's point i.
  SurfelKernel KernelOf(int i) const
  {
    const PlaneFit& fit = this->Fits[i];
    SurfelKernel kernel = this->HasCell(i)
      ? CellKernel(fit, this->Cells[i])
      : SpacingKernel(fit, this->Self->KernelScale, this->Self->KernelMode == ELLIPTICAL);
    BoundAxes(this->Self->MaximumAxisRatio, kernel);
    return kernel;
  }

  /// Where that is, relative to the cloud's origin.
  Vector3 CenterOf(int i) const
  {
    const Vector3 p = Load(this->Cloud().Position(i));
    return this->HasCell(i)
      ? p + this->Cells[i].Centroid + double{ this->Heights.Final[i] } * this->Fits[i].Normal
      : p;
  }

  bool HasCell(int i) const { return !this->Cells.empty() && this->Cells[i].Area > 0.0f; }

  void WriteSurfels(vtkPolyData* output)
  {
    const vtkIdType count = this->Cloud().Size();
    const SurfelOutput surfels(count);
    const bool isSorted = !this->SharesNeighbors();
    vtkSMPTools::For(0, count, [&](vtkIdType begin, vtkIdType end) {
      for (vtkIdType i = begin; i < end; ++i)
      {
        if (isSorted)
        {
          this->Prefetch(std::min(i + PrefetchDistance, count - 1));
        }
        const int from = isSorted ? this->Order[i] : static_cast<int>(i);
        const PlaneFit& fit = this->Fits[from];
        const SurfelKernel kernel = this->KernelOf(from);
        Store(this->CenterOf(from), surfels.Positions->GetPointer(3 * i));
        StoreCovariance(kernel, fit.Normal, surfels.Covariances->GetPointer(6 * i));
        Store(kernel.Area * fit.Normal, surfels.AreaVectors->GetPointer(3 * i));
        surfels.TwoSided->SetValue(i, this->Result.TwoSided[from]);
      }
    });
    surfels.Write(this->Cloud().Origin, output);
  }

  /// Starts loading what point i of the output is made of: in the order of the input, which may be
  /// any, it is not in the caches.
  void Prefetch(vtkIdType i) const
  {
    const auto from = static_cast<size_t>(this->Order[i]);
    SURFEL_PREFETCH(this->Cloud().Positions.data() + 3 * from);
    SURFEL_PREFETCH(this->Fits.data() + from);
    if (!this->Cells.empty())
    {
      SURFEL_PREFETCH(this->Cells.data() + from);
    }
  }

  bool SharesNeighbors() const { return this->Self->Neighbors && !this->Shared; }

  bool IsCounted(int i) const { return !this->Counted || this->Counted(this->Cloud().InputIds[i]); }

  /// Whether `condition` holds on all ranks that estimate one cloud.
  bool All(bool condition) { return this->Shared ? this->Shared->All(condition) : condition; }

  static constexpr vtkIdType PrefetchDistance = 16;

  /// Beside a void a cell reaches into it, and its kernel lies so many spacings off the point,
  /// which has its neighbours on one side then: for the weights that would be a border.
  static constexpr double FarShift = 0.55;

  vtkSurfelEstimation* Self;
  SharedOrientation* Shared;
  std::function<bool(vtkIdType)> Counted;
  SearchedCloud Searched;
  std::vector<float> Given;
  PlaneFits Fits;
  std::vector<int> Order; // output id -> cloud index
  OrientationResult Result;
  VoronoiCells Cells;
  SurfaceHeights Heights; // with cells only
  CloudColors Colors;     // empty: those of the input stay
};

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
  this->ResetCounts();
  const vtkSmartPointer<vtkPointSet> fitting = WithFittingArrays(input, this);
  input = fitting;
  if (this->Controller && this->Controller->GetNumberOfProcesses() > 1)
  {
    SurfelSplatting::ControllerRanks ranks(this->Controller);
    return this->RequestDistributed(ranks, input, output);
  }
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
  Execution execution(this);
  if (!execution.Run(input))
  {
    return 1; // stopped by the user: empty output
  }
  execution.Count();
  execution.Write(input, output);
  this->WarnOfTroubles();
  this->UpdateProgress(1.0);
  return 1;
}

//------------------------------------------------------------------------------
int vtkSurfelEstimation::RequestDistributed(
  SurfelSplatting::Ranks& ranks, vtkPointSet* input, vtkPolyData* output)
{
  const bool isReady = this->CheckSettings(input);
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
  SharedOrientation shared(ranks, cloud);
  const auto estimate = [&](vtkPolyData* region) -> vtkSmartPointer<vtkPolyData> {
    this->ResetCounts();
    Execution execution(this, &shared, [&cloud](vtkIdType i) { return cloud.IsInRegion(i); });
    if (!execution.Run(region))
    {
      return nullptr;
    }
    execution.Count();
    auto surfels = vtkSmartPointer<vtkPolyData>::New();
    execution.Write(region, surfels);
    return surfels;
  };
  const double haloWidth = this->NeighborhoodMode == RADIUS ? 2.0 * this->Radius : 0.0;
  const vtkSmartPointer<vtkPolyData> surfels =
    WorkOnRegion(ranks, cloud, arrays, haloWidth, estimate);
  if (!surfels)
  {
    return 1; // stopped by a user: empty output on all processes
  }
  const vtkIdType count = WritePartitionedSurfels(cloud, surfels, input, output);
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
  std::string problem = CheckMemory(points / ranks.Size(), BytesPerPoint, AvailableMemory());
  if (problem.empty() && orients)
  {
    problem = CheckMemory(points, OrientationBytesPerPoint, AvailableMemory());
  }
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
void vtkSurfelEstimation::ResetCounts()
{
  this->NumberOfNonFinitePoints = 0;
  this->NumberOfDuplicatePoints = 0;
  this->NumberOfIsolatedPoints = 0;
  this->NumberOfDegeneratePoints = 0;
  this->NumberOfInvalidNormals = 0;
  this->NumberOfTwoSidedSurfels = 0;
  this->NumberOfComponents = 0;
  this->NumberOfClosedComponents = 0;
  this->MedianSpacing = 0.0;
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
  const std::string message = ListCounts(
    { { this->NumberOfNonFinitePoints, "points with NaN or infinite coordinates dropped" },
      { this->NumberOfDuplicatePoints, "duplicates dropped" },
      { this->NumberOfIsolatedPoints, "isolated points kept with a bounded radius" },
      { this->NumberOfDegeneratePoints,
        "points with fewer than three neighbours, or all of them on a line: normals arbitrary" },
      { this->NumberOfInvalidNormals, "given normals zero or not finite, estimated instead" } });
  if (!message.empty())
  {
    vtkWarningMacro(<< message << '.');
  }
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
  os << indent << "MedianSpacing: " << this->MedianSpacing << "\n";
}
