// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Meshes/FaceSamples.h"

#include "Filters/Arrays/InputArrays.h"

#include "vtkDoubleArray.h"
#include "vtkFloatArray.h"
#include "vtkIdList.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace SurfelGeometry
{
namespace
{
/// Around a wire: it is as round as its surfels can show.
constexpr double PointsAround = 12.0;

/// Times as many points in the same area, at most: the first for which there are not more than
/// MostArea times as many in all.
constexpr double TimesDenser[] = { 16.0, 8.0, 4.0, 2.0 };
constexpr double MostArea = 1.5;

/// Multiples of these, modulo 1, fill the unit square evenly (Roberts' R2 sequence).
constexpr double SequenceSteps[] = { 0.7548776662466927, 0.5698402909980532 };

/// A connected part: its bounds and its area.
struct MeshPart
{
  Vector3 Low{ VTK_DOUBLE_MAX, VTK_DOUBLE_MAX, VTK_DOUBLE_MAX };
  Vector3 High{ -VTK_DOUBLE_MAX, -VTK_DOUBLE_MAX, -VTK_DOUBLE_MAX };
  double Area = 0.0;

  void Add(const MeshTriangle& triangle, const std::vector<Vector3>& positions)
  {
    this->Area += triangle.Area;
    for (const vtkIdType corner : triangle.Corners)
    {
      for (std::size_t k = 0; k < 3; ++k)
      {
        this->Low[k] = std::min(this->Low[k], positions[corner][k]);
        this->High[k] = std::max(this->High[k], positions[corner][k]);
      }
    }
  }

  double Girth() const { return this->Area / std::max(Norm(this->High - this->Low), 1e-300); }
};

/// The areas of the triangles, as many times as the points are to be denser there.
std::vector<double> AreasToFill(const std::vector<MeshTriangle>& triangles,
  const std::vector<Vector3>& positions, const std::vector<int>& numbers, vtkIdType count)
{
  std::vector<double> areas(triangles.size());
  std::transform(triangles.begin(), triangles.end(), areas.begin(),
    [](const MeshTriangle& triangle) { return triangle.Area; });
  if (numbers.empty())
  {
    return areas;
  }
  std::vector<MeshPart> parts(
    1 + static_cast<std::size_t>(*std::max_element(numbers.begin(), numbers.end())));
  for (std::size_t t = 0; t < triangles.size(); ++t)
  {
    parts[numbers[t]].Add(triangles[t], positions);
  }
  const double total = TotalArea(triangles);
  const double spacing = std::sqrt(total / static_cast<double>(count));
  for (const double most : TimesDenser)
  {
    std::vector<double> filled(areas);
    double sum = 0.0;
    for (std::size_t t = 0; t < triangles.size(); ++t)
    {
      const double lacking = PointsAround * spacing / std::max(parts[numbers[t]].Girth(), 1e-300);
      filled[t] *= std::clamp(lacking * lacking, 1.0, most);
      sum += filled[t];
    }
    if (sum <= MostArea * total)
    {
      return filled;
    }
  }
  return areas;
}

Vector3 UnitNormal(vtkDataArray* normals, vtkIdType point)
{
  Vector3 normal;
  normals->GetTuple(point, normal.data());
  return Normalized(normal, Vector3{});
}

Vector3 NormalAt(const MeshTriangle& triangle, const Vector3& weights, vtkDataArray* normals)
{
  static const double crease = std::cos(CreaseAngle * Pi / 180.0);
  const Vector3 face = (IsTurned(triangle, normals) ? -1.0 : 1.0) * triangle.Normal;
  Vector3 mixed{};
  for (std::size_t c = 0; c < 3; ++c)
  {
    const Vector3 given = UnitNormal(normals, triangle.Corners[c]);
    mixed = mixed + weights[c] * (Dot(given, face) > crease ? given : face);
  }
  return Normalized(mixed, Vector3{});
}

bool IsReal(vtkDataArray* array)
{
  return array->GetDataType() == VTK_FLOAT || array->GetDataType() == VTK_DOUBLE;
}

/// Whether values between those of the corners mean anything.
bool IsSmooth(vtkDataArray* array)
{
  const int components = array->GetNumberOfComponents();
  return IsReal(array) ||
    (array->GetDataType() == VTK_UNSIGNED_CHAR && (components == 3 || components == 4));
}

class FaceSampler
{
public:
  FaceSampler(const std::vector<MeshTriangle>& triangles, const std::vector<FaceSample>& samples)
    : Triangles(triangles)
    , Samples(samples)
  {
  }

  vtkIdType Size() const { return static_cast<vtkIdType>(this->Samples.size()); }

  /// Values in between.
  void Mix(vtkDataArray* from, vtkDataArray* to) const
  {
    const auto components = static_cast<std::size_t>(from->GetNumberOfComponents());
    std::vector<double> value(components), mixed(components);
    for (vtkIdType i = 0; i < this->Size(); ++i)
    {
      const FaceSample& sample = this->Samples[i];
      std::fill(mixed.begin(), mixed.end(), 0.0);
      for (std::size_t c = 0; c < 3; ++c)
      {
        from->GetTuple(this->Triangles[sample.Triangle].Corners[c], value.data());
        std::transform(value.begin(), value.end(), mixed.begin(), mixed.begin(),
          [&](double a, double sum) { return sum + sample.Weights[c] * a; });
      }
      if (!IsReal(to))
      {
        std::transform(
          mixed.begin(), mixed.end(), mixed.begin(), [](double a) { return std::nearbyint(a); });
      }
      to->SetTuple(i, mixed.data());
    }
  }

  /// Values of the nearest corners.
  void Take(vtkAbstractArray* from, vtkAbstractArray* to) const
  {
    vtkNew<vtkIdList> nearest;
    nearest->SetNumberOfIds(this->Size());
    for (vtkIdType i = 0; i < this->Size(); ++i)
    {
      const FaceSample& sample = this->Samples[i];
      const auto largest = std::max_element(sample.Weights.begin(), sample.Weights.end());
      nearest->SetId(i, this->Triangles[sample.Triangle].Corners[largest - sample.Weights.begin()]);
    }
    from->GetTuples(nearest, to);
  }

  vtkSmartPointer<vtkAbstractArray> Interpolate(vtkAbstractArray* from) const
  {
    auto to = vtkSmartPointer<vtkAbstractArray>::Take(from->NewInstance());
    to->SetName(from->GetName());
    to->SetNumberOfComponents(from->GetNumberOfComponents());
    to->SetNumberOfTuples(this->Size());
    vtkDataArray* numbers = vtkDataArray::SafeDownCast(from);
    if (numbers && IsSmooth(numbers))
    {
      this->Mix(numbers, vtkDataArray::SafeDownCast(to));
    }
    else
    {
      this->Take(from, to);
    }
    return to;
  }

  vtkSmartPointer<vtkFloatArray> Normals(vtkDataArray* given) const
  {
    const vtkNew<vtkFloatArray> normals =
      MakeArray<vtkFloatArray>(given->GetName(), 3, this->Size());
    for (vtkIdType i = 0; i < this->Size(); ++i)
    {
      const FaceSample& sample = this->Samples[i];
      const MeshTriangle& triangle = this->Triangles[sample.Triangle];
      Store(AreVectors(given) ? NormalAt(triangle, sample.Weights, given) : triangle.Normal,
        normals->GetPointer(3 * i));
    }
    return normals.Get();
  }

private:
  const std::vector<MeshTriangle>& Triangles;
  const std::vector<FaceSample>& Samples;
};
}

std::vector<FaceSample> SpreadSamples(const std::vector<MeshTriangle>& triangles,
  const std::vector<Vector3>& positions, const std::vector<int>& parts, vtkIdType count)
{
  std::vector<double> ends = AreasToFill(triangles, positions, parts, count);
  for (std::size_t t = 1; t < ends.size(); ++t)
  {
    ends[t] += ends[t - 1];
  }
  // Of points that fill parallelograms evenly the halves that fill the triangles.
  std::vector<FaceSample> samples;
  samples.reserve(static_cast<std::size_t>(count));
  const auto all = static_cast<double>(2 * count);
  std::size_t t = 0;
  for (vtkIdType i = 0; i < 2 * count; ++i)
  {
    const auto number = static_cast<double>(i);
    const double place = (number + 0.5) / all * ends.back();
    while (place >= ends[t] && t + 1 < ends.size())
    {
      ++t;
    }
    const double second = std::fmod(number * SequenceSteps[0], 1.0);
    const double third = std::fmod(number * SequenceSteps[1], 1.0);
    const double first = 1.0 - second - third;
    if (first >= 0.0)
    {
      samples.push_back({ static_cast<int>(t), { first, second, third } });
    }
  }
  return samples;
}

void InterpolateSamples(vtkPolyData* mesh, const std::vector<MeshTriangle>& triangles,
  const std::vector<FaceSample>& samples, vtkDataArray* normals, vtkPolyData* output)
{
  const FaceSampler sampler(triangles, samples);
  vtkNew<vtkDoubleArray> places;
  places->SetNumberOfComponents(3);
  places->SetNumberOfTuples(sampler.Size());
  sampler.Mix(mesh->GetPoints()->GetData(), places);
  vtkNew<vtkPoints> points;
  points->SetData(places);
  output->SetPoints(points);
  output->GetFieldData()->ShallowCopy(mesh->GetFieldData());
  vtkPointData *from = mesh->GetPointData(), *to = output->GetPointData();
  for (int i = 0; i < from->GetNumberOfArrays(); ++i)
  {
    vtkAbstractArray* array = from->GetAbstractArray(i);
    if (array != normals)
    {
      to->AddArray(sampler.Interpolate(array));
    }
  }
  if (normals)
  {
    to->SetNormals(sampler.Normals(normals));
  }
  if (from->GetScalars())
  {
    to->SetActiveScalars(from->GetScalars()->GetName());
  }
}

vtkDataArray* NormalsOfMesh(vtkPolyData* mesh)
{
  vtkPointData* data = mesh->GetPointData();
  return data->GetNormals() ? data->GetNormals() : data->GetArray("Normals");
}

bool AreVectors(vtkDataArray* array)
{
  return array->GetNumberOfComponents() == 3 && IsReal(array);
}

bool IsTurned(const MeshTriangle& triangle, vtkDataArray* normals)
{
  Vector3 sum{};
  for (const vtkIdType corner : triangle.Corners)
  {
    sum = sum + UnitNormal(normals, corner);
  }
  return Dot(sum, triangle.Normal) < 0.0;
}
}
