// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelHierarchy.h"

#include "HierarchyBuilder.h"
#include "LocalCloud.h"
#include "MonitoredExecutor.h"
#include "NodeAttributes.h"
#include "PointCells.h"
#include "SurfelArrays.h"
#include "SurfelInput.h"
#include "SurfelMemory.h"

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

#include <cmath>
#include <limits>
#include <new>

namespace Arrays = SurfelSplatting::Arrays;

namespace
{
/// At the filter's peak and in the first frames, its output included: 308 with the surfels were
/// measured with 50 million of them.
constexpr double BytesPerSurfel = 250.0, BytesOfSurfel = 57.0;
}
using SurfelSplatting::HierarchyLayout;
using SurfelSplatting::LeafOrder;

vtkStandardNewMacro(vtkSurfelHierarchy);

/// One execution: unpacks the arrays, builds, packs.
class vtkSurfelHierarchy::Execution
{
public:
  Execution(vtkSurfelHierarchy* self, vtkPolyData* input)
    : Self(self)
    , Input(input)
  {
    SurfelSplatting::SurfelCloud& cloud = this->Cloud;
    vtkPointData* data = input->GetPointData();
    cloud.NumberOfSurfels = static_cast<std::size_t>(input->GetNumberOfPoints());
    cloud.Covariances = this->Pointer<vtkFloatArray>(data->GetArray(Arrays::Covariance));
    cloud.AreaVectors = this->Pointer<vtkFloatArray>(data->GetArray(Arrays::AreaVector));
    cloud.TwoSided = this->Pointer<vtkUnsignedCharArray>(data->GetArray(Arrays::TwoSided));
    cloud.Opacities = this->Pointer<vtkFloatArray>(data->GetArray(Arrays::Opacity));
    if (vtkPoints* points = input->GetPoints())
    {
      if (points->GetDataType() == VTK_FLOAT)
      {
        cloud.PositionsFloat = this->Pointer<vtkFloatArray>(points->GetData());
      }
      else
      {
        cloud.PositionsDouble = this->Pointer<vtkDoubleArray>(points->GetData());
      }
    }
  }

  /// Returns false if stopped.
  bool Run(vtkPolyData* output)
  {
    const SurfelGeometry::SurfelMonitor monitor(this->Self, 0.0, 1.0);
    SurfelGeometry::MonitoredExecutor ordering(monitor.Part(0.0, 0.5));
    this->Order = OrderLeaves(this->Cloud, ordering);
    if (ordering.Stopped())
    {
      return false;
    }
    this->FindShift();
    SurfelGeometry::MonitoredExecutor filling(monitor.Part(0.5, 1.0));
    this->Fill(filling, output);
    return !filling.Stopped();
  }

  LeafOrder Order;

private:
  template <typename Array>
  typename Array::ValueType* Pointer(vtkDataArray* array)
  {
    if (!array)
    {
      return nullptr;
    }
    vtkSmartPointer<Array> typed = Array::SafeDownCast(array);
    if (!typed)
    {
      typed = vtkSmartPointer<Array>::New();
      typed->DeepCopy(array);
    }
    this->Kept.push_back(typed);
    return typed->GetPointer(0);
  }

  /// Float positions need a local origin where the cloud is far from its own.
  void FindShift()
  {
    SurfelGeometry::ReadOrigin(this->Input, this->Origin);
    if (!this->Cloud.PositionsDouble)
    {
      return;
    }
    vtkBoundingBox box;
    double largest = 0.0;
    for (const std::uint32_t surfel : this->Order.Surfels)
    {
      const SurfelSplatting::Vector3 p = this->Cloud.Position(surfel);
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

  vtkFloatArray* AddFloats(vtkPolyData* output, const char* name, int components)
  {
    vtkNew<vtkFloatArray> array;
    array->SetName(name);
    array->SetNumberOfComponents(components);
    array->SetNumberOfTuples(static_cast<vtkIdType>(this->Order.Layout.NumberOfNodes()));
    output->GetPointData()->AddArray(array);
    return array;
  }

  void Fill(const SurfelSplatting::Executor& executor, vtkPolyData* output)
  {
    vtkNew<vtkPoints> points;
    points->SetDataTypeToFloat();
    points->SetNumberOfPoints(static_cast<vtkIdType>(this->Order.Layout.NumberOfNodes()));
    output->SetPoints(points);
    SurfelSplatting::NodeArrays nodes;
    nodes.Positions = vtkFloatArray::SafeDownCast(points->GetData())->GetPointer(0);
    nodes.Covariances = this->AddFloats(output, Arrays::Covariance, 6)->GetPointer(0);
    nodes.AreaVectors = this->AddFloats(output, Arrays::AreaVector, 3)->GetPointer(0);
    nodes.LeafCovariances = this->AddFloats(output, Arrays::LeafCovariance, 6)->GetPointer(0);
    nodes.Areas = this->AddFloats(output, Arrays::Area, 1)->GetPointer(0);
    nodes.Bounds = this->AddFloats(output, Arrays::Bound, 1)->GetPointer(0);
    nodes.Cones = this->AddFloats(output, Arrays::Cone, 1)->GetPointer(0);
    if (this->Cloud.Opacities)
    {
      nodes.Opacities = this->AddFloats(output, Arrays::Opacity, 1)->GetPointer(0);
    }
    FillNodes(this->Cloud, this->Order, this->Shift, executor, nodes);
    this->AddFlags(output);
    this->AddFieldData(output);
    // The leaves alone, so that VTK's own mappers and filters see these.
    output->SetVerts(
      SurfelGeometry::MakePointCell(static_cast<vtkIdType>(this->Order.Layout.NumberOfLeaves())));
    SurfelGeometry::PassNodeAttributes(
      this->Input->GetPointData(), this->Order, nodes.Areas, executor, output->GetPointData());
  }

  /// Levels and sides, which follow from the layout.
  void AddFlags(vtkPolyData* output)
  {
    const HierarchyLayout& layout = this->Order.Layout;
    vtkNew<vtkUnsignedCharArray> levels, sides;
    levels->SetName(Arrays::Level);
    sides->SetName(Arrays::TwoSided);
    for (vtkUnsignedCharArray* array : { levels.Get(), sides.Get() })
    {
      array->SetNumberOfTuples(static_cast<vtkIdType>(layout.NumberOfNodes()));
      output->GetPointData()->AddArray(array);
    }
    for (int level = 0; level < layout.NumberOfLevels(); ++level)
    {
      for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
      {
        const std::uint64_t begin = layout.Begin(level, tree), count = layout.Count(level, tree);
        std::fill_n(levels->GetPointer(0) + begin, count, static_cast<unsigned char>(level));
        std::fill_n(sides->GetPointer(0) + begin, count,
          static_cast<unsigned char>(tree == HierarchyLayout::TwoSided ? 1 : 0));
      }
    }
  }

  void AddFieldData(vtkPolyData* output)
  {
    output->GetFieldData()->ShallowCopy(this->Input->GetFieldData());
    vtkNew<vtkIdTypeArray> leaves;
    leaves->SetName(Arrays::Leaves);
    leaves->SetNumberOfComponents(2);
    leaves->SetNumberOfTuples(1);
    for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
    {
      leaves->SetComponent(0, tree, static_cast<double>(this->Order.Layout.NumberOfLeaves(tree)));
    }
    output->GetFieldData()->AddArray(leaves);
    vtkNew<vtkDoubleArray> origin;
    origin->SetName(Arrays::Origin);
    origin->SetNumberOfComponents(3);
    origin->InsertNextTuple3(this->Origin[0] + this->Shift[0], this->Origin[1] + this->Shift[1],
      this->Origin[2] + this->Shift[2]);
    output->GetFieldData()->AddArray(origin);
  }

  vtkSurfelHierarchy* Self;
  vtkPolyData* Input;
  SurfelSplatting::SurfelCloud Cloud;
  std::vector<vtkSmartPointer<vtkDataArray>> Kept;
  double Origin[3] = { 0, 0, 0 };
  SurfelSplatting::Vector3 Shift{ 0, 0, 0 };
};

//------------------------------------------------------------------------------
vtkSurfelHierarchy::vtkSurfelHierarchy() = default;
vtkSurfelHierarchy::~vtkSurfelHierarchy() = default;

//------------------------------------------------------------------------------
std::string vtkSurfelHierarchy::CheckInput(vtkPolyData* input)
{
  const std::string problem = SurfelGeometry::CheckSurfels(input);
  if (!problem.empty())
  {
    return problem;
  }
  if (input->GetFieldData()->HasArray(Arrays::Leaves))
  {
    return std::string("The input is a hierarchy already (field array ") + Arrays::Leaves +
      "): connect its surfels instead.";
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
std::string vtkSurfelHierarchy::CheckMemory(vtkIdType surfels, bool withSurfels)
{
  return SurfelGeometry::CheckMemory(surfels, BytesPerSurfel + (withSurfels ? BytesOfSurfel : 0.0),
    SurfelGeometry::AvailableMemory());
}

//------------------------------------------------------------------------------
int vtkSurfelHierarchy::RequestData(vtkInformation* vtkNotUsed(request),
  vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  vtkPolyData* input = vtkPolyData::GetData(inputVector[0]);
  vtkPolyData* output = vtkPolyData::GetData(outputVector);
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
    Execution execution(this, input);
    if (!execution.Run(output))
    {
      output->Initialize();
      return 1; // stopped by the user
    }
    this->NumberOfLeaves = static_cast<vtkIdType>(execution.Order.Layout.NumberOfLeaves());
    this->NumberOfNodes = static_cast<vtkIdType>(execution.Order.Layout.NumberOfNodes());
    this->NumberOfLevels = execution.Order.Layout.NumberOfLevels();
    this->NumberOfInvalidSurfels = static_cast<vtkIdType>(execution.Order.NumberOfInvalidSurfels);
  }
  catch (const std::bad_alloc&)
  {
    output->Initialize();
    vtkErrorMacro("Memory does not suffice for the hierarchy of "
      << input->GetNumberOfPoints() << " surfels, about " << BytesPerSurfel
      << " bytes each. Thin the cloud out.");
    return 0;
  }
  if (this->NumberOfInvalidSurfels > 0)
  {
    vtkWarningMacro(<< this->NumberOfInvalidSurfels
                    << " surfels left out: their values are not finite.");
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
