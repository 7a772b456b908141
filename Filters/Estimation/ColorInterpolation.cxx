// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/ColorInterpolation.h"

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
constexpr float Reach = 3.0f;

/// Ranks of neighbours at about one spacing and at about two: those before and those from here.
constexpr int EndOfNear = 5, BeginOfFar = 12;

/// With this share of noise nothing is sharpened.
constexpr float LargestNoise = 0.4f;

/// A straight line through the mean squared differences of colours at two distances, 8 bits
/// squared.
struct Variogram
{
  float Nugget = 0.0f; // at distance 0; below 0 where colours are smooth
  float AtOneSpacing = 0.0f;
};

using Variograms = RawVector<Variogram>;

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

  Variogram MeasureNoise(int i) const
  {
    float differences[2] = {}, distances[2] = {}, counts[2] = {};
    const int* row = this->Oriented.Graph.Row(static_cast<size_t>(i));
    for (int k = 0; k < KeptNeighbors && row[k] >= 0; ++k)
    {
      const int bin = k < EndOfNear ? 0 : 1;
      Vector3 d;
      if ((bin == 0 || k >= BeginOfFar) && this->IsOfSheet(i, row[k], d))
      {
        differences[bin] += this->SquaredDifference(i, row[k]);
        distances[bin] += static_cast<float>(std::sqrt(Dot(d, d)));
        ++counts[bin];
      }
    }
    const float spacing = this->Fits[i].Spacing;
    if (counts[0] == 0.0f || counts[1] == 0.0f || !(spacing > 0.0f))
    {
      return {};
    }
    const float near = distances[0] / counts[0] / spacing, far = distances[1] / counts[1] / spacing;
    const float difference = differences[0] / counts[0];
    const float slope =
      far > near ? (differences[1] / counts[1] - difference) / (far - near) : 0.0f;
    return { difference - near * slope, difference + (1.0f - near) * slope };
  }

  void Interpolate(int i, const Variograms& variograms, unsigned char* result) const
  {
    const unsigned char* own = this->Color(i);
    const float sharpness = this->Sharpness(i, variograms);
    float mean[ColorComponents];
    this->Mix(i, mean);
    for (int c = 0; c < ColorComponents; ++c)
    {
      const auto color = static_cast<float>(own[c]);
      result[c] = static_cast<unsigned char>(
        std::clamp(color + sharpness * (color - mean[c]), 0.0f, 255.0f) + 0.5f);
    }
  }

private:
  const unsigned char* Color(int i) const
  {
    return this->Colors.data() + ColorComponents * static_cast<size_t>(i);
  }

  /// @param d the vector from i to j
  bool IsOfSheet(int i, int j, Vector3& d) const
  {
    d = Load(this->Oriented.Cloud.Position(j)) - Load(this->Oriented.Cloud.Position(i));
    const bool isEither = this->Oriented.TwoSided[i] || this->Oriented.TwoSided[j];
    return AreOfOneSheet(this->Fits[i], this->Fits[j], isEither, d);
  }

  float SquaredDifference(int i, int j) const
  {
    float sum = 0.0f;
    for (int c = 0; c < ColorComponents; ++c)
    {
      const auto difference = static_cast<float>(this->Color(i)[c] - this->Color(j)[c]);
      sum += difference * difference;
    }
    return sum;
  }

  /// From 1, where colours have no noise, to 0.
  float Sharpness(int i, const Variograms& variograms) const
  {
    Variogram sum = variograms[i];
    const int* row = this->Oriented.Graph.Row(static_cast<size_t>(i));
    for (int k = 0; k < KeptNeighbors && row[k] >= 0; ++k)
    {
      sum.Nugget += variograms[row[k]].Nugget;
      sum.AtOneSpacing += variograms[row[k]].AtOneSpacing;
    }
    return sum.Nugget > 0.0f ? std::max(0.0f, 1.0f - sum.Nugget / (LargestNoise * sum.AtOneSpacing))
                             : 1.0f;
  }

  /// The mean of the colours about point i, as the kernels of its neighbours mix them.
  void Mix(int i, float mean[ColorComponents]) const
  {
    const float deviation = this->Blur * this->Fits[i].Spacing;
    const float inverse = 1.0f / (deviation * deviation);
    float sum = 1.0f;
    std::copy_n(this->Color(i), ColorComponents, mean);
    const int* row = this->Oriented.Graph.Row(static_cast<size_t>(i));
    for (int k = 0; k < KeptNeighbors && row[k] >= 0; ++k)
    {
      Vector3 d;
      const bool isOfSheet = this->IsOfSheet(i, row[k], d);
      const float squared = inverse * static_cast<float>(Dot(d, d));
      if (!(squared < Reach * Reach))
      {
        break;
      }
      if (isOfSheet)
      {
        const float weight = std::exp(-0.5f * squared);
        sum += weight;
        for (int c = 0; c < ColorComponents; ++c)
        {
          mean[c] += weight * static_cast<float>(this->Color(row[k])[c]);
        }
      }
    }
    for (int c = 0; c < ColorComponents; ++c)
    {
      mean[c] /= sum;
    }
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
  Variograms variograms(static_cast<size_t>(count));
  CloudColors result(colors.size());
  const bool finished = ParallelFor(count, progress.Part(0.0, 0.5),
                          [&](vtkIdType i, vtkIdType end) {
                            for (; i < end; ++i)
                            {
                              variograms[i] = interpolator.MeasureNoise(static_cast<int>(i));
                            }
                          }) &&
    ParallelFor(count, progress.Part(0.5, 1.0), [&](vtkIdType i, vtkIdType end) {
      for (; i < end; ++i)
      {
        interpolator.Interpolate(
          static_cast<int>(i), variograms, result.data() + ColorComponents * i);
      }
    });
  colors = std::move(result);
  return finished;
}
}
