// SPDX-License-Identifier: BSD-3-Clause
/**
 * What the tests of vtkVolumeSplatting share: volumes, properties, and the output as the data
 * contract has it.
 */
#pragma once

#include "SurfelTesting.h"

#include "vtkColorTransferFunction.h"
#include "vtkFloatArray.h"
#include "vtkImageData.h"
#include "vtkPiecewiseFunction.h"
#include "vtkVolumeProperty.h"
#include "vtkVolumeSplatting.h"

#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

namespace SurfelTesting
{
namespace Arrays = SurfelSplatting::Arrays;

const double NaN = std::nan("");

/// A volume with a scalar as a function of the index coordinates.
inline vtkSmartPointer<vtkImageData> MakeImage(
  int nx, int ny, int nz, const std::function<double(int, int, int)>& scalar)
{
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(nx, ny, nz);
  vtkNew<vtkFloatArray> scalars;
  scalars->SetName("density");
  for (int i = 0; i < nx * ny * nz; ++i)
  {
    scalars->InsertNextValue(static_cast<float>(scalar(i % nx, i / nx % ny, i / (nx * ny))));
  }
  image->GetPointData()->SetScalars(scalars);
  return image;
}

/// Opacity in pairs of scalar and value; colour from red at 0 to blue at 1; unit distance.
inline vtkSmartPointer<vtkVolumeProperty> MakeProperty(
  const std::vector<std::array<double, 2>>& opacities, double unitDistance)
{
  auto property = vtkSmartPointer<vtkVolumeProperty>::New();
  vtkNew<vtkPiecewiseFunction> opacity;
  for (const auto& point : opacities)
  {
    opacity->AddPoint(point[0], point[1]);
  }
  vtkNew<vtkColorTransferFunction> color;
  color->AddRGBPoint(0.0, 1.0, 0.0, 0.0);
  color->AddRGBPoint(1.0, 0.0, 0.0, 1.0);
  property->SetScalarOpacity(opacity);
  property->SetColor(color);
  property->SetScalarOpacityUnitDistance(unitDistance);
  return property;
}

inline double Extinction(double opacity, double unitDistance)
{
  return -std::log(1.0 - opacity) / unitDistance;
}

/// The output, read through the data contract.
class Gaussians
{
public:
  explicit Gaussians(vtkPolyData* data)
    : Data(data)
    , Covariances(data->GetPointData()->GetArray(Arrays::GaussianCovariance))
    , Extinctions(data->GetPointData()->GetArray(Arrays::GaussianExtinction))
    , Normals(data->GetPointData()->GetArray(Arrays::GaussianNormal))
    , Origin(data->GetFieldData()->GetArray(Arrays::Origin))
  {
    REQUIRE(this->Covariances);
    REQUIRE(this->Extinctions);
    REQUIRE(this->Origin);
    CHECK(this->Covariances->GetDataType() == VTK_FLOAT);
    CHECK(this->Covariances->GetNumberOfComponents() == 6);
    CHECK(this->Extinctions->GetDataType() == VTK_FLOAT);
    CHECK(data->GetPointData()->GetScalars()->GetDataType() == VTK_UNSIGNED_CHAR);
    CHECK(data->GetPointData()->GetScalars()->GetNumberOfComponents() == 3);
    CHECK(data->GetVerts()->GetNumberOfConnectivityIds() == this->Count());
    CHECK(this->IsFinite());
  }

  vtkIdType Count() const { return this->Data->GetNumberOfPoints(); }

  Vec Position(vtkIdType i) const
  {
    Vec p;
    this->Data->GetPoint(i, p.data());
    for (int k = 0; k < 3; ++k)
    {
      p[k] += this->Origin->GetComponent(0, k);
    }
    return p;
  }

  std::array<double, 6> Covariance(vtkIdType i) const
  {
    std::array<double, 6> s;
    this->Covariances->GetTuple(i, s.data());
    return s;
  }

  double PeakExtinction(vtkIdType i) const { return this->Extinctions->GetComponent(i, 0); }

  bool HasNormals() const { return this->Normals != nullptr; }

  Vec Normal(vtkIdType i) const
  {
    Vec normal;
    this->Normals->GetTuple(i, normal.data());
    return normal;
  }

  Vec Color(vtkIdType i) const
  {
    Vec color;
    this->Data->GetPointData()->GetScalars()->GetTuple(i, color.data());
    return color;
  }

  bool IsFinite() const
  {
    bool finite = true;
    for (vtkIdType i = 0; i < this->Count(); ++i)
    {
      double sum = this->PeakExtinction(i) + Length(this->Position(i)) +
        (this->Normals ? Length(this->Normal(i)) : 0.0);
      for (const double s : this->Covariance(i))
      {
        sum += s;
      }
      finite = finite && std::isfinite(sum);
    }
    return finite;
  }

  /// Integral of the extinction over space.
  double Mass(vtkIdType i) const
  {
    return this->PeakExtinction(i) * std::pow(2.0 * Pi, 1.5) * std::sqrt(this->Determinant(i));
  }
  double TotalMass() const
  {
    double sum = 0.0;
    for (vtkIdType i = 0; i < this->Count(); ++i)
    {
      sum += this->Mass(i);
    }
    return sum;
  }

  /// Extinction at a place.
  double Sum(const Vec& x) const
  {
    double sum = 0.0;
    for (vtkIdType i = 0; i < this->Count(); ++i)
    {
      const Vec d = Minus(x, this->Position(i));
      sum += this->PeakExtinction(i) * std::exp(-0.5 * this->Product(i, d, d));
    }
    return sum;
  }

  /// Integral of the extinction along a whole line: each Gaussian's in closed form.
  double OpticalDepth(const Vec& x, const Vec& direction) const
  {
    double sum = 0.0;
    for (vtkIdType i = 0; i < this->Count(); ++i)
    {
      const Vec d = Minus(x, this->Position(i));
      const double rr = this->Product(i, direction, direction);
      const double dr = this->Product(i, d, direction);
      const double q = this->Product(i, d, d) - dr * dr / rr;
      sum +=
        this->PeakExtinction(i) * std::sqrt(2.0 * Pi / rr) * std::exp(-0.5 * q) * Length(direction);
    }
    return sum;
  }

private:
  double Determinant(vtkIdType i) const
  {
    const auto s = this->Covariance(i);
    return s[0] * (s[1] * s[2] - s[4] * s[4]) - s[3] * (s[3] * s[2] - s[4] * s[5]) +
      s[5] * (s[3] * s[4] - s[1] * s[5]);
  }

  /// a^T S^-1 b by the adjugate.
  double Product(vtkIdType i, const Vec& a, const Vec& b) const
  {
    const auto s = this->Covariance(i);
    const double xx = s[1] * s[2] - s[4] * s[4], yy = s[0] * s[2] - s[5] * s[5],
                 zz = s[0] * s[1] - s[3] * s[3], xy = s[4] * s[5] - s[3] * s[2],
                 yz = s[3] * s[5] - s[0] * s[4], xz = s[3] * s[4] - s[1] * s[5];
    return (xx * a[0] * b[0] + yy * a[1] * b[1] + zz * a[2] * b[2] +
             xy * (a[0] * b[1] + a[1] * b[0]) + yz * (a[1] * b[2] + a[2] * b[1]) +
             xz * (a[0] * b[2] + a[2] * b[0])) /
      this->Determinant(i);
  }

  vtkPolyData* Data;
  vtkDataArray* Covariances;
  vtkDataArray* Extinctions;
  vtkDataArray* Normals; // or null
  vtkDataArray* Origin;
};

/// The filter with an input and a property; what it says is collected.
class Run
{
public:
  Run(vtkDataObject* input, vtkVolumeProperty* property, int subdivision = 1)
    : Said(this->Filter)
  {
    this->Filter->SetInputDataObject(input);
    this->Filter->SetVolumeProperty(property);
    this->Filter->SetSubdivision(subdivision);
  }
  Gaussians Result()
  {
    this->Filter->Update();
    CHECK(this->Said.Errors.empty());
    return Gaussians(this->Filter->GetOutput());
  }
  /// The error, which leaves the output empty.
  std::string Error()
  {
    this->Filter->Update();
    CHECK(this->Filter->GetOutput()->GetNumberOfPoints() == 0);
    return this->Said.Errors.empty() ? "" : this->Said.Errors[0];
  }

  vtkNew<vtkVolumeSplatting> Filter;
  Messages Said;
};

inline bool Contains(const std::string& text, const std::string& part)
{
  return text.find(part) != std::string::npos;
}

/// A turned volume with cells of 0.5 x 1 x 2, far from the origin.
inline vtkSmartPointer<vtkImageData> MakeTurnedImage(int n)
{
  auto image = MakeImage(n, n, n, [](int, int, int) { return 0.5; });
  image->SetSpacing(0.5, 1.0, 2.0);
  image->SetOrigin(1000.0, -2000.0, 3000.0);
  const double c = std::cos(0.4), s = std::sin(0.4); // about z, then about x
  image->SetDirectionMatrix(c, -s, 0.0, 0.6 * s, 0.6 * c, -0.8, 0.8 * s, 0.8 * c, 0.6);
  return image;
}
}
