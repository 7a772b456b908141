// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Volumes/CellGaussians.h"

#include "Core/Base/Geometry.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace SurfelVolumes
{
namespace
{
using SurfelSplatting::Pi;

/// Samples of a part along each axis.
constexpr int Samples = 4;
/// Standard deviation of opacity or light (0..1) in a part above which it is split.
constexpr double SplitDeviation = 0.025;
/// Covariance of a kernel over that of the extinction in its part: a homogeneous part, whose
/// variance is length^2 / 12, gets a standard deviation of half of its length.
constexpr double KernelScale = 3.0;

/// A cube within the cell: the corner nearest to the origin, and the length.
struct Part
{
  double Corner[3];
  double Length;
};

/// Values in a cell: s = sum of c_abc x^a y^b z^c, a, b, c = 0 or 1.
struct Trilinear
{
  explicit Trilinear(const std::array<double, 8>& corners)
    : C(corners)
  {
    for (int axis = 0; axis < 3; ++axis)
    {
      const int bit = 1 << axis;
      for (int i = 0; i < 8; ++i)
      {
        if (i & bit)
        {
          this->C[i] -= this->C[i - bit];
        }
      }
    }
  }

  /// Returns the scalar and its gradient's length.
  double operator()(double x, double y, double z, double& slope) const
  {
    const auto& c = this->C;
    const double a = c[0] + c[1] * x, b = c[2] + c[3] * x, d = c[4] + c[5] * x, e = c[6] + c[7] * x;
    const double gx = c[1] + c[3] * y + (c[5] + c[7] * y) * z;
    const double gy = b + e * z;
    const double gz = d + e * y;
    slope = std::sqrt(gx * gx + gy * gy + gz * gz);
    return a + b * y + (d + e * y) * z;
  }

  double At(const double place[3]) const
  {
    double slope;
    return (*this)(place[0], place[1], place[2], slope);
  }

  std::array<double, 8> C;
};

using TrilinearVector = std::array<Trilinear, 3>;

/// What is interpolated in a cell.
struct Fields
{
  Trilinear Scalars;
  std::optional<TrilinearVector> Colors, Normals;
};

/// Sums over the samples of a part.
struct PartSums
{
  Medium Mean;                 // of extinction and emission
  double First[3] = {};        // of extinction times place
  double Second[6] = {};       // XX YY ZZ XY YZ XZ
  double Third = 0.0;          // XYZ
  double Light[4] = {};        // of opacity, and of opacity times colour
  double LightSquared[4] = {}; // of their squares
};

void AddSample(const double place[3], const Medium& medium, double length, PartSums& sums)
{
  const double s = medium.Extinction;
  if (!(s > 0.0))
  {
    return; // adds nothing
  }
  sums.Mean.Extinction += s;
  const double opacity = -std::expm1(-s * length);
  const double scale = opacity / s;
  sums.Light[3] += opacity;
  sums.LightSquared[3] += opacity * opacity;
  for (int k = 0; k < 3; ++k)
  {
    sums.Mean.Emission[k] += medium.Emission[k];
    const double light = scale * medium.Emission[k];
    sums.Light[k] += light;
    sums.LightSquared[k] += light * light;
    sums.First[k] += s * place[k];
    sums.Second[k] += s * place[k] * place[k];
    sums.Second[3 + k] += s * place[k == 2 ? 0 : k] * place[k == 2 ? 2 : k + 1];
  }
  sums.Third += s * place[0] * place[1] * place[2];
}

/// Classifies the samples of a part. Each stands for a cube of the part: its scalars are taken as
/// evenly distributed with the variance that the slope gives them, |grad|^2 length^2 / 12.
PartSums SumSamples(const Fields& fields, const Part& part, const TransferTable& table, double size)
{
  PartSums sums;
  const double step = part.Length / Samples;
  for (int i = 0; i < Samples * Samples * Samples; ++i)
  {
    const int index[3] = { i % Samples, i / Samples % Samples, i / (Samples * Samples) };
    double place[3];
    for (int k = 0; k < 3; ++k)
    {
      place[k] = part.Corner[k] + (index[k] + 0.5) * step;
    }
    double slope;
    const double scalar = fields.Scalars(place[0], place[1], place[2], slope);
    Medium medium = table.Mean(scalar, 0.5 * slope * step);
    for (int k = 0; fields.Colors && k < 3; ++k)
    {
      medium.Emission[k] = medium.Extinction * (*fields.Colors)[k].At(place);
    }
    AddSample(place, medium, size * part.Length, sums);
  }
  return sums;
}

bool IsSteep(const PartSums& sums)
{
  constexpr double count = Samples * Samples * Samples;
  for (int k = 0; k < 4; ++k)
  {
    const double mean = sums.Light[k] / count;
    const double variance = sums.LightSquared[k] / count - mean * mean;
    if (variance > SplitDeviation * SplitDeviation)
    {
      return true;
    }
  }
  return false;
}

CellGaussian MakeGaussian(const PartSums& sums, const Part& part)
{
  constexpr double count = Samples * Samples * Samples;
  const double total = sums.Mean.Extinction;
  const double area = part.Length * part.Length;
  const double own = area / (12.0 * Samples * Samples); // variance of a sample, which is a cube
  CellGaussian gaussian;
  double* c = gaussian.Covariance;
  for (int k = 0; k < 3; ++k)
  {
    gaussian.Center[k] = sums.First[k] / total;
    gaussian.Color[k] = std::clamp(sums.Mean.Emission[k] / total, 0.0, 1.0);
  }
  for (int k = 0; k < 3; ++k)
  {
    const double* p = gaussian.Center;
    c[k] = KernelScale * (std::max(0.0, sums.Second[k] / total - p[k] * p[k]) + own);
    c[3 + k] =
      KernelScale * (sums.Second[3 + k] / total - p[k == 2 ? 0 : k] * p[k == 2 ? 2 : k + 1]);
  }
  const double determinant = c[0] * (c[1] * c[2] - c[4] * c[4]) -
    c[3] * (c[3] * c[2] - c[4] * c[5]) + c[5] * (c[3] * c[4] - c[1] * c[5]);
  gaussian.Extinction =
    total / count * area * part.Length / std::sqrt(8.0 * Pi * Pi * Pi * determinant);
  std::fill_n(gaussian.Normal, 3, 0.0);
  return gaussian;
}

/// Replaces vectors at the corners by the coefficients of x^a y^b z^c.
std::optional<TrilinearVector> Interpolate(const std::array<std::array<double, 3>, 8>* corners)
{
  if (!corners)
  {
    return std::nullopt;
  }
  std::array<double, 8> components[3];
  for (int i = 0; i < 8; ++i)
  {
    for (int k = 0; k < 3; ++k)
    {
      components[k][i] = (*corners)[i][k];
    }
  }
  return TrilinearVector{ Trilinear(components[0]), Trilinear(components[1]),
    Trilinear(components[2]) };
}

void SetNormal(const TrilinearVector& normals, const PartSums& sums, CellGaussian& gaussian)
{
  const double *x = sums.First, *xx = sums.Second;
  const double moments[8] = { sums.Mean.Extinction, x[0], x[1], xx[3], x[2], xx[5], xx[4],
    sums.Third };
  for (int k = 0; k < 3; ++k)
  {
    double sum = 0.0;
    for (int i = 0; i < 8; ++i)
    {
      sum += normals[k].C[i] * moments[i];
    }
    gaussian.Normal[k] = sum / sums.Mean.Extinction;
  }
}

void AppendPart(const Fields& fields, const Part& part, const TransferTable& table,
  const CellSettings& settings, std::vector<CellGaussian>& gaussians)
{
  const PartSums sums = SumSamples(fields, part, table, settings.Size);
  if (settings.Subdivision > 0 && IsSteep(sums))
  {
    const CellSettings below{ settings.Subdivision - 1, settings.Size };
    const double half = 0.5 * part.Length;
    for (int i = 0; i < 8; ++i)
    {
      const Part eighth{ { part.Corner[0] + (i & 1 ? half : 0.0),
                           part.Corner[1] + (i & 2 ? half : 0.0),
                           part.Corner[2] + (i & 4 ? half : 0.0) },
        half };
      AppendPart(fields, eighth, table, below, gaussians);
    }
    return;
  }
  constexpr double count = Samples * Samples * Samples;
  if (sums.Mean.Extinction / count * settings.Size * part.Length > LeastOpticalDepth)
  {
    gaussians.push_back(MakeGaussian(sums, part));
    if (fields.Normals)
    {
      SetNormal(*fields.Normals, sums, gaussians.back());
    }
  }
}
}

void AppendCellGaussians(const CellCorners& corners, const TransferTable& table,
  const CellSettings& settings, std::vector<CellGaussian>& gaussians)
{
  const Part whole{ { 0.0, 0.0, 0.0 }, 1.0 };
  const Fields fields{ Trilinear(corners.Scalars), Interpolate(corners.Colors),
    Interpolate(corners.Normals) };
  AppendPart(fields, whole, table, settings, gaussians);
}

bool IsEmptyCell(const std::array<double, 8>& scalars, const TransferTable& table)
{
  const auto [low, high] = std::minmax_element(scalars.begin(), scalars.end());
  return table.IsEmpty(*low, *high);
}
}
