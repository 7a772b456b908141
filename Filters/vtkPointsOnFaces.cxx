// SPDX-License-Identifier: BSD-3-Clause
#include "vtkPointsOnFaces.h"

#include "Filters/Arrays/InputArrays.h"
#include "Filters/Common/FaceLimit.h"
#include "Filters/Meshes/FaceSamples.h"
#include "Filters/Meshes/MeshParts.h"
#include "Filters/Meshes/MeshTriangles.h"

#include "vtkCellArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkIdTypeArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkPolyDataNormals.h"

#include <algorithm>
#include <cmath>
#include <vector>

using namespace SurfelGeometry;

namespace
{
/// Fewer are 4 px apart in a picture of 800 x 600 px, or 6 px where half of them are inside: fins,
/// fingers and clothes are ragged, and neighbours across a gap are one.
constexpr vtkIdType FewVertices = 50000;

constexpr vtkIdType ModelVertices = 20000; // modelling programs make fewer

/// See Coarseness(). If half of the area lies in faces above, it has hardly any points. Scans,
/// sculptures and characters are at 1.6 at most; cars, rooms and CAD at 1.8 to 12.
constexpr double Coarse = 1.7;
}

vtkStandardNewMacro(vtkPointsOnFaces);

//------------------------------------------------------------------------------
class vtkPointsOnFaces::Execution
{
public:
  explicit Execution(vtkPolyData* mesh)
    : Mesh(mesh)
    , Vertices(mesh->GetNumberOfPoints())
    , Positions(PositionsOf(mesh->GetPoints()))
    , Triangles(TrianglesOf(mesh, this->Positions))
    , Placed(PlaceCorners(this->Triangles, this->Positions))
  {
  }

  /// Whether it has a surface, and not only a few faces in a cloud.
  bool IsMesh() const
  {
    return !this->Triangles.empty() && std::isfinite(TotalArea(this->Triangles)) &&
      2 * this->Placed.Points >= this->Vertices;
  }

  void Judge(int& lack, bool& isModel) const
  {
    const bool isLarge = this->Placed.Points >= ModelVertices;
    const vtkIdType count = isLarge ? this->Placed.Places : this->Placed.Points;
    const bool isCoarse = Coarseness(this->Triangles, count) > Coarse;
    lack = count < FewVertices ? TOO_FEW_VERTICES : isCoarse ? TOO_UNEVEN_VERTICES : NO_LACK;
    isModel = count < ModelVertices || isCoarse;
  }

  /// Smooth but for creases, whose vertices are repeated; if the faces agree on their sides.
  void MakeNormals()
  {
    if (NormalsOfMesh(this->Mesh) || !HaveSides(this->Placed.Triangles))
    {
      return;
    }
    vtkNew<vtkCellArray> cells;
    for (const MeshTriangle& triangle : this->Triangles)
    {
      cells->InsertNextCell(3, triangle.Corners.data());
    }
    vtkNew<vtkPolyData> mesh;
    mesh->SetPoints(this->Mesh->GetPoints());
    mesh->GetPointData()->ShallowCopy(this->Mesh->GetPointData());
    mesh->GetFieldData()->ShallowCopy(this->Mesh->GetFieldData());
    mesh->SetPolys(cells);
    vtkNew<vtkPolyDataNormals> smooth;
    smooth->SetInputData(mesh);
    smooth->SetFeatureAngle(CreaseAngle);
    smooth->ConsistencyOff();
    smooth->Update();
    this->Mesh = smooth->GetOutput();
    this->Positions = PositionsOf(this->Mesh->GetPoints());
    this->Triangles = TrianglesOf(this->Mesh, this->Positions);
  }

  /// Returns the parts on which the points are, or null.
  vtkSmartPointer<vtkIdTypeArray> Sample(vtkIdType count, vtkPolyData* output) const
  {
    vtkDataArray* normals = NormalsOfMesh(this->Mesh);
    const std::vector<int> parts = normals ? this->FindPartsBy(normals) : std::vector<int>();
    const std::vector<FaceSample> samples =
      SpreadSamples(this->Triangles, this->Positions, parts, std::max(count, this->Vertices));
    InterpolateSamples(this->Mesh, this->Triangles, samples, normals, output);
    if (!normals)
    {
      return nullptr;
    }
    const auto ofFaces = MakeArray<vtkDoubleArray>(FacesArray, 1, 1);
    ofFaces->SetValue(0, 1.0);
    output->GetFieldData()->AddArray(ofFaces);
    auto numbers = vtkSmartPointer<vtkIdTypeArray>::New();
    numbers->SetNumberOfValues(static_cast<vtkIdType>(samples.size()));
    std::transform(samples.begin(), samples.end(), numbers->GetPointer(0),
      [&parts](const FaceSample& sample) { return parts[sample.Triangle]; });
    return numbers;
  }

private:
  /// Of faces whose normals agree on their sides, as well.
  std::vector<int> FindPartsBy(vtkDataArray* normals) const
  {
    std::vector<Corners> corners = this->Placed.Triangles;
    for (std::size_t t = 0; AreVectors(normals) && t < corners.size(); ++t)
    {
      if (IsTurned(this->Triangles[t], normals))
      {
        std::swap(corners[t][0], corners[t][2]);
      }
    }
    return FindParts(corners);
  }

  vtkSmartPointer<vtkPolyData> Mesh;
  vtkIdType Vertices; // of the input; MakeNormals repeats some
  std::vector<Vector3> Positions;
  std::vector<MeshTriangle> Triangles;
  PlacedCorners Placed;
};

//------------------------------------------------------------------------------
vtkPointsOnFaces::vtkPointsOnFaces() = default;
vtkPointsOnFaces::~vtkPointsOnFaces() = default;

//------------------------------------------------------------------------------
vtkIdType vtkPointsOnFaces::GetMaximumNumberOfVertices()
{
  return MostVerticesOfFaces;
}

//------------------------------------------------------------------------------
vtkIdTypeArray* vtkPointsOnFaces::GetParts()
{
  return this->Parts;
}

//------------------------------------------------------------------------------
int vtkPointsOnFaces::RequestData(vtkInformation* vtkNotUsed(request),
  vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  const auto fitting = WithFittingArrays(vtkPolyData::GetData(inputVector[0]), this);
  vtkPolyData* mesh = vtkPolyData::SafeDownCast(fitting);
  vtkPolyData* output = vtkPolyData::GetData(outputVector);
  this->Lack = NO_LACK;
  this->IsModel = false;
  this->Parts = nullptr;
  output->ShallowCopy(mesh);
  const vtkIdType count = mesh->GetNumberOfPoints();
  if (count == 0 || count > GetMaximumNumberOfVertices() ||
    mesh->GetNumberOfPolys() + mesh->GetNumberOfStrips() == 0)
  {
    return 1;
  }
  Execution execution(mesh);
  if (execution.IsMesh())
  {
    execution.Judge(this->Lack, this->IsModel);
  }
  if (this->Lack != NO_LACK)
  {
    output->Initialize();
    if (this->MakeNormals)
    {
      execution.MakeNormals();
    }
    this->Parts = execution.Sample(this->NumberOfPoints, output);
  }
  return 1;
}

//------------------------------------------------------------------------------
void vtkPointsOnFaces::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "NumberOfPoints: " << this->NumberOfPoints << "\n";
  os << indent << "MakeNormals: " << this->MakeNormals << "\n";
  os << indent << "Lack: " << this->Lack << "\n";
  os << indent << "IsModel: " << this->IsModel << "\n";
  os << indent << "Parts: " << this->Parts.Get() << "\n";
}
