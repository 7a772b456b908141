// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Cleaning/Smoothing.h"

#include "Filters/Cleaning/PointSpread.h"
#include "Filters/Common/Median.h"

#include <pcl/surface/mls.h>

#include <pcl/surface/impl/mls.hpp>

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
namespace
{
/// A part is this many points, neighbours in Morton order: more than a leaf or a wire has, so that
/// a part has other surfaces than thin ones.
constexpr int PartSize = 1 << 15;
constexpr int SamplesPerPart = 256;

/// Neighbours of the fits that tell noise: of the first, which few surfaces are too curved for, and
/// of the second, whose residuals are many enough for their distribution.
constexpr int NearFit = 16;
constexpr int WideFit = 64;

/// Residuals below this part of the spacing are not noise; a surface with a radius of two spacings
/// has 0.04.
constexpr double CleanResidual = 0.06;

/// A part with this share of points whose fit is clean has no noise.
constexpr double CleanShare = 0.1;

/// The least kurtosis of a symmetric distribution with one maximum (that of the uniform one); noise
/// has 3, two sheets have 1.
constexpr double LeastKurtosis = 1.8;

/// Two sheets have the same colours if the squared difference of their means is below this part of
/// the variance in a sheet: of two samples of 32 from one distribution it is a sixteenth, and more
/// where a pattern is shifted a little.
constexpr double SameColors = 0.5;

/// Variance of colours of 8 bits by noise alone.
constexpr double ColorNoise = 64.0;

/// Neighbours of the smoothing for noise of one spacing: more gain nothing, as fewer do for less
/// noise.
constexpr double NeighborsPerNoise = 100.0;
constexpr int LeastNeighbors = 32;
constexpr int MostNeighbors = 160;

/// Points farther from the surface than this many standard deviations of the noise are not moved.
constexpr double LargestShift = 4.0;

constexpr int QuadricTerms = 6;

/// Distances of points to the surface that pcl::MLSResult has fitted, in units of the spacing.
struct Residuals
{
  double Deviation = 0.0;
  double Kurtosis = 0.0;
};

/// An area per point of radius^2 pi / count, as on a surface.
double SpacingOf(const Neighbors& neighbors)
{
  return std::sqrt(Pi * neighbors.SquaredDistances.back() / neighbors.Count());
}

/// The neighbourhood of one point, for PCL: point 0 is the point itself.
class Quadric
{
public:
  void Fit(const LocalCloud& cloud, int i, const Neighbors& neighbors)
  {
    LoadNear(cloud, i, neighbors, this->Near);
    this->Near.push_back(pcl::PointXYZ(0.0f, 0.0f, 0.0f));
    std::swap(this->Near.front(), this->Near.back());
    while (this->Indices.size() < this->Near.size())
    {
      this->Indices.push_back(static_cast<pcl::index_t>(this->Indices.size()));
    }
    this->Indices.resize(this->Near.size());
    const double reach = std::sqrt(neighbors.SquaredDistances.back());
    this->Surface.computeMLSSurface(this->Near, 0, this->Indices, reach, 2);
  }

  Residuals Measure(double spacing) const
  {
    double squares = 0.0, fourths = 0.0;
    for (const pcl::PointXYZ& p : this->Near)
    {
      double u, v, w;
      this->Surface.getMLSCoordinates(p.getVector3fMap().cast<double>(), u, v, w);
      const double distance = (w - this->Surface.getPolynomialValue(u, v)) / spacing;
      squares += distance * distance;
      fourths += std::pow(distance, 4);
    }
    const double count = static_cast<double>(this->Near.size());
    return { std::sqrt(squares / std::max(1.0, count - QuadricTerms)),
      squares > 0.0 ? count * fourths / (squares * squares) : 0.0 };
  }

  /// Squared difference of the mean colours above and below the surface over the variance there.
  double ColorContrast(
    int i, const Neighbors& neighbors, const std::vector<unsigned char>& colors) const
  {
    Eigen::Vector3d sums[2] = { Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero() };
    double counts[2] = { 0.0, 0.0 }, squares = 0.0;
    for (size_t k = 0; k < this->Near.size(); ++k)
    {
      double u, v, w;
      this->Surface.getMLSCoordinates(this->Near[k].getVector3fMap().cast<double>(), u, v, w);
      const int side = w > this->Surface.getPolynomialValue(u, v) ? 1 : 0;
      // Fit() has put the point itself first and the first neighbour last.
      const int id = k == 0 ? i : neighbors.Ids[k + 1 == this->Near.size() ? 0 : k];
      const unsigned char* rgb = colors.data() + 3 * static_cast<size_t>(id);
      const Eigen::Vector3d color(rgb[0], rgb[1], rgb[2]);
      sums[side] += color;
      squares += color.squaredNorm();
      ++counts[side];
    }
    if (counts[0] < 1.0 || counts[1] < 1.0)
    {
      return 0.0;
    }
    const double within =
      squares - sums[0].squaredNorm() / counts[0] - sums[1].squaredNorm() / counts[1];
    const double variance = std::max(0.0, within) / (counts[0] + counts[1]) + ColorNoise;
    return (sums[0] / counts[0] - sums[1] / counts[1]).squaredNorm() / variance;
  }

  /// From the point to the surface, along the normal of the plane below it.
  Vector3 Shift() const
  {
    const auto found = this->Surface.projectQueryPoint(pcl::MLSResult::SIMPLE, QuadricTerms);
    return { found.point[0], found.point[1], found.point[2] };
  }

  bool IsValid() const { return this->Surface.valid && this->Surface.c_vec.allFinite(); }

private:
  NearCloud Near;
  pcl::Indices Indices;
  pcl::MLSResult Surface;
};

class Smoother
{
public:
  Smoother(
    const LocalCloud& cloud, const NeighborSearch& tree, const std::vector<unsigned char>& colors)
    : Cloud(cloud)
    , Tree(tree)
    , Colors(colors)
    , Noise((cloud.Size() + PartSize - 1) / PartSize, 0.0)
  {
  }

  /// Returns false if stopped.
  bool MeasureNoise(const StageProgress& progress)
  {
    const vtkIdType parts = static_cast<vtkIdType>(this->Noise.size());
    vtkSMPTools::For(0, parts, 1, [&](vtkIdType begin, vtkIdType end) {
      for (vtkIdType part = begin; part < end; ++part)
      {
        this->Noise[part] = this->NoiseOf(static_cast<int>(part));
      }
    });
    return progress.Step(1.0);
  }

  bool IsNoisy() const
  {
    return std::any_of(
      this->Noise.begin(), this->Noise.end(), [](double noise) { return noise > 0.0; });
  }

  /// Returns false if stopped.
  bool Smooth(const StageProgress& progress, std::vector<Float3>& shifts) const
  {
    return ParallelFor(this->Cloud.Size(), progress, [&](vtkIdType begin, vtkIdType end) {
      Neighbors neighbors;
      Quadric quadric;
      for (int i = static_cast<int>(begin); i < end; ++i)
      {
        const double noise = this->Noise[i / PartSize];
        if (noise > 0.0)
        {
          const int count = static_cast<int>(NeighborsPerNoise * noise);
          this->Tree.FindNearest(i, std::clamp(count, LeastNeighbors, MostNeighbors), neighbors);
          shifts[i] = this->ShiftOf(i, neighbors, quadric);
        }
      }
    });
  }

private:
  /// Standard deviation of the noise in a part, in spacings; 0: none.
  double NoiseOf(int part) const
  {
    const int begin = part * PartSize;
    const int size = std::min(PartSize, this->Cloud.Size() - begin);
    const int samples = std::min(size, SamplesPerPart);
    std::vector<double> deviations, kurtoses, contrasts;
    int clean = 0;
    Neighbors neighbors;
    Quadric quadric;
    for (int k = 0; k < samples; ++k)
    {
      const int i = begin + static_cast<int>(static_cast<vtkIdType>(k) * size / samples);
      this->Tree.FindNearest(i, NearFit, neighbors);
      quadric.Fit(this->Cloud, i, neighbors);
      const double spacing = SpacingOf(neighbors);
      if (!quadric.IsValid() || quadric.Measure(spacing).Deviation < CleanResidual)
      {
        ++clean;
        continue;
      }
      this->Tree.FindNearest(i, WideFit, neighbors);
      quadric.Fit(this->Cloud, i, neighbors);
      if (quadric.IsValid())
      {
        const Residuals residuals = quadric.Measure(SpacingOf(neighbors));
        deviations.push_back(residuals.Deviation);
        kurtoses.push_back(residuals.Kurtosis);
        if (!this->Colors.empty())
        {
          contrasts.push_back(quadric.ColorContrast(i, neighbors, this->Colors));
        }
      }
    }
    if (clean >= CleanShare * samples || kurtoses.empty())
    {
      return 0.0;
    }
    const bool isNoise =
      Median(kurtoses) > LeastKurtosis || (!contrasts.empty() && Median(contrasts) < SameColors);
    return isNoise ? Median(deviations) : 0.0;
  }

  Vector3 ShiftOf(int i, const Neighbors& neighbors, Quadric& quadric) const
  {
    quadric.Fit(this->Cloud, i, neighbors);
    if (!quadric.IsValid())
    {
      return {};
    }
    const double spacing = SpacingOf(neighbors);
    const double deviation = quadric.Measure(spacing).Deviation;
    const Vector3 shift = quadric.Shift();
    const double limit = LargestShift * deviation * spacing;
    const bool isNoise = deviation > CleanResidual && Dot(shift, shift) <= limit * limit;
    return isNoise ? shift : Vector3{};
  }

  const LocalCloud& Cloud;
  const NeighborSearch& Tree;
  const std::vector<unsigned char>& Colors;
  std::vector<double> Noise; // of each part, in spacings
};
}

bool SmoothNoise(const LocalCloud& cloud, const NeighborSearch& tree,
  const std::vector<unsigned char>& colors, const StageProgress& progress,
  std::vector<Float3>& shifts)
{
  shifts.clear();
  if (cloud.Size() <= WideFit)
  {
    return true; // too few to tell noise from shape
  }
  Smoother smoother(cloud, tree, colors);
  if (!smoother.MeasureNoise(progress.Part(0.0, 0.1)))
  {
    return false;
  }
  if (!smoother.IsNoisy())
  {
    return true;
  }
  shifts.resize(cloud.Size());
  return smoother.Smooth(progress.Part(0.1, 1.0), shifts);
}
}
