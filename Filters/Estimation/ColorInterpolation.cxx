// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/ColorInterpolation.h"

#include "Filters/Common/ColorVariogram.h"
#include "Filters/Common/LocalCloud.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace SurfelGeometry
{
namespace
{
/// The weights' standard deviation over that of the kernels: these are at the centroids of their
/// cells, a fifth of a spacing from the points. (sqrt(0.4^2 + 0.2^2) / 0.4)
constexpr float Widening = 1.12f;

/// Points farther away than this many standard deviations have weights below 0.01.
constexpr float MixReach = 3.0f;

/// Ranks of neighbours at about one spacing and at about two: those before and those from here.
constexpr int EndOfNear = 5, BeginOfFar = 12;

/// With this share of noise nothing is sharpened.
constexpr float LargestNoise = 0.4f;

/// What the neighbours of a point say of its colour.
struct ColorFit
{
  ColorVariogram Variogram;
  float Detail[ColorComponents] = {}; // the colour less the mean under the kernels, 8 bits
};

using ColorFits = RawVector<ColorFit>;

class Interpolator
{
public:
  Interpolator(
    const OrientedCloud& oriented, const PlaneFits& fits, float blur, const CloudColors& colors)
    : Oriented(oriented)
    , Fits(fits)
    , Blur(Widening * blur)
    , Colors(colors)
  {
  }

  ColorFit Fit(int i) const
  {
    const float spacing = this->Fits[i].Spacing, deviation = this->Blur * spacing;
    if (!(deviation > 0.0f))
    {
      return {};
    }
    const float inverse = 1.0f / (deviation * deviation);
    DistanceBin near, far;
    float mixed[ColorComponents] = {}, weights = 1.0f;
    const int* row = this->Oriented.Graph.Row(static_cast<size_t>(i));
    for (int k = 0; k < KeptNeighbors && row[k] >= 0; ++k)
    {
      const Float3 d = this->Difference(i, row[k]);
      const float squared = SingleDot(d, d);
      const bool isMixed = inverse * squared < MixReach * MixReach;
      const bool isOfBin = k < EndOfNear || k >= BeginOfFar;
      if ((!isMixed && !isOfBin) || !this->IsOfSheet(i, row[k], d))
      {
        continue;
      }
      float difference[ColorComponents];
      const float squaredDifference = this->Subtract(row[k], i, difference);
      if (isOfBin)
      {
        (k < EndOfNear ? near : far).Add(squaredDifference, std::sqrt(squared) / spacing);
      }
      if (isMixed)
      {
        const float weight = std::exp(-0.5f * inverse * squared);
        weights += weight;
        for (int c = 0; c < ColorComponents; ++c)
        {
          mixed[c] += weight * difference[c];
        }
      }
    }
    ColorFit fit{ ColorVariogram(near, far) };
    for (int c = 0; c < ColorComponents; ++c)
    {
      fit.Detail[c] = -mixed[c] / weights;
    }
    return fit;
  }

  void Interpolate(int i, const ColorFits& fits, unsigned char* result) const
  {
    const float sharpness = this->Sharpness(i, fits);
    const unsigned char* own = this->Color(i);
    for (int c = 0; c < ColorComponents; ++c)
    {
      const float color = static_cast<float>(own[c]) + sharpness * fits[i].Detail[c];
      result[c] = static_cast<unsigned char>(std::clamp(color, 0.0f, 255.0f) + 0.5f);
    }
  }

private:
  const unsigned char* Color(int i) const
  {
    return this->Colors.data() + ColorComponents * static_cast<size_t>(i);
  }

  /// The vector from i to j.
  Float3 Difference(int i, int j) const
  {
    const float* from = this->Oriented.Cloud.Position(i);
    const float* to = this->Oriented.Cloud.Position(j);
    Float3 d;
    d.X = to[0] - from[0];
    d.Y = to[1] - from[1];
    d.Z = to[2] - from[2];
    return d;
  }

  bool IsOfSheet(int i, int j, const Float3& d) const
  {
    const bool isEither = this->Oriented.TwoSided[i] || this->Oriented.TwoSided[j];
    return AreOfOneSheet(this->Fits[i], this->Fits[j], isEither, d);
  }

  /// The difference of two colours. Returns its square.
  float Subtract(int i, int j, float difference[ColorComponents]) const
  {
    float sum = 0.0f;
    for (int c = 0; c < ColorComponents; ++c)
    {
      difference[c] = static_cast<float>(this->Color(i)[c] - this->Color(j)[c]);
      sum += difference[c] * difference[c];
    }
    return sum;
  }

  /// From 1, where colours have no noise, to 0.
  float Sharpness(int i, const ColorFits& fits) const
  {
    ColorVariogram sum = fits[i].Variogram;
    const int* row = this->Oriented.Graph.Row(static_cast<size_t>(i));
    for (int k = 0; k < KeptNeighbors && row[k] >= 0; ++k)
    {
      sum.Add(fits[row[k]].Variogram);
    }
    return std::max(0.0f, 1.0f - sum.ShareOfNoise() / LargestNoise);
  }

  const OrientedCloud& Oriented;
  const PlaneFits& Fits;
  const float Blur; // spacings
  const CloudColors& Colors;
};
}

bool InterpolateColors(const OrientedCloud& oriented, const PlaneFits& fits, double blur,
  const StageProgress& progress, CloudColors& colors)
{
  const Interpolator interpolator(oriented, fits, static_cast<float>(blur), colors);
  const vtkIdType count = oriented.Cloud.Size();
  ColorFits colorFits(static_cast<size_t>(count));
  CloudColors result(colors.size());
  const bool finished = ParallelFor(count, progress.Part(0.0, 0.7),
                          [&](vtkIdType i, vtkIdType end) {
                            for (; i < end; ++i)
                            {
                              colorFits[i] = interpolator.Fit(static_cast<int>(i));
                            }
                          }) &&
    ParallelFor(count, progress.Part(0.7, 1.0), [&](vtkIdType i, vtkIdType end) {
      for (; i < end; ++i)
      {
        interpolator.Interpolate(
          static_cast<int>(i), colorFits, result.data() + ColorComponents * i);
      }
    });
  colors = std::move(result);
  return finished;
}
}
