// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelHierarchy.h"

#include "Core/Hierarchy/HierarchyBuilder.h"
#include "Core/Hierarchy/KdTreeOrder.h"
#include "Core/Surfels/SurfelArrays.h"
#include "Filters/Arrays/InputArrays.h"
#include "Filters/Arrays/PointAttributes.h"
#include "Filters/Arrays/PointCells.h"
#include "Filters/Arrays/SurfelOutput.h"
#include "Filters/Common/AvailableMemory.h"
#include "Filters/Common/ProgressExecutor.h"
#include "Filters/Neighbors/LocalCloud.h"
#include "Filters/Neighbors/NeighborGraph.h"
#include "SurfelData/HierarchyArrays.h"
#include "SurfelData/SurfelCheck.h"
#include "SurfelData/SurfelCloudSource.h"

#include "vtkBoundingBox.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkIdTypeArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

namespace Arrays = SurfelSplatting::Arrays;
using SurfelSplatting::HierarchyLayout;
using SurfelSplatting::KdTreeOrder;

namespace
{
/// Surfels that a thread copies at a time.
constexpr std::size_t Grain = 16384;

/// Bytes of a surfel with a colour; bytes per surfel that a hierarchy and its first frame add,
/// mainly a node and its colour; and bytes per surfel while the filter works.
constexpr double BytesPerSurfel = 61.0, BytesPerNode = 112.0, BytesOfWork = 64.0;

/// Returns an empty string, or what is wrong with surfels that were a hierarchy before. If points
/// were selected, nothing is known.
std::string CheckMoves(vtkPolyData* input)
{
  using namespace SurfelSplatting;
  if (!CheckHierarchy(input).empty())
  {
    return std::string();
  }
  SurfelCloudSource leaves;
  SetSurfels(input, leaves);
  const LeafPlacement::MoveKind move = FindPlacement(input, leaves.Cloud).Kind;
  return move == LeafPlacement::None || move == LeafPlacement::Translation
    ? std::string()
    : "The points of this hierarchy were turned, scaled or warped, and their kernels were not. Put "
      "vtkPointsToSurfels after the filter that did so, or use the actor's matrix instead.";
}
}

vtkStandardNewMacro(vtkSurfelHierarchy);

/// One execution: orders the surfels, passes them on in this order, builds the nodes above them.
class vtkSurfelHierarchy::Execution
{
public:
  Execution(vtkSurfelHierarchy* self, vtkPolyData* input)
    : Self(self)
    , Input(input)
  {
  }

  HierarchyLayout Layout;
  std::uint64_t NumberOfInvalidSurfels = 0;

  /// Returns false if stopped.
  bool Run(vtkPolyData* output)
  {
    const SurfelGeometry::StageProgress progress(this->Self, 0.0, 1.0);
    {
      SurfelSplatting::SurfelCloudSource surfels;
      SetSurfels(this->Input, surfels);
      SurfelGeometry::ProgressExecutor ordering(progress.Part(0.0, 0.5));
      const KdTreeOrder order = MakeKdTreeOrder(surfels.Cloud, ordering);
      this->Layout = order.Layout;
      this->NumberOfInvalidSurfels = order.NumberOfInvalidSurfels;
      SurfelGeometry::ProgressExecutor passing(progress.Part(0.5, 0.7));
      if (ordering.Stopped() || !this->PassLeaves(surfels.Cloud, order, passing, output))
      {
        return false;
      }
    }
    SurfelGeometry::ProgressExecutor filling(progress.Part(0.7, 1.0));
    this->AddNodes(filling, output);
    return !filling.Stopped();
  }

private:
  bool PassLeaves(const SurfelSplatting::SurfelCloud& surfels, const KdTreeOrder& order,
    const SurfelGeometry::ProgressExecutor& executor, vtkPolyData* output)
  {
    this->FindShift(surfels, order);
    this->PlaceLeaves(surfels, order, executor, output);
    SurfelGeometry::PassLeafAttributes(
      this->Input, order.Surfels, this->FindPoints(order.Surfels, executor), executor, output);
    // VTK's own mappers and filters need a cell to see the surfels.
    output->SetVerts(SurfelGeometry::MakePointCell(output->GetNumberOfPoints()));
    this->AddFieldData(output);
    return !executor.Stopped();
  }

  /// The tuples of the arrays that are in the order of the input, not of the surfels.
  SurfelGeometry::TupleOrder FindPoints(
    const SurfelGeometry::TupleOrder& surfels, const SurfelSplatting::Executor& executor) const
  {
    const SurfelGeometry::SurfelNeighbors* known = this->Self->Neighbors;
    if (!known || known->Order.empty())
    {
      return surfels;
    }
    const SurfelGeometry::RawVector<int> ranks = known->InputRanks();
    SurfelGeometry::TupleOrder points(surfels.size());
    executor.For(surfels.size(), Grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
      {
        points[i] = static_cast<std::uint32_t>(ranks[surfels[i]]);
      }
    });
    return points;
  }

  /// Float positions need a local origin if the cloud is far from its own.
  void FindShift(const SurfelSplatting::SurfelCloud& surfels, const KdTreeOrder& order)
  {
    SurfelGeometry::ReadOrigin(this->Input, this->Origin);
    if (!surfels.PositionsDouble)
    {
      return;
    }
    vtkBoundingBox box;
    double largest = 0.0;
    for (const std::uint32_t surfel : order.Surfels)
    {
      const SurfelSplatting::Vector3 p = surfels.Position(surfel);
      box.AddPoint(p[0], p[1], p[2]);
      largest =
        std::fmax(largest, std::fmax(std::abs(p[0]), std::fmax(std::abs(p[1]), std::abs(p[2]))));
    }
    if (box.IsValid() && largest > SurfelGeometry::LocalOriginRatio * box.GetDiagonalLength())
    {
      double center[3];
      box.GetCenter(center);
      for (int i = 0; i < 3; ++i)
      {
        this->Shift[i] = static_cast<float>(center[i]);
      }
    }
  }

  void PlaceLeaves(const SurfelSplatting::SurfelCloud& surfels, const KdTreeOrder& order,
    const SurfelSplatting::Executor& executor, vtkPolyData* output)
  {
    vtkNew<vtkPoints> points;
    points->SetDataTypeToFloat();
    points->SetNumberOfPoints(static_cast<vtkIdType>(order.Surfels.size()));
    output->SetPoints(points);
    float* positions = vtkFloatArray::SafeDownCast(points->GetData())->GetPointer(0);
    executor.For(order.Surfels.size(), Grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
      {
        const SurfelSplatting::Vector3 p = surfels.Position(order.Surfels[i]);
        for (int c = 0; c < 3; ++c)
        {
          positions[3 * i + c] = static_cast<float>(p[c] - this->Shift[c]);
        }
      }
    });
  }

  void AddNodes(const SurfelSplatting::Executor& executor, vtkPolyData* output)
  {
    using SurfelSplatting::HierarchyNode;
    const auto nodes = SurfelGeometry::MakeArray<vtkUnsignedCharArray>(Arrays::Nodes,
      sizeof(HierarchyNode), static_cast<vtkIdType>(this->Layout.NumberOfInnerNodes()));
    SurfelSplatting::SurfelCloudSource leaves;
    SetSurfels(output, leaves);
    SurfelSplatting::FillNodes(
      leaves.Cloud, this->Layout, executor, reinterpret_cast<HierarchyNode*>(nodes->GetPointer(0)));
    output->GetFieldData()->AddArray(nodes);
    SurfelSplatting::NoteSources(output);
  }

  void AddFieldData(vtkPolyData* output)
  {
    output->GetFieldData()->ShallowCopy(this->Input->GetFieldData());
    for (const char* ofAnother : Arrays::Computed)
    {
      output->GetFieldData()->RemoveArray(ofAnother);
    }
    const auto leaves = SurfelGeometry::MakeArray<vtkIdTypeArray>(Arrays::Leaves, 2, 1);
    for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
    {
      leaves->SetComponent(0, tree, static_cast<double>(this->Layout.NumberOfLeaves(tree)));
    }
    output->GetFieldData()->AddArray(leaves);
    const auto origin = SurfelGeometry::MakeArray<vtkDoubleArray>(Arrays::Origin, 3, 1);
    for (int i = 0; i < 3; ++i)
    {
      origin->SetComponent(0, i, this->Origin[i] + this->Shift[i]);
    }
    output->GetFieldData()->AddArray(origin);
  }

  vtkSurfelHierarchy* Self;
  vtkPolyData* Input;
  double Origin[3] = { 0, 0, 0 };
  SurfelSplatting::Vector3 Shift{ 0, 0, 0 };
};

//------------------------------------------------------------------------------
vtkSurfelHierarchy::vtkSurfelHierarchy() = default;
vtkSurfelHierarchy::~vtkSurfelHierarchy() = default;

//------------------------------------------------------------------------------
std::string vtkSurfelHierarchy::CheckInput(vtkPolyData* input)
{
  const std::string problem = SurfelSplatting::CheckSurfels(input);
  if (!problem.empty())
  {
    return problem;
  }
  const std::string moves = CheckMoves(input);
  if (!moves.empty())
  {
    return moves;
  }
  if (input->GetNumberOfPoints() >
    static_cast<vtkIdType>(std::numeric_limits<std::uint32_t>::max()))
  {
    return "The input has " + std::to_string(input->GetNumberOfPoints()) +
      " surfels; a hierarchy takes up to " +
      std::to_string(std::numeric_limits<std::uint32_t>::max()) + ". Split the cloud.";
  }
  return CheckMemory(input->GetNumberOfPoints(), false);
}

//------------------------------------------------------------------------------
void vtkSurfelHierarchy::ReadOrigin(vtkPointSet* surfels, double origin[3])
{
  SurfelGeometry::ReadOrigin(surfels, origin);
}

//------------------------------------------------------------------------------
std::string vtkSurfelHierarchy::CheckMemory(vtkIdType surfels, bool withSurfels)
{
  const double bytes = withSurfels
    ? BytesPerSurfel + std::max(BytesPerSurfel + BytesOfWork, BytesPerNode)
    : BytesPerSurfel + BytesPerNode;
  return SurfelGeometry::CheckMemory(surfels, bytes, SurfelGeometry::AvailableMemory());
}

//------------------------------------------------------------------------------
int vtkSurfelHierarchy::RequestData(vtkInformation* vtkNotUsed(request),
  vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  return this->Execute(vtkPolyData::GetData(inputVector[0]), vtkPolyData::GetData(outputVector));
}

//------------------------------------------------------------------------------
int vtkSurfelHierarchy::Execute(vtkPolyData* input, vtkPolyData* output)
{
  this->NumberOfLeaves = this->NumberOfNodes = this->NumberOfInvalidSurfels = 0;
  this->NumberOfLevels = 0;
  const std::string problem = CheckInput(input);
  if (!problem.empty())
  {
    vtkErrorMacro(<< problem);
    return 0;
  }
  try
  {
    const auto fitting = SurfelGeometry::WithFittingArrays(input, this);
    Execution execution(this, vtkPolyData::SafeDownCast(fitting));
    if (!execution.Run(output))
    {
      output->Initialize();
      return 1; // stopped by the user
    }
    this->NumberOfLeaves = static_cast<vtkIdType>(execution.Layout.NumberOfLeaves());
    this->NumberOfNodes = static_cast<vtkIdType>(execution.Layout.NumberOfNodes());
    this->NumberOfLevels = execution.Layout.NumberOfLevels();
    this->NumberOfInvalidSurfels = static_cast<vtkIdType>(execution.NumberOfInvalidSurfels);
  }
  catch (const std::bad_alloc&)
  {
    output->Initialize();
    vtkErrorMacro("There is too little memory for the hierarchy of "
      << input->GetNumberOfPoints() << " surfels, which takes about "
      << BytesPerSurfel + BytesPerNode << " bytes each. Use fewer points.");
    return 0;
  }
  const std::string message = SurfelGeometry::ListCounts(
    { { this->NumberOfInvalidSurfels, "surfel", "left out, with values that are not finite" } });
  if (!message.empty())
  {
    vtkWarningMacro(<< message << '.');
  }
  this->UpdateProgress(1.0);
  return 1;
}

//------------------------------------------------------------------------------
void vtkSurfelHierarchy::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "NumberOfLeaves: " << this->NumberOfLeaves << "\n";
  os << indent << "NumberOfNodes: " << this->NumberOfNodes << "\n";
  os << indent << "NumberOfLevels: " << this->NumberOfLevels << "\n";
  os << indent << "NumberOfInvalidSurfels: " << this->NumberOfInvalidSurfels << "\n";
}
