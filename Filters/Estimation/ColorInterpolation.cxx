// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/ColorInterpolation.h"

#include "Filters/Estimation/NearSheet.h"
#include "Filters/Estimation/SheetColors.h"
#include "Filters/Neighbors/ColorVariogram.h"
#include "Filters/Neighbors/LocalCloud.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace SurfelGeometry
{
namespace
{
/// The weights' standard deviation over that of the kernels: these are at the centroids of their
/// cells, up to a fifth of a spacing from the points, which would make 1.12 of it if kernels were
/// round. Pictures are 0.05 dB better with 1.06.
constexpr float Widening = 1.06f;

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

/// The neighbours' differences between two ranks.
DistanceBin Bin(const NearSheet& sheet, const SheetColors& colors, int begin, int end)
{
  DistanceBin bin;
  for (int k = begin; k < end; ++k)
  {
    if (sheet.OfSheet[k] != 0.0f)
    {
      bin.Add(colors.Squares[k], std::sqrt(sheet.X[k] * sheet.X[k] + sheet.Y[k] * sheet.Y[k]));
    }
  }
  return bin;
}

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

  /// @param sheet    becomes that of the point
  /// @param steering becomes the point's
  ColorFit Fit(int i, NearSheet& sheet, Float3& steering) const
  {
    ColorFit fit;
    steering = Float3();
    if (!(this->Fits[i].Spacing > 0.0f))
    {
      return fit;
    }
    SheetColors colors;
    const int* ids = this->Oriented.Graph.Row(static_cast<size_t>(i));
    const int count = CountIds(ids, KeptNeighbors);
    sheet.Load(this->Oriented, this->Fits, i, ids, count);
    colors.Load(this->Colors, sheet, i, ids, count);
    steering = SteeringFrom(SumColors(sheet, colors), this->Fits[i].Flatness, sheet.U, sheet.V);
    MeanColor(sheet, colors, this->Blur, fit.Detail);
    for (float& detail : fit.Detail)
    {
      detail = -detail;
    }
    fit.Variogram = ColorVariogram(
      Bin(sheet, colors, 0, EndOfNear), Bin(sheet, colors, BeginOfFar, NearSheet::Capacity));
    return fit;
  }

  void Interpolate(int i, const ColorFits& fits, unsigned char* result) const
  {
    const float sharpness = this->Sharpness(i, fits);
    const unsigned char* own = this->Colors.data() + ColorComponents * static_cast<size_t>(i);
    for (int c = 0; c < ColorComponents; ++c)
    {
      const float color = static_cast<float>(own[c]) + sharpness * fits[i].Detail[c];
      result[c] = static_cast<unsigned char>(std::clamp(color, 0.0f, 255.0f) + 0.5f);
    }
  }

private:
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
  const StageProgress& progress, CloudColors& colors, SheetResults others)
{
  const Interpolator interpolator(oriented, fits, static_cast<float>(blur), colors);
  const vtkIdType count = oriented.Cloud.Size();
  ColorFits colorFits(static_cast<size_t>(count));
  CloudColors result(colors.size());
  others.Steering.resize(static_cast<size_t>(count));
  const auto fit = [&](vtkIdType i, vtkIdType end) {
    NearSheet sheet;
    for (; i < end; ++i)
    {
      colorFits[i] = interpolator.Fit(static_cast<int>(i), sheet, others.Steering[i]);
      if (others.Heights)
      {
        others.Heights->Rise(static_cast<int>(i), fits[i], sheet);
      }
    }
  };
  const bool finished = ParallelFor(count, progress.Part(0.0, 0.7), fit) &&
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
