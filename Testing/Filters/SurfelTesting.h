// SPDX-License-Identifier: BSD-3-Clause
/**
 * What the tests of the filters share: sampled surfaces as VTK's data, surfels that filters made, a
 * brute-force sum of kernels, and messages.
 */
#pragma once

#include "Core/Base/Geometry.h"
#include "Core/Surfels/SurfelArrays.h"
#include "Testing/Shared/Check.h"
#include "Testing/Shared/SampledSurfaces.h"

#include "vtkCallbackCommand.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkExecutive.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkPolyDataAlgorithm.h"
#include "vtkSMPTools.h"
#include "vtkSmartPointer.h"
#include "vtkUnsignedCharArray.h"

#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace SurfelTesting
{
using SurfelSplatting::Dot;

inline Vec Minus(const Vec& a, const Vec& b)
{
  return { a[0] - b[0], a[1] - b[1], a[2] - b[2] };
}
inline double Length(const Vec& a)
{
  return SurfelSplatting::Norm(a);
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

/// Adds the array Id: the number of each point.
inline void AddIds(vtkPolyData* data)
{
  vtkNew<vtkFloatArray> ids;
  ids->SetName("Id");
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
  {
    ids->InsertNextValue(static_cast<float>(i));
  }
  data->GetPointData()->AddArray(ids);
}

inline void AddField(const char* name, const std::vector<double>& values, vtkPolyData* data)
{
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(static_cast<int>(values.size()));
  array->InsertNextTuple(values.data());
  data->GetFieldData()->AddArray(array);
}

/// Adds the array Checkers, the active scalars: red 200 and 60 by turns in cubes of this size, and
/// an opacity that differs from point to point. Points that are not finite are black.
inline void AddCheckers(vtkPolyData* data, double size)
{
  vtkNew<vtkUnsignedCharArray> colors;
  colors->SetName("Checkers");
  colors->SetNumberOfComponents(4);
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
  {
    Vec p;
    data->GetPoint(i, p.data());
    const double sum = std::floor(p[0] / size) + std::floor(p[1] / size) + std::floor(p[2] / size);
    const double red = !std::isfinite(sum) ? 0.0 : std::fmod(sum, 2.0) == 0.0 ? 200.0 : 60.0;
    colors->InsertNextTuple4(
      red, 90.0, 255.0 - red, std::isfinite(sum) ? std::fmod(std::abs(1e3 * p[0]), 255.0) : 0.0);
  }
  data->GetPointData()->SetScalars(colors);
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
    , Overlaps(data->GetPointData()->GetArray(SurfelSplatting::Arrays::Overlap))
    , Origin(data->GetFieldData()->GetArray(SurfelSplatting::Arrays::Origin))
  {
  }

  bool HasArrays() const
  {
    return this->AreaVectors && this->Covariances && this->TwoSided && this->Overlaps &&
      this->Origin && this->AreaVectors->GetDataType() == VTK_FLOAT &&
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
  double Overlap(vtkIdType i) const { return this->Overlaps->GetComponent(i, 0) / 255.0; }
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

  /// a_i G(x; p_i, S_i) in the surfel's plane.
  double Kernel(vtkIdType i, const Vec& x) const { return this->PlaneKernels()[i].At(x); }

  /// Sum of all kernels whose plane is near x and whose normal is within 90 degrees of `normal`
  /// (or of its opposite).
  double Sum(const Vec& x, const Vec& normal) const
  {
    double sum = 0.0;
    for (const PlaneKernel& kernel : this->PlaneKernels())
    {
      const Vec d = Minus(x, kernel.Position);
      const double height = Dot(d, kernel.Normal);
      if (Dot(d, d) < 40.0 * kernel.Variance && height * height < 2.0 * kernel.Variance &&
        std::abs(Dot(kernel.Normal, normal)) > 0.1)
      {
        sum += kernel.At(x);
      }
    }
    return sum;
  }

private:
  /// A kernel in any frame u, v of its plane, by the adjugate of S there.
  struct PlaneKernel
  {
    Vec Position, Normal, U, V;
    double UU, UV, VV; // of the inverse of S
    double Peak, Variance;

    double At(const Vec& x) const
    {
      const Vec d = Minus(x, this->Position);
      const double a = Dot(d, this->U), b = Dot(d, this->V);
      const double q = this->UU * a * a + 2.0 * this->UV * a * b + this->VV * b * b;
      return q > 100.0 ? 0.0 : this->Peak * std::exp(-0.5 * q); // 1e-22 of the peak
    }
  };

  PlaneKernel MakeKernel(vtkIdType i) const
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
    return { this->Position(i), n, u, v, vv / determinant, -uv / determinant, uu / determinant,
      this->Area(i) / (2.0 * Pi * std::sqrt(determinant)), s[0] + s[1] + s[2] };
  }

  /// Made once: sums ask for each of them thousands of times.
  const std::vector<PlaneKernel>& PlaneKernels() const
  {
    while (static_cast<vtkIdType>(this->Kernels.size()) < this->Count())
    {
      this->Kernels.push_back(this->MakeKernel(static_cast<vtkIdType>(this->Kernels.size())));
    }
    return this->Kernels;
  }

  mutable std::vector<PlaneKernel> Kernels;
  vtkPolyData* Data;
  vtkDataArray* AreaVectors;
  vtkDataArray* Covariances;
  vtkDataArray* TwoSided;
  vtkDataArray* Overlaps;
  vtkDataArray* Origin;
};

/// What a function returns with each of these numbers of threads.
template <class Function>
auto WithThreads(const std::vector<int>& counts, const Function& function)
{
  // Plain threads where VTK has them: TBB gives no more than there are cores.
  const std::string backend = vtkSMPTools::GetBackend();
  vtkSMPTools::SetBackend("STDThread");
  std::vector<decltype(function())> results;
  for (const int count : counts)
  {
    vtkSMPTools::Initialize(count);
    results.push_back(function());
  }
  vtkSMPTools::Initialize(0);
  vtkSMPTools::SetBackend(backend.c_str());
  return results;
}

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

/// The value below which this share of the values lies.
inline double AtShare(const std::vector<double>& sorted, double share)
{
  return sorted[static_cast<size_t>(share * (sorted.size() - 1))];
}
}
