// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Meshes/MeshTriangles.h"

#include "vtkCellArray.h"
#include "vtkIdTypeArray.h"
#include "vtkNew.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkTriangleFilter.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace SurfelGeometry
{
namespace
{
using PointIds = std::array<vtkIdType, 3>;

/// Cells as they are stored. VTK's own iterators trust damaged ones.
class StoredCells
{
public:
  explicit StoredCells(vtkCellArray* cells)
  {
    // Newer versions of VTK have arrays that are formulas.
    this->Points->DeepCopy(cells->GetConnectivityArray());
    this->Ends->DeepCopy(cells->GetOffsetsArray());
    const vtkIdType ends = this->Ends->GetNumberOfValues();
    const vtkIdType* end = this->Ends->GetPointer(0);
    if (ends > 1 && end[0] >= 0 && end[ends - 1] <= this->Points->GetNumberOfValues() &&
      std::is_sorted(end, end + ends))
    {
      this->Count = ends - 1;
    }
  }

  vtkIdType Size() const { return this->Count; }
  vtkIdType SizeOf(vtkIdType cell) const
  {
    return this->Ends->GetValue(cell + 1) - this->Ends->GetValue(cell);
  }
  const vtkIdType* Of(vtkIdType cell) const
  {
    return this->Points->GetPointer(this->Ends->GetValue(cell));
  }

private:
  vtkNew<vtkIdTypeArray> Points, Ends;
  vtkIdType Count = 0;
};

bool IsFinite(const Vector3& a)
{
  return std::isfinite(a[0]) && std::isfinite(a[1]) && std::isfinite(a[2]);
}

bool AreFinite(const vtkIdType* ids, vtkIdType count, const std::vector<Vector3>& positions)
{
  const auto points = static_cast<vtkIdType>(positions.size());
  return std::all_of(ids, ids + count,
    [&](vtkIdType id) { return id >= 0 && id < points && IsFinite(positions[id]); });
}

/// Appends the triangles of polygons with more corners.
void SplitPolygons(vtkPoints* points, vtkCellArray* polygons, std::vector<PointIds>& triangles)
{
  vtkNew<vtkPolyData> mesh;
  mesh->SetPoints(points);
  mesh->SetPolys(polygons);
  vtkNew<vtkTriangleFilter> split;
  split->SetInputData(mesh);
  split->Update();
  const StoredCells cells(split->GetOutput()->GetPolys());
  for (vtkIdType cell = 0; cell < cells.Size(); ++cell)
  {
    const vtkIdType* ids = cells.Of(cell);
    triangles.push_back({ ids[0], ids[1], ids[2] });
  }
}

void AppendPolygons(
  vtkPolyData* mesh, const std::vector<Vector3>& positions, std::vector<PointIds>& triangles)
{
  const StoredCells cells(mesh->GetPolys());
  vtkNew<vtkCellArray> larger;
  for (vtkIdType cell = 0; cell < cells.Size(); ++cell)
  {
    const vtkIdType size = cells.SizeOf(cell);
    const vtkIdType* ids = cells.Of(cell);
    if (size < 3 || !AreFinite(ids, size, positions))
    {
      continue;
    }
    if (size == 3)
    {
      triangles.push_back({ ids[0], ids[1], ids[2] });
    }
    else
    {
      larger->InsertNextCell(size, ids);
    }
  }
  if (larger->GetNumberOfCells() > 0)
  {
    SplitPolygons(mesh->GetPoints(), larger, triangles);
  }
}

void AppendStrips(
  vtkPolyData* mesh, const std::vector<Vector3>& positions, std::vector<PointIds>& triangles)
{
  const StoredCells cells(mesh->GetStrips());
  for (vtkIdType cell = 0; cell < cells.Size(); ++cell)
  {
    const vtkIdType size = cells.SizeOf(cell);
    const vtkIdType* ids = cells.Of(cell);
    const vtkIdType triangleCount = AreFinite(ids, size, positions) ? size - 2 : 0;
    for (vtkIdType i = 0; i < triangleCount; ++i)
    {
      const vtkIdType odd = i % 2; // every other triangle is numbered the other way round
      triangles.push_back({ ids[i + odd], ids[i + 1 - odd], ids[i + 2] });
    }
  }
}
}

std::vector<Vector3> PositionsOf(vtkPoints* points)
{
  std::vector<Vector3> positions(static_cast<std::size_t>(points->GetNumberOfPoints()));
  for (std::size_t i = 0; i < positions.size(); ++i)
  {
    points->GetPoint(static_cast<vtkIdType>(i), positions[i].data());
  }
  return positions;
}

std::vector<MeshTriangle> TrianglesOf(vtkPolyData* mesh, const std::vector<Vector3>& positions)
{
  std::vector<PointIds> all;
  AppendPolygons(mesh, positions, all);
  AppendStrips(mesh, positions, all);
  std::vector<MeshTriangle> triangles;
  triangles.reserve(all.size());
  for (const PointIds& c : all)
  {
    const Vector3& first = positions[c[0]];
    const Vector3 vector = Cross(positions[c[1]] - first, positions[c[2]] - first);
    const double size = Norm(vector);
    if (size > 0.0 && std::isfinite(size))
    {
      triangles.push_back({ c, (1.0 / size) * vector, 0.5 * size });
    }
  }
  return triangles;
}

double TotalArea(const std::vector<MeshTriangle>& triangles)
{
  return std::accumulate(triangles.begin(), triangles.end(), 0.0,
    [](double sum, const MeshTriangle& triangle) { return sum + triangle.Area; });
}

double Coarseness(const std::vector<MeshTriangle>& triangles, vtkIdType vertices)
{
  std::vector<double> areas(triangles.size());
  std::transform(triangles.begin(), triangles.end(), areas.begin(),
    [](const MeshTriangle& triangle) { return triangle.Area; });
  std::sort(areas.begin(), areas.end());
  const double total = std::accumulate(areas.begin(), areas.end(), 0.0);
  double sum = 0.0;
  const auto middle = std::find_if(areas.begin(), areas.end() - 1, [&sum, total](double area) {
    sum += area;
    return sum >= 0.5 * total;
  });
  return std::sqrt(*middle / total * static_cast<double>(vertices));
}

PlacedCorners PlaceCorners(
  const std::vector<MeshTriangle>& triangles, const std::vector<Vector3>& positions)
{
  std::vector<vtkIdType> used;
  used.reserve(3 * triangles.size());
  for (const MeshTriangle& triangle : triangles)
  {
    used.insert(used.end(), triangle.Corners.begin(), triangle.Corners.end());
  }
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  std::sort(used.begin(), used.end(),
    [&](vtkIdType a, vtkIdType b) { return positions[a] < positions[b]; });
  PlacedCorners placed;
  placed.Points = static_cast<vtkIdType>(used.size());
  std::vector<int> places(positions.size());
  for (std::size_t i = 0; i < used.size(); ++i)
  {
    placed.Places += i == 0 || positions[used[i - 1]] != positions[used[i]] ? 1 : 0;
    places[used[i]] = static_cast<int>(placed.Places - 1);
  }
  placed.Triangles.reserve(triangles.size());
  for (const MeshTriangle& triangle : triangles)
  {
    const std::array<vtkIdType, 3>& c = triangle.Corners;
    placed.Triangles.push_back({ places[c[0]], places[c[1]], places[c[2]] });
  }
  return placed;
}
}
