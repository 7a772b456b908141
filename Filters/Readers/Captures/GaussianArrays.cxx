// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Readers/Captures/GaussianArrays.h"

#include "Core/Surfels/SurfelArrays.h"
#include "Filters/Common/AvailableMemory.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Readers/Points/PointCloudFields.h"

#include "vtkCellArray.h"
#include "vtkFloatArray.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

namespace PointCloud
{
namespace
{
namespace Arrays = SurfelSplatting::Arrays;

void Allocate(vtkDataArray* array, const char* name, int components, vtkIdType count)
{
  array->SetName(name);
  array->SetNumberOfComponents(components);
  if (!array->Resize(count))
  {
    throw std::bad_alloc();
  }
  array->SetNumberOfTuples(count);
}

/// Stores a number as a float. Returns false for NaN, infinity and numbers beyond floats.
bool Store(double value, float& to)
{
  const bool isFloat = std::abs(value) <= std::numeric_limits<float>::max();
  to = isFloat ? static_cast<float>(value) : 0.0f;
  return isFloat;
}

/// S = M M' with M = R diag(scale), R the rotation of a quaternion w x y z: Kerbl et al. 2023,
/// equation 6. Order XX, YY, ZZ, XY, YZ, XZ.
void MakeCovariance(const double (&scale)[3], double (&q)[4], double (&covariance)[6])
{
  // Of three numbers each time: that of two is one of glibc 2.35, which older systems lack.
  const double length = std::hypot(std::hypot(q[0], q[1], q[2]), q[3], 0.0);
  for (double& component : q)
  {
    component /= length; // NaN without rotation: found later
  }
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  double m[3][3] = { { 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y) },
    { 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x) },
    { 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y) } };
  for (auto& row : m)
  {
    for (int i = 0; i < 3; ++i)
    {
      row[i] *= scale[i];
    }
  }
  constexpr int rows[6][2] = { { 0, 0 }, { 1, 1 }, { 2, 2 }, { 0, 1 }, { 1, 2 }, { 0, 2 } };
  for (int i = 0; i < 6; ++i)
  {
    const double *a = m[rows[i][0]], *b = m[rows[i][1]];
    covariance[i] = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }
}
}

std::string CheckMemory(vtkIdType gaussians, int harmonics, double otherBytes)
{
  constexpr double besidesHarmonics = 60.0; // points, covariances, opacities, cells, notes
  return SurfelGeometry::CheckMemory(
    gaussians, otherBytes + besidesHarmonics + 12.0 * harmonics, SurfelGeometry::AvailableMemory());
}

GaussianArrays::GaussianArrays(const GaussianLayout& layout, vtkIdType count)
  : Layout(layout)
  , IsValid(count, 0)
{
  this->Points->SetDataType(layout.HasDoublePositions ? VTK_DOUBLE : VTK_FLOAT);
  Allocate(this->Points->GetData(), "Points", 3, count);
  Allocate(this->Covariance, Arrays::GaussianCovariance, 6, count);
  Allocate(this->Opacity, Arrays::GaussianOpacity, 1, count);
  if (layout.Harmonics.empty())
  {
    Allocate(this->Colors, "RGB", 3, count);
  }
  else
  {
    Allocate(
      this->Harmonics, Arrays::GaussianHarmonics, static_cast<int>(layout.Harmonics.size()), count);
  }
}

GaussianArrays::~GaussianArrays() = default;

bool GaussianArrays::Decode(const std::uint8_t* gaussian, vtkIdType id)
{
  double position[3], scale[3], rotation[4], covariance[6];
  const auto decode = [gaussian](const GaussianValue& value) { return value(gaussian); };
  std::transform(this->Layout.Position, this->Layout.Position + 3, position, decode);
  std::transform(this->Layout.Scale, this->Layout.Scale + 3, scale, decode);
  std::transform(this->Layout.Rotation, this->Layout.Rotation + 4, rotation, decode);
  MakeCovariance(scale, rotation, covariance);

  bool isValid = std::all_of(position, position + 3, [](double x) { return std::isfinite(x); });
  this->Points->SetPoint(id, position);
  for (int i = 0; i < 6; ++i)
  {
    isValid = Store(covariance[i], this->Covariance->GetPointer(6 * id)[i]) && isValid;
  }
  isValid = Store(decode(this->Layout.Opacity), this->Opacity->GetPointer(id)[0]) && isValid;
  const std::size_t harmonics = this->Layout.Harmonics.size();
  for (std::size_t i = 0; i < harmonics; ++i)
  {
    const double coefficient = decode(this->Layout.Harmonics[i]);
    isValid = Store(coefficient, this->Harmonics->GetPointer(0)[harmonics * id + i]) && isValid;
  }
  if (harmonics == 0)
  {
    std::copy_n(gaussian + this->Layout.Color, 3, this->Colors->GetPointer(3 * id));
  }
  return isValid;
}

void GaussianArrays::Append(const FieldCloud& gaussians)
{
  const vtkIdType first = this->Appended;
  SurfelGeometry::ParallelFor(
    0, static_cast<vtkIdType>(gaussians.Width), [&](vtkIdType i, vtkIdType end) {
      for (; i < end; ++i)
      {
        const std::uint8_t* gaussian = gaussians.Data.data() + i * gaussians.PointStep;
        this->IsValid[first + i] = this->Decode(gaussian, first + i);
      }
    });
  this->Appended += gaussians.Width;
}

std::vector<vtkDataArray*> GaussianArrays::All()
{
  return { this->Points->GetData(), this->Covariance, this->Opacity, this->Harmonics,
    this->Colors };
}

vtkIdType GaussianArrays::RemoveInvalid()
{
  const auto kept =
    static_cast<vtkIdType>(std::count(this->IsValid.begin(), this->IsValid.end(), 1));
  const vtkIdType removed = this->Appended - kept;
  if (removed == 0)
  {
    return 0;
  }
  for (vtkDataArray* array : this->All())
  {
    vtkIdType to = 0;
    for (vtkIdType from = 0; from < array->GetNumberOfTuples(); ++from)
    {
      if (this->IsValid[from])
      {
        array->SetTuple(to++, from, array);
      }
    }
    array->Resize(to);
  }
  return removed;
}

void GaussianArrays::MoveTo(vtkPolyData* output)
{
  vtkPointData* data = output->GetPointData();
  output->SetPoints(this->Points);
  output->SetVerts(MakeVertices(static_cast<int>(this->Points->GetNumberOfPoints())));
  data->AddArray(this->Covariance);
  data->AddArray(this->Opacity);
  if (this->Layout.Harmonics.empty())
  {
    data->SetScalars(this->Colors);
  }
  else
  {
    data->AddArray(this->Harmonics);
  }
}
}
