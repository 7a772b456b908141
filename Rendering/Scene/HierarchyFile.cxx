// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/HierarchyFile.h"

#include "Core/Files/ArrayFileWriter.h"
#include "Core/Hierarchy/ClusterBounds.h"
#include "Core/Hierarchy/HierarchyBuilder.h"
#include "Core/Hierarchy/KdTreeOrder.h"
#include "Core/Hierarchy/LeafPlacement.h"
#include "Core/Hierarchy/NodeCheck.h"
#include "Core/Hierarchy/NodeColors.h"
#include "Core/Hierarchy/SheetOverlap.h"
#include "Core/Surfels/SurfelArrays.h"
#include "Core/Surfels/SurfelSamples.h"
#include "Rendering/Scene/CloudAdapter.h"
#include "Rendering/Scene/MappedArrays.h"
#include "Rendering/Scene/SurfelBounds.h"
#include "SurfelData/HierarchyArrays.h"

#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <vector>

namespace SurfelSplatting
{
namespace
{
constexpr std::size_t Grain = 16384;
constexpr int None = -1;
constexpr vtkIdType MostSurfels = std::numeric_limits<std::uint32_t>::max();

bool AreColors(vtkDataArray* array)
{
  return array && array->GetDataType() == VTK_UNSIGNED_CHAR &&
    (array->GetNumberOfComponents() == 3 || array->GetNumberOfComponents() == 4);
}

bool IsComputed(const char* name)
{
  return std::any_of(std::begin(Arrays::Computed), std::end(Arrays::Computed),
    [name](const char* computed) { return std::strcmp(computed, name) == 0; });
}

/// Which arrays a file gets, and where their values come from.
class Contents
{
public:
  /// @param order of surfels without a hierarchy; null: the input is one
  Contents(vtkPolyData* input, const KdTreeOrder* order)
    : Input(input)
    , Order(order)
    , Layout(order ? order->Layout : ReadLayout(input))
  {
    this->AddPointArrays();
    this->AddFieldArrays();
    this->AddComputedArrays();
  }

  void Write(const std::string& path, const Executor& executor) const;

private:
  /// Returns its number.
  int Add(
    const char* name, ArrayRole role, ArrayType type, std::size_t components, std::uint64_t tuples);
  int AddCopy(vtkDataArray* array, ArrayRole role, const char* name = nullptr);
  void AddPointArrays();
  void AddFieldArrays();
  void AddComputedArrays();

  void CopyArrays(ArrayFileWriter& file, const Executor& executor) const;
  void CopyColors(const Executor& executor, unsigned char* to) const;
  SurfelCloud CloudIn(ArrayFileWriter& file) const;
  void FillSamples(const SurfelCloud& cloud, float* samples) const;

  /// The input's surfel that becomes leaf i.
  std::size_t Surfel(std::size_t i) const { return this->Order ? this->Order->Surfels[i] : i; }

  vtkPolyData* Input;
  const KdTreeOrder* Order;
  HierarchyLayout Layout;
  std::vector<StoredArray> Stored;
  std::vector<vtkSmartPointer<vtkDataArray>> Sources; ///< null: not a copy
  int Positions = None, Covariances = None, AreaVectors = None, TwoSided = None, Overlaps = None,
      Opacities = None, Leaves = None, Nodes = None, Colors = None, NodeColors = None,
      Clusters = None, Extents = None, Samples = None, Bounds = None;
};

int Contents::Add(
  const char* name, ArrayRole role, ArrayType type, std::size_t components, std::uint64_t tuples)
{
  StoredArray stored;
  stored.Name = name ? name : "unnamed";
  stored.Role = role;
  stored.Type = type;
  stored.Components = static_cast<std::uint32_t>(components);
  stored.Tuples = tuples;
  this->Stored.push_back(stored);
  this->Sources.emplace_back();
  return static_cast<int>(this->Stored.size()) - 1;
}

/// Returns None for arrays that files cannot hold.
int Contents::AddCopy(vtkDataArray* array, ArrayRole role, const char* name)
{
  ArrayType type;
  if (!IsStorable(array) || !FindStoredType(array, type))
  {
    return None;
  }
  name = name ? name : array->GetName();
  const auto components = static_cast<std::size_t>(array->GetNumberOfComponents());
  const auto tuples = static_cast<std::uint64_t>(array->GetNumberOfTuples());
  // Surfels with values that are not finite are no leaves.
  const int number = this->Add(name, role, type, components,
    role == ArrayRole::FieldData ? tuples : this->Layout.NumberOfLeaves());
  this->Sources.back() = AsType(array, array->GetDataType());
  return number;
}

void Contents::AddPointArrays()
{
  vtkDataArray* points = this->Input->GetPoints()->GetData();
  const bool areReal = points->GetDataType() == VTK_FLOAT || points->GetDataType() == VTK_DOUBLE;
  this->Positions = this->AddCopy(
    AsType(points, areReal ? points->GetDataType() : VTK_FLOAT), ArrayRole::Points, "Points");
  vtkPointData* data = this->Input->GetPointData();
  const struct
  {
    const char* Name;
    int Type;
    int& Number;
  } ofSurfels[] = { { Arrays::Covariance, VTK_FLOAT, this->Covariances },
    { Arrays::AreaVector, VTK_FLOAT, this->AreaVectors },
    { Arrays::TwoSided, VTK_UNSIGNED_CHAR, this->TwoSided },
    { Arrays::Overlap, VTK_UNSIGNED_CHAR, this->Overlaps },
    { Arrays::Opacity, VTK_FLOAT, this->Opacities } };
  for (int i = 0; i < data->GetNumberOfArrays(); ++i)
  {
    vtkDataArray* array = data->GetArray(i);
    if (!array || array->GetNumberOfTuples() != this->Input->GetNumberOfPoints())
    {
      continue; // strings, or not one tuple per point
    }
    const auto* known =
      std::find_if(std::begin(ofSurfels), std::end(ofSurfels), [array](const auto& one) {
        return array->GetName() && std::strcmp(one.Name, array->GetName()) == 0;
      });
    if (known != std::end(ofSurfels))
    {
      known->Number = this->AddCopy(AsType(array, known->Type), ArrayRole::PointData);
    }
    else if (array == data->GetScalars() && AreColors(array))
    {
      this->Colors = this->Add(
        array->GetName(), ArrayRole::Scalars, ArrayType::UInt8, 4, this->Layout.NumberOfLeaves());
    }
    else
    {
      this->AddCopy(array,
        array == data->GetScalars()     ? ArrayRole::Scalars
          : array == data->GetNormals() ? ArrayRole::Normals
                                        : ArrayRole::PointData);
    }
  }
}

void Contents::AddFieldArrays()
{
  vtkFieldData* data = this->Input->GetFieldData();
  for (int i = 0; i < data->GetNumberOfArrays(); ++i)
  {
    vtkDataArray* array = data->GetArray(i);
    const bool isOfAnother = this->Order && array && array->GetName() &&
      (std::strcmp(array->GetName(), Arrays::Nodes) == 0 ||
        std::strcmp(array->GetName(), Arrays::Leaves) == 0);
    if (array && array->GetName() && !IsComputed(array->GetName()) && !isOfAnother)
    {
      const int number = this->AddCopy(array, ArrayRole::FieldData);
      this->Nodes = std::strcmp(array->GetName(), Arrays::Nodes) == 0 ? number : this->Nodes;
    }
  }
  if (this->Order)
  {
    this->Leaves = this->Add(
      Arrays::Leaves, ArrayRole::FieldData, ArrayType::Int64, HierarchyLayout::NumberOfTrees, 1);
    this->Nodes = this->Add(Arrays::Nodes, ArrayRole::FieldData, ArrayType::UInt8,
      sizeof(HierarchyNode), this->Layout.NumberOfInnerNodes());
  }
}

/// Behind all others: vtkSurfelHierarchyReader gives them a later time.
void Contents::AddComputedArrays()
{
  constexpr ArrayType bytes = ArrayType::UInt8;
  const auto add = [this](const char* name, ArrayType type, std::size_t components,
                     std::uint64_t tuples) {
    return this->Add(name, ArrayRole::FieldData, type, components, tuples);
  };
  const std::uint64_t leaves = this->Layout.NumberOfLeaves();
  const std::uint64_t entries = ClusterBounds::NumberOfEntries(this->Layout);
  this->Clusters = add(Arrays::Clusters, bytes, sizeof(ClusterBounds::Node), entries);
  this->Extents =
    add(Arrays::Extents, bytes, ClusterBounds::LevelsBelow * sizeof(NodeExtent), entries);
  if (this->Colors != None)
  {
    this->NodeColors =
      add(Arrays::NodeColors, bytes, sizeof(NodeColor), this->Layout.NumberOfInnerNodes());
  }
  if (leaves > SampleCount)
  {
    constexpr std::size_t floats = 13;
    this->Samples =
      add(Arrays::Samples, ArrayType::Float32, floats, NumberOfSamples(leaves, SampleCount));
  }
  this->Bounds = add(Arrays::Bounds, ArrayType::Float64, 6, 1);
}

/// RGB to RGBA, as the mapper would.
void Contents::CopyColors(const Executor& executor, unsigned char* to) const
{
  const vtkSmartPointer<vtkDataArray> colors =
    AsType(this->Input->GetPointData()->GetScalars(), VTK_UNSIGNED_CHAR);
  const auto* from = static_cast<const unsigned char*>(colors->GetVoidPointer(0));
  const auto components = static_cast<std::size_t>(colors->GetNumberOfComponents());
  executor.For(this->Layout.NumberOfLeaves(), Grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      to[4 * i + 3] = 255;
      std::copy_n(from + components * this->Surfel(i), components, to + 4 * i);
    }
  });
}

/// Copies what is in the input; the leaves in the order of the tree.
void Contents::CopyArrays(ArrayFileWriter& file, const Executor& executor) const
{
  for (std::size_t array = 0; array < this->Stored.size(); ++array)
  {
    if (!this->Sources[array])
    {
      continue;
    }
    const StoredArray& stored = this->Stored[array];
    const bool isOrdered = this->Order && stored.Role != ArrayRole::FieldData;
    const std::size_t size = SizeOf(stored.Type) * stored.Components;
    const auto* from = static_cast<const unsigned char*>(this->Sources[array]->GetVoidPointer(0));
    auto* to = file.Data<unsigned char>(array);
    executor.For(stored.Tuples, Grain, [&](std::size_t begin, std::size_t end) {
      if (!isOrdered)
      {
        std::memcpy(to + size * begin, from + size * begin, size * (end - begin));
        return;
      }
      for (std::size_t i = begin; i < end; ++i)
      {
        std::memcpy(to + size * i, from + size * this->Surfel(i), size);
      }
    });
  }
}

/// The hierarchy, after its arrays were copied.
SurfelCloud Contents::CloudIn(ArrayFileWriter& file) const
{
  const auto floats = [&file](
                        int array) { return array != None ? file.Data<float>(array) : nullptr; };
  const auto bytes = [&file](int array) {
    return array != None ? file.Data<unsigned char>(array) : nullptr;
  };
  SurfelCloud cloud;
  cloud.NumberOfSurfels = this->Layout.NumberOfLeaves();
  const bool areFloats = this->Stored[this->Positions].Type == ArrayType::Float32;
  cloud.PositionsFloat = areFloats ? floats(this->Positions) : nullptr;
  cloud.PositionsDouble = areFloats ? nullptr : file.Data<double>(this->Positions);
  cloud.Covariances = floats(this->Covariances);
  cloud.AreaVectors = floats(this->AreaVectors);
  cloud.TwoSided = bytes(this->TwoSided);
  cloud.Overlaps = bytes(this->Overlaps);
  cloud.Opacities = floats(this->Opacities);
  cloud.ColorsUChar = bytes(this->Colors);
  cloud.Nodes = file.Data<HierarchyNode>(this->Nodes);
  return cloud;
}

void Contents::FillSamples(const SurfelCloud& cloud, float* samples) const
{
  for (const std::size_t i : ChooseSamples(cloud, SampleCount))
  {
    const Vector3 p = cloud.Position(i);
    samples = std::copy(p.begin(), p.end(), samples);
    samples = std::copy_n(cloud.AreaVectors + 3 * i, 3, samples);
    *samples++ = cloud.IsTwoSided(i) ? 1.0f : 0.0f;
    samples = std::copy_n(cloud.Covariances + 6 * i, 6, samples);
  }
}

void Contents::Write(const std::string& path, const Executor& executor) const
{
  ArrayFileWriter file(path, this->Stored);
  this->CopyArrays(file, executor);
  if (this->Colors != None)
  {
    this->CopyColors(executor, file.Data<unsigned char>(this->Colors));
  }
  const SurfelCloud cloud = this->CloudIn(file);
  if (this->Order)
  {
    for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
    {
      file.Data<std::int64_t>(this->Leaves)[tree] =
        static_cast<std::int64_t>(this->Layout.NumberOfLeaves(tree));
    }
    FillNodes(cloud, this->Layout, executor, file.Data<HierarchyNode>(this->Nodes));
  }
  ClusterBounds::Fill(cloud, this->Layout, executor, file.Data<ClusterBounds::Node>(this->Clusters),
    file.Data<NodeExtent>(this->Extents));
  if (this->NodeColors != None)
  {
    FillNodeColors(cloud, this->Layout, FindUncovered(cloud, this->Layout, executor), executor,
      file.Data<NodeColor>(this->NodeColors));
  }
  if (this->Samples != None)
  {
    this->FillSamples(cloud, file.Data<float>(this->Samples));
  }
  if (!FindSurfelBounds(this->Input, file.Data<double>(this->Bounds)))
  {
    throw std::runtime_error("none of its surfels has finite values");
  }
  file.Finish(executor);
}

/// A hierarchy whose nodes know where the points are: the input, or if its points were translated,
/// one of which SurfelOrigin was.
vtkSmartPointer<vtkPolyData> Settled(vtkPolyData* input)
{
  SurfelCloudSource source;
  SetSurfels(input, source);
  const LeafPlacement placement = FindPlacement(input, source.Cloud);
  if (placement.Kind == LeafPlacement::None)
  {
    return input;
  }
  if (placement.Kind != LeafPlacement::Translation)
  {
    throw std::runtime_error("its points were turned, scaled or warped, and their kernels were "
                             "not; put vtkPointsToSurfels "
                             "after the filter that did so");
  }
  double origin[3];
  ReadOrigin(input, origin);
  vtkNew<vtkPoints> points;
  points->SetNumberOfPoints(input->GetNumberOfPoints());
  for (vtkIdType i = 0; i < input->GetNumberOfPoints(); ++i)
  {
    const Vector3 p = source.Cloud.Position(static_cast<std::size_t>(i));
    const Vector3& t = placement.Map.T;
    points->SetPoint(i, p[0] - t[0], p[1] - t[1], p[2] - t[2]);
  }
  vtkNew<vtkDoubleArray> moved;
  moved->SetName(Arrays::Origin);
  moved->SetNumberOfComponents(3);
  moved->InsertNextTuple3(
    origin[0] + placement.Map.T[0], origin[1] + placement.Map.T[1], origin[2] + placement.Map.T[2]);
  auto settled = vtkSmartPointer<vtkPolyData>::New();
  settled->ShallowCopy(input);
  settled->SetPoints(points);
  settled->GetFieldData()->AddArray(moved);
  return settled;
}

/// Whether the nodes of a hierarchy are still those of its surfels.
bool HasOwnNodes(vtkPolyData* input, const Executor& executor)
{
  const HierarchyLayout layout = ReadLayout(input);
  SurfelCloudSource source;
  SetSurfels(input, source);
  source.Cloud.Nodes = NodesOf(input, layout);
  return !IsOutdated(input, FindNodes(input, layout)) ||
    (AreSidesOfTrees(source.Cloud, layout) && AreNodesOfKernels(source.Cloud, layout, executor));
}
}

std::vector<std::string> ArraysLeftOut(vtkPolyData* input)
{
  std::vector<std::string> names;
  const auto add = [&names](vtkFieldData* data, vtkIdType tuples) {
    for (int i = 0; i < data->GetNumberOfArrays(); ++i)
    {
      vtkAbstractArray* array = data->GetAbstractArray(i);
      if (!IsStorable(array) || (tuples >= 0 && array->GetNumberOfTuples() != tuples))
      {
        names.emplace_back(array->GetName() ? array->GetName() : "unnamed");
      }
    }
  };
  if (input)
  {
    add(input->GetPointData(), input->GetNumberOfPoints());
    add(input->GetFieldData(), -1);
  }
  return names;
}

std::uint64_t WriteHierarchy(vtkPolyData* input, const std::string& path, const Executor& executor)
{
  std::string problem = "there are no surfels";
  if (input && input->GetNumberOfPoints() > 0)
  {
    problem = CheckStorable(input);
  }
  const bool isHierarchy = problem.empty() && IsHierarchy(input) && IsWhole(input);
  if (isHierarchy)
  {
    problem = CheckHierarchy(input);
  }
  else if (problem.empty() && input->GetNumberOfPoints() > MostSurfels)
  {
    problem = "a hierarchy takes up to " + std::to_string(MostSurfels) + " surfels";
  }
  if (!problem.empty())
  {
    throw std::runtime_error(problem);
  }
  if (isHierarchy)
  {
    const vtkSmartPointer<vtkPolyData> settled = Settled(input);
    if (HasOwnNodes(settled, executor))
    {
      Contents(settled, nullptr).Write(path, executor);
      return 0;
    }
  }
  SurfelCloudSource source;
  SetSurfels(input, source);
  const KdTreeOrder order = MakeKdTreeOrder(source.Cloud, executor);
  Contents(input, &order).Write(path, executor);
  return order.NumberOfInvalidSurfels;
}
}
