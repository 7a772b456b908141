// SPDX-License-Identifier: BSD-3-Clause
/**
 * What the tests of the filters share: sampled surfaces with their true normals, and a
 * brute-force sum of kernels.
 */
#pragma once

#include "Core/Surfels/SurfelArrays.h"
#include "Testing/Shared/Check.h"

#include "vtkCallbackCommand.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkExecutive.h"
#include "vtkFieldData.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkPolyDataAlgorithm.h"
#include "vtkSmartPointer.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace SurfelTesting
{
using Vec = std::array<double, 3>;

constexpr double Pi = 3.14159265358979323846;

inline Vec Minus(const Vec& a, const Vec& b)
{
  return { a[0] - b[0], a[1] - b[1], a[2] - b[2] };
}
inline double Dot(const Vec& a, const Vec& b)
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline double Length(const Vec& a)
{
  return std::sqrt(Dot(a, a));
}

/// Uniform numbers in [0, 1) that are the same everywhere (splitmix64).
class Random
{
public:
  explicit Random(std::uint64_t seed)
    : State(seed)
  {
  }
  double operator()()
  {
    std::uint64_t x = (this->State += 0x9e3779b97f4a7c15ull);
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1.0p-53;
  }

private:
  std::uint64_t State;
};

/// Points on a surface with the true outward normals.
struct Sampled
{
  std::vector<Vec> Points;
  std::vector<Vec> Normals;

  void Add(const Vec& p, const Vec& n)
  {
    this->Points.push_back(p);
    this->Normals.push_back(n);
  }
  void Append(const Sampled& other)
  {
    this->Points.insert(this->Points.end(), other.Points.begin(), other.Points.end());
    this->Normals.insert(this->Normals.end(), other.Normals.begin(), other.Normals.end());
  }
  void Shift(const Vec& by)
  {
    for (Vec& p : this->Points)
    {
      p = { p[0] + by[0], p[1] + by[1], p[2] + by[2] };
    }
  }
};

/// Sphere about 0, `count` points spread evenly with some jitter (a stratified sample).
inline Sampled MakeSphere(double radius, int count, Random random)
{
  Sampled result;
  for (int i = 0; i < count; ++i)
  {
    const double z = 1.0 - 2.0 * (i + random()) / count;
    const double angle = 2.39996322972865332 * i + 0.02 * random();
    const double r = std::sqrt(1.0 - z * z);
    const Vec n{ r * std::cos(angle), r * std::sin(angle), z };
    result.Add({ radius * n[0], radius * n[1], radius * n[2] }, n);
  }
  return result;
}

/// Rectangle [0, a] x [0, b] spanned by two axes from a corner; jittered cells of side `pitch`.
inline Sampled MakeRectangle(const Vec& corner, const Vec& u, double a, const Vec& v, double b,
  double pitch, double jitter, Random random)
{
  const Vec n{ u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0] };
  const int columns = static_cast<int>(std::lround(a / pitch));
  const int rows = static_cast<int>(std::lround(b / pitch));
  Sampled result;
  for (int row = 0; row < rows; ++row)
  {
    for (int column = 0; column < columns; ++column)
    {
      const double x = a * (column + 0.5 + jitter * (random() - 0.5)) / columns;
      const double y = b * (row + 0.5 + jitter * (random() - 0.5)) / rows;
      result.Add({ corner[0] + x * u[0] + y * v[0], corner[1] + x * u[1] + y * v[1],
                   corner[2] + x * u[2] + y * v[2] },
        n);
    }
  }
  return result;
}

/// Tube about the z axis from z = 0 to `length`, with caps if wanted.
inline Sampled MakeTube(double radius, double length, double pitch, bool caps, Random random)
{
  Sampled result;
  const int around = static_cast<int>(std::lround(2.0 * Pi * radius / pitch));
  const int along = static_cast<int>(std::lround(length / pitch));
  for (int i = 0; i < along; ++i)
  {
    for (int j = 0; j < around; ++j)
    {
      const double angle = 2.0 * Pi * (j + random()) / around;
      const Vec n{ std::cos(angle), std::sin(angle), 0.0 };
      result.Add({ radius * n[0], radius * n[1], length * (i + random()) / along }, n);
    }
  }
  const int capCount = caps ? static_cast<int>(Pi * radius * radius / (pitch * pitch)) : 0;
  for (const double side : { 0.0, 1.0 })
  {
    for (int i = 0; i < capCount; ++i)
    {
      const double r = radius * std::sqrt((i + random()) / capCount);
      const double angle = 2.39996322972865332 * i;
      result.Add({ r * std::cos(angle), r * std::sin(angle), side * length },
        { 0.0, 0.0, 2.0 * side - 1.0 });
    }
  }
  return result;
}

/// Closed box [0, a] x [0, b] x [0, c].
inline Sampled MakeBox(double a, double b, double c, double pitch, Random random)
{
  const Vec x{ 1, 0, 0 }, y{ 0, 1, 0 }, z{ 0, 0, 1 };
  const double jitter = 0.9;
  Sampled box = MakeRectangle({ 0, 0, c }, x, a, y, b, pitch, jitter, random);
  box.Append(MakeRectangle({ 0, 0, 0 }, y, b, x, a, pitch, jitter, random));
  box.Append(MakeRectangle({ a, 0, 0 }, y, b, z, c, pitch, jitter, random));
  box.Append(MakeRectangle({ 0, 0, 0 }, z, c, y, b, pitch, jitter, random));
  box.Append(MakeRectangle({ 0, b, 0 }, z, c, x, a, pitch, jitter, random));
  box.Append(MakeRectangle({ 0, 0, 0 }, x, a, z, c, pitch, jitter, random));
  return box;
}

inline vtkSmartPointer<vtkPolyData> ToPolyData(
  const std::vector<Vec>& positions, int precision = VTK_FLOAT)
{
  vtkNew<vtkPoints> points;
  points->SetDataType(precision);
  for (const Vec& p : positions)
  {
    points->InsertNextPoint(p.data());
  }
  auto result = vtkSmartPointer<vtkPolyData>::New();
  result->SetPoints(points);
  return result;
}

inline void AddNormals(vtkPolyData* data, const std::vector<Vec>& normals)
{
  vtkNew<vtkDoubleArray> array;
  array->SetName("Normals");
  array->SetNumberOfComponents(3);
  for (const Vec& n : normals)
  {
    array->InsertNextTuple(n.data());
  }
  data->GetPointData()->SetNormals(array);
}

/// Surfels read through the data contract.
class Surfels
{
public:
  explicit Surfels(vtkPolyData* data)
    : Data(data)
    , AreaVectors(data->GetPointData()->GetArray(SurfelSplatting::Arrays::AreaVector))
    , Covariances(data->GetPointData()->GetArray(SurfelSplatting::Arrays::Covariance))
    , TwoSided(data->GetPointData()->GetArray(SurfelSplatting::Arrays::TwoSided))
    , Origin(data->GetFieldData()->GetArray(SurfelSplatting::Arrays::Origin))
  {
  }

  bool HasArrays() const
  {
    return this->AreaVectors && this->Covariances && this->TwoSided && this->Origin &&
      this->AreaVectors->GetDataType() == VTK_FLOAT &&
      this->Covariances->GetDataType() == VTK_FLOAT &&
      this->Covariances->GetNumberOfComponents() == 6 &&
      this->TwoSided->GetDataType() == VTK_UNSIGNED_CHAR &&
      this->Origin->GetDataType() == VTK_DOUBLE && this->Origin->GetNumberOfTuples() == 1;
  }
  vtkIdType Count() const { return this->Data->GetNumberOfPoints(); }
  Vec Position(vtkIdType i) const
  {
    Vec p;
    this->Data->GetPoint(i, p.data());
    return p;
  }
  Vec AreaVector(vtkIdType i) const
  {
    Vec a;
    this->AreaVectors->GetTuple(i, a.data());
    return a;
  }
  double Area(vtkIdType i) const { return Length(this->AreaVector(i)); }
  Vec Normal(vtkIdType i) const
  {
    const Vec a = this->AreaVector(i);
    const double length = Length(a);
    return { a[0] / length, a[1] / length, a[2] / length };
  }
  std::array<double, 6> Covariance(vtkIdType i) const
  {
    std::array<double, 6> s;
    this->Covariances->GetTuple(i, s.data());
    return s;
  }
  bool IsTwoSided(vtkIdType i) const { return this->TwoSided->GetComponent(i, 0) != 0.0; }
  double TotalArea() const
  {
    double sum = 0.0;
    for (vtkIdType i = 0; i < this->Count(); ++i)
    {
      sum += this->Area(i);
    }
    return sum;
  }
  bool IsFinite() const
  {
    for (vtkIdType i = 0; i < this->Count(); ++i)
    {
      double sum = this->Area(i) + Length(this->Position(i));
      for (const double s : this->Covariance(i))
      {
        sum += s;
      }
      if (!std::isfinite(sum))
      {
        return false;
      }
    }
    return true;
  }

  /// a_i G(x; p_i, S_i) in the surfel's plane, by the adjugate of S in any tangent frame.
  double Kernel(vtkIdType i, const Vec& x) const
  {
    const Vec n = this->Normal(i);
    const int k = std::abs(n[0]) < 0.6 ? 0 : 1;
    Vec u{ 0, 0, 0 };
    u[k] = 1.0;
    const double un = Dot(u, n);
    for (int c = 0; c < 3; ++c)
    {
      u[c] -= un * n[c];
    }
    const double length = Length(u);
    for (double& c : u)
    {
      c /= length;
    }
    const Vec v{ n[1] * u[2] - n[2] * u[1], n[2] * u[0] - n[0] * u[2], n[0] * u[1] - n[1] * u[0] };
    const auto s = this->Covariance(i);
    const auto apply = [&s](const Vec& a) {
      return Vec{ s[0] * a[0] + s[3] * a[1] + s[5] * a[2], s[3] * a[0] + s[1] * a[1] + s[4] * a[2],
        s[5] * a[0] + s[4] * a[1] + s[2] * a[2] };
    };
    const double uu = Dot(u, apply(u)), uv = Dot(u, apply(v)), vv = Dot(v, apply(v));
    const double determinant = uu * vv - uv * uv;
    const Vec d = Minus(x, this->Position(i));
    const double a = Dot(d, u), b = Dot(d, v);
    const double q = (vv * a * a - 2.0 * uv * a * b + uu * b * b) / determinant;
    return this->Area(i) * std::exp(-0.5 * q) / (2.0 * Pi * std::sqrt(determinant));
  }

  /// Sum of all kernels whose plane is near x and whose normal is within 90 degrees of `normal`
  /// (or of its opposite).
  double Sum(const Vec& x, const Vec& normal) const
  {
    double sum = 0.0;
    for (vtkIdType i = 0; i < this->Count(); ++i)
    {
      const auto s = this->Covariance(i);
      const double variance = s[0] + s[1] + s[2];
      const Vec d = Minus(x, this->Position(i));
      const Vec n = this->Normal(i);
      const double height = Dot(d, n);
      if (Dot(d, d) < 40.0 * variance && height * height < 2.0 * variance &&
        std::abs(Dot(n, normal)) > 0.1)
      {
        sum += this->Kernel(i, x);
      }
    }
    return sum;
  }

private:
  vtkPolyData* Data;
  vtkDataArray* AreaVectors;
  vtkDataArray* Covariances;
  vtkDataArray* TwoSided;
  vtkDataArray* Origin;
};

/// Mean and standard deviation of a list.
struct Spread
{
  double Mean = 0.0, Deviation = 0.0, Minimum = 1e300, Maximum = -1e300;

  explicit Spread(const std::vector<double>& values)
  {
    double squares = 0.0;
    for (const double value : values)
    {
      this->Mean += value / values.size();
      squares += value * value / values.size();
      this->Minimum = std::min(this->Minimum, value);
      this->Maximum = std::max(this->Maximum, value);
    }
    this->Deviation = std::sqrt(std::max(0.0, squares - this->Mean * this->Mean));
  }
};

/// Collects what an algorithm says instead of printing it.
class Messages
{
public:
  explicit Messages(vtkAlgorithm* algorithm)
  {
    this->Command->SetClientData(this);
    this->Command->SetCallback([](vtkObject*, unsigned long event, void* self, void* text) {
      auto& messages = *static_cast<Messages*>(self);
      auto& list = event == vtkCommand::ErrorEvent ? messages.Errors : messages.Warnings;
      list.emplace_back(text ? static_cast<const char*>(text) : "");
    });
    for (vtkObject* object :
      { static_cast<vtkObject*>(algorithm), static_cast<vtkObject*>(algorithm->GetExecutive()) })
    {
      object->AddObserver(vtkCommand::ErrorEvent, this->Command);
      object->AddObserver(vtkCommand::WarningEvent, this->Command);
    }
  }

  std::vector<std::string> Errors;
  std::vector<std::string> Warnings;

private:
  vtkNew<vtkCallbackCommand> Command;
};
}
