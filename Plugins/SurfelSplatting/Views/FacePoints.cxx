// SPDX-License-Identifier: BSD-3-Clause
#include "FacePoints.h"

#include <vtkDataArray.h>
#include <vtkFloatArray.h>
#include <vtkIdList.h>
#include <vtkMath.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkTriangleFilter.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace SurfelViews
{
namespace
{
/// These are of Wrapping/Python/surfelsplatting/clouds/faces.py, which says why.
constexpr vtkIdType Samples = 200000;
constexpr vtkIdType FewVertices = Samples / 4;
constexpr double Coarse = 1.7;                // of a face, over the spacing of the vertices
constexpr double Crease = 0.8660254037844387; // cosine of 30 degrees
constexpr double Steps[2] = { 0.7548776662466927, 0.5698402909980532 }; // Roberts' R2 sequence

using Vector = std::array<double, 3>;

struct Triangle
{
  std::array<vtkIdType, 3> Corners;
  Vector Normal; // unit length
  double Area;
};

/// A place on a triangle.
struct Sample
{
  const Triangle* On;
  std::array<double, 3> Weights; // of the corners; their sum is 1

  vtkIdType NearestCorner() const
  {
    const auto largest = std::max_element(this->Weights.begin(), this->Weights.end());
    return this->On->Corners[static_cast<std::size_t>(largest - this->Weights.begin())];
  }
};

/// Those that have an area.
std::vector<Triangle> TrianglesOf(vtkPolyData* mesh)
{
  vtkNew<vtkTriangleFilter> split;
  split->PassVertsOff();
  split->PassLinesOff();
  split->SetInputData(mesh);
  split->Update();
  vtkPolyData* faces = split->GetOutput();
  std::vector<Triangle> triangles;
  vtkNew<vtkIdList> ids;
  for (vtkIdType cell = 0; cell < faces->GetNumberOfCells(); ++cell)
  {
    faces->GetCellPoints(cell, ids);
    if (ids->GetNumberOfIds() != 3)
    {
      continue;
    }
    Triangle triangle{ { ids->GetId(0), ids->GetId(1), ids->GetId(2) }, {}, 0.0 };
    Vector place[3], along[2];
    for (int c = 0; c < 3; ++c)
    {
      faces->GetPoint(ids->GetId(c), place[c].data());
    }
    vtkMath::Subtract(place[1].data(), place[0].data(), along[0].data());
    vtkMath::Subtract(place[2].data(), place[0].data(), along[1].data());
    vtkMath::Cross(along[0].data(), along[1].data(), triangle.Normal.data());
    triangle.Area = 0.5 * vtkMath::Normalize(triangle.Normal.data());
    if (triangle.Area > 0.0 && std::isfinite(triangle.Area))
    {
      triangles.push_back(triangle);
    }
  }
  return triangles;
}

double TotalArea(const std::vector<Triangle>& triangles)
{
  double area = 0.0;
  for (const Triangle& triangle : triangles)
  {
    area += triangle.Area;
  }
  return area;
}

/// The area of the face in the middle of the whole area.
double MiddleArea(const std::vector<Triangle>& triangles, double total)
{
  std::vector<double> areas;
  for (const Triangle& triangle : triangles)
  {
    areas.push_back(triangle.Area);
  }
  std::sort(areas.begin(), areas.end());
  double sum = 0.0;
  const auto middle = std::find_if(areas.begin(), areas.end(), [&sum, total](double area) {
    sum += area;
    return sum >= 0.5 * total;
  });
  return middle == areas.end() ? areas.back() : *middle;
}

/// Whether the vertices are enough, and evenly spread.
bool TellSurface(const std::vector<Triangle>& triangles, double total, vtkIdType points)
{
  std::vector<bool> isUsed(static_cast<std::size_t>(points));
  for (const Triangle& triangle : triangles)
  {
    for (vtkIdType corner : triangle.Corners)
    {
      isUsed[static_cast<std::size_t>(corner)] = true;
    }
  }
  const vtkIdType count = std::count(isUsed.begin(), isUsed.end(), true);
  if (count < points / 2)
  {
    return true; // a cloud with a few faces
  }
  const double coarseness = std::sqrt(MiddleArea(triangles, total) / total * count);
  return count >= FewVertices && coarseness <= Coarse;
}

/// Evenly by area: of points that fill parallelograms the halves that fill the triangles.
std::vector<Sample> Spread(const std::vector<Triangle>& triangles, double total, vtkIdType count)
{
  std::vector<Sample> samples;
  std::size_t t = 0;
  double end = triangles[0].Area;
  for (vtkIdType i = 0; i < 2 * count; ++i)
  {
    const double number = static_cast<double>(i);
    const double place = (number + 0.5) / (2.0 * static_cast<double>(count)) * total;
    while (place > end && t + 1 < triangles.size())
    {
      end += triangles[++t].Area;
    }
    const double second = std::fmod(number * Steps[0], 1.0),
                 third = std::fmod(number * Steps[1], 1.0);
    if (second + third <= 1.0)
    {
      samples.push_back({ &triangles[t], { 1.0 - second - third, second, third } });
    }
  }
  return samples;
}

void Interpolate(vtkDataArray* from, const Sample& sample, vtkIdType to, vtkDataArray* array)
{
  vtkNew<vtkIdList> ids;
  for (vtkIdType corner : sample.On->Corners)
  {
    ids->InsertNextId(corner);
  }
  std::array<double, 3> weights = sample.Weights;
  array->InterpolateTuple(to, ids, from, weights.data());
}

/// Whether values between those of the corners mean anything.
bool IsSmooth(vtkDataArray* array)
{
  const int type = array->GetDataType(), components = array->GetNumberOfComponents();
  return type == VTK_FLOAT || type == VTK_DOUBLE ||
    (type == VTK_UNSIGNED_CHAR && (components == 3 || components == 4));
}

/// Of corners whose normal leans on the face by more than a crease, as means over edges do, that of
/// the face.
Vector NormalAt(const Sample& sample, vtkDataArray* normals)
{
  Vector given[3], sum = { 0.0, 0.0, 0.0 }, face = sample.On->Normal;
  for (int c = 0; c < 3; ++c)
  {
    normals->GetTuple(sample.On->Corners[static_cast<std::size_t>(c)], given[c].data());
    vtkMath::Normalize(given[c].data());
    vtkMath::Add(sum.data(), given[c].data(), sum.data());
  }
  if (vtkMath::Dot(sum.data(), face.data()) < 0.0)
  {
    vtkMath::MultiplyScalar(face.data(), -1.0);
  }
  Vector mixed = { 0.0, 0.0, 0.0 };
  for (int c = 0; c < 3; ++c)
  {
    const bool isNear = vtkMath::Dot(given[c].data(), face.data()) > Crease;
    for (std::size_t k = 0; k < 3; ++k)
    {
      mixed[k] += sample.Weights[static_cast<std::size_t>(c)] * (isNear ? given[c][k] : face[k]);
    }
  }
  vtkMath::Normalize(mixed.data());
  return mixed;
}

vtkSmartPointer<vtkDataArray> NormalsOf(const std::vector<Sample>& samples, vtkDataArray* normals)
{
  auto result = vtkSmartPointer<vtkFloatArray>::New();
  result->SetName(normals->GetName());
  result->SetNumberOfComponents(3);
  for (const Sample& sample : samples)
  {
    result->InsertNextTuple(NormalAt(sample, normals).data());
  }
  return result;
}

vtkSmartPointer<vtkDataArray> ValuesOf(const std::vector<Sample>& samples, vtkDataArray* from)
{
  auto result = vtkSmartPointer<vtkDataArray>::Take(from->NewInstance());
  result->SetName(from->GetName());
  result->SetNumberOfComponents(from->GetNumberOfComponents());
  result->SetNumberOfTuples(static_cast<vtkIdType>(samples.size()));
  const bool isSmooth = IsSmooth(from);
  for (std::size_t i = 0; i < samples.size(); ++i)
  {
    if (isSmooth)
    {
      Interpolate(from, samples[i], static_cast<vtkIdType>(i), result);
    }
    else
    {
      result->SetTuple(static_cast<vtkIdType>(i), samples[i].NearestCorner(), from);
    }
  }
  return result;
}

vtkSmartPointer<vtkPolyData> MakePoints(vtkPolyData* mesh, const std::vector<Sample>& samples)
{
  auto result = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  points->SetData(ValuesOf(samples, mesh->GetPoints()->GetData()));
  result->SetPoints(points);
  result->GetFieldData()->ShallowCopy(mesh->GetFieldData());
  vtkPointData *from = mesh->GetPointData(), *to = result->GetPointData();
  for (int i = 0; i < from->GetNumberOfArrays(); ++i)
  {
    vtkDataArray* array = from->GetArray(i);
    if (array && array != from->GetNormals())
    {
      to->AddArray(ValuesOf(samples, array));
    }
  }
  if (vtkDataArray* normals = from->GetNormals())
  {
    to->SetNormals(NormalsOf(samples, normals));
  }
  if (vtkDataArray* scalars = from->GetScalars())
  {
    to->SetActiveScalars(scalars->GetName());
  }
  return result;
}
}

vtkSmartPointer<vtkPolyData> PointsOnFaces(vtkPolyData* mesh)
{
  const vtkIdType count = mesh->GetNumberOfPoints();
  if (count == 0 || count > Samples || mesh->GetNumberOfPolys() + mesh->GetNumberOfStrips() == 0)
  {
    return mesh;
  }
  const std::vector<Triangle> triangles = TrianglesOf(mesh);
  const double total = TotalArea(triangles);
  if (triangles.empty() || !std::isfinite(total) || TellSurface(triangles, total, count))
  {
    return mesh;
  }
  return MakePoints(mesh, Spread(triangles, total, Samples));
}
}
