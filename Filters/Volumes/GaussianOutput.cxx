// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Volumes/GaussianOutput.h"

#include "Core/Surfels/SurfelArrays.h"
#include "Filters/Arrays/InputArrays.h"
#include "Filters/Arrays/PointCells.h"
#include "Filters/Common/AvailableMemory.h"
#include "Filters/Common/ParallelFor.h"

#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <cmath>

namespace Arrays = SurfelSplatting::Arrays;
using SurfelGeometry::MakeArray;

namespace SurfelVolumes
{
namespace
{
/// The parts and the output, of which each takes half; vectors grow ahead of what is in them.
constexpr double BytesPerGaussian = 2.0 * (sizeof(Gaussian) + 8.0);
constexpr double BytesPerNormal = 2.0 * 3 * sizeof(float);
}

unsigned char ColorByte(double value)
{
  return static_cast<unsigned char>(std::lround(255.0 * std::clamp(value, 0.0, 1.0)));
}

bool GaussianCollection::Collect(vtkIdType count, const SurfelGeometry::StageProgress& progress,
  const std::function<void(vtkIdType, GaussianPart&)>& fill)
{
  this->Parts.resize(count);
  const double available = SurfelGeometry::AvailableMemory();
  const double bytes = BytesPerGaussian + (this->HasNormals ? BytesPerNormal : 0.0);
  const vtkIdType block = std::max<vtkIdType>(16, count / 32);
  double total = 0.0;
  for (vtkIdType begin = 0; begin < count; begin += block)
  {
    const vtkIdType end = std::min(count, begin + block);
    SurfelGeometry::ParallelFor(begin, end, 1, [&](vtkIdType from, vtkIdType to) {
      for (vtkIdType i = from; i < to; ++i)
      {
        fill(i, this->Parts[i]);
        this->Parts[i].Gaussians.shrink_to_fit();
        this->Parts[i].Normals.shrink_to_fit();
      }
    });
    for (vtkIdType i = begin; i < end; ++i)
    {
      total += static_cast<double>(this->Parts[i].Gaussians.size());
    }
    if (total * bytes > available)
    {
      this->Problem = "Memory suffices for " +
        std::to_string(static_cast<vtkIdType>(available / bytes)) +
        " Gaussians, and this input has more. Make more of it transparent, lower Subdivision, or "
        "resample it.";
      return false;
    }
    if (!progress.Step(static_cast<double>(end) / static_cast<double>(count)))
    {
      return false;
    }
  }
  return true;
}

void GaussianCollection::Write(const double origin[3], vtkPolyData* output)
{
  std::vector<vtkIdType> begins(this->Parts.size() + 1, 0);
  for (std::size_t i = 0; i < this->Parts.size(); ++i)
  {
    begins[i + 1] = begins[i] + static_cast<vtkIdType>(this->Parts[i].Gaussians.size());
  }
  const vtkIdType count = begins.back();
  auto positions = MakeArray<vtkFloatArray>("Points", 3, count);
  auto covariances = MakeArray<vtkFloatArray>(Arrays::GaussianCovariance, 6, count);
  auto extinctions = MakeArray<vtkFloatArray>(Arrays::GaussianExtinction, 1, count);
  auto colors = MakeArray<vtkUnsignedCharArray>("RGB", 3, count);
  auto normals = MakeArray<vtkFloatArray>(Arrays::GaussianNormal, 3, this->HasNormals ? count : 0);
  const auto parts = static_cast<vtkIdType>(this->Parts.size());
  SurfelGeometry::ParallelFor(0, parts, 1, [&](vtkIdType from, vtkIdType to) {
    for (vtkIdType i = from; i < to; ++i)
    {
      vtkIdType id = begins[i];
      for (const Gaussian& gaussian : this->Parts[i].Gaussians)
      {
        std::copy_n(gaussian.Position, 3, positions->GetPointer(3 * id));
        std::copy_n(gaussian.Covariance, 6, covariances->GetPointer(6 * id));
        extinctions->SetValue(id, gaussian.Extinction);
        std::copy_n(gaussian.Color, 3, colors->GetPointer(3 * id));
        ++id;
      }
      if (this->HasNormals)
      {
        const std::vector<float>& given = this->Parts[i].Normals;
        std::copy(given.begin(), given.end(), normals->GetPointer(3 * begins[i]));
      }
      this->Parts[i] = GaussianPart();
    }
  });
  vtkNew<vtkPoints> points;
  points->SetData(positions);
  output->SetPoints(points);
  output->SetVerts(SurfelGeometry::MakePointCell(count));
  output->GetPointData()->AddArray(covariances);
  output->GetPointData()->AddArray(extinctions);
  if (this->HasNormals)
  {
    output->GetPointData()->AddArray(normals);
  }
  output->GetPointData()->SetScalars(colors);
  auto array = MakeArray<vtkDoubleArray>(Arrays::Origin, 3, 1);
  array->SetTuple(0, origin);
  output->GetFieldData()->AddArray(array);
}
}
