// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Cleaning/Smoothing.h"

#include "Filters/Cleaning/CleaningProblem.h"
#include "Filters/Cleaning/ColorVote.h"
#include "Filters/Cleaning/FoldFit.h"
#include "Filters/Cleaning/LocalQuadric.h"
#include "Filters/Common/Median.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Neighbors/MortonGrid.h"
#include "Filters/Neighbors/NeighborSearch.h"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace SurfelGeometry
{
namespace
{
/// A part has about this many points, neighbours in Morton order: more than a leaf or a wire has,
/// so that a part has other surfaces than thin ones. Samples tell how noisy it is.
constexpr int PartSize = 1 << 15;
constexpr int SamplesPerPart = 256;

/// Neighbours of the fits that tell noise: of the first, which few surfaces are too curved for, and
/// of the second, whose residuals are many enough for their distribution.
constexpr int NearFit = 16;
constexpr int WideFit = 64;

/// A part with this share of points whose fit is clean has no noise.
constexpr double CleanShare = 0.1;

/// The least kurtosis of a symmetric distribution with one maximum (that of the uniform one); noise
/// has 3, two sheets have 1.
constexpr double LeastKurtosis = 1.8;

/// Where the smallest variance of MostNeighbors points is above this part of the middle one, they
/// fill space: foliage with a few points a leaf, not a surface with noise. Noise of two spacings
/// has 0.3, uniform points in a ball have 0.85, and fewer leaves in a ball less.
constexpr double LargestThickness = 0.5;

/// Residuals of surfaces with noise stay the same if there are more neighbours. Those of foliage
/// grow with the neighbourhood: a part has leaves if they grow so much from FewerNeighbors of the
/// neighbours to all at so many of its samples (of scanned trees 0.45 to 0.7, of a dragon of ten
/// spacings with noise 0.3), and there each point tells whether it is smoothed.
constexpr double FewerNeighbors = 0.4;
constexpr double LargestGrowth = 1.4;
constexpr double LeafyShare = 0.4;

/// Noise below this deviation, in spacings, is smoothed by few neighbours, which hardly harms.
constexpr double LeastLeafy = 0.4;

/// Neighbours of the smoothing for noise of one spacing: more gain nothing, as fewer do for less
/// noise.
constexpr double NeighborsPerNoise = 100.0;
constexpr int LeastNeighbors = 32;
constexpr int MostNeighbors = 160;

/// Points farther from the surface than this many standard deviations of the noise are not moved.
constexpr double LargestShift = 4.0;

/// Where the quadric leaves more than this many times the noise of the part, that is shape: the two
/// faces of a board, which would become one. Such points are only moved to folds. (Of walls and
/// statues, whose noise depends on the angle to the scanner, 1 % has more than 2.4 times; of
/// shelves in a scanned room, half has more than 3 times. With 3, thin tubes with few noisy points,
/// which are better as flat sheets, lose 0.2 dB; with 4 nothing.)
constexpr double LargestMisfit = 4.0;

/// Noise below LeastLeafy harms less than the smoothing of shape: there a smaller misfit is shape,
/// too, if it grows so much with the neighbourhood: spokes, leaves, stalks. (1.5 alone is exceeded
/// by walls that face a scanner, among floors that it looks along: a car has 0.7 dB less.)
constexpr double SlightMisfit = 1.5;
constexpr double SlightGrowth = 1.3;

/// Folds need more points than quadrics to be seen in noise; beyond this noise, in spacings, more
/// than MostNeighbors.
constexpr double FoldNeighbors = 2.5;
constexpr int LeastFoldNeighbors = 64;
constexpr double LargestFoldNoise = 1.6;
constexpr int MostFoldNeighbors = 400;

/// No fold is where the slope of the quadric changes less (at one of 30 degrees, without noise and
/// in the middle of the points, by 0.55).
constexpr double LeastBend = 0.4;

/// The variance about a fold is that of the noise, which the quadric of the smoothing knows. About
/// tubes and leaves it is larger: so most of these are known before a quadric is fitted to as many
/// points. (With 1.5 some of the points near corners of boxes are lost.)
constexpr double FoldVariance = 3.0;

/// A fold is better than the quadric through its points if it has so much of its squares.
constexpr double FoldShare = 0.85;

Vector3 ColorOf(const CloudColors& colors, int i)
{
  const unsigned char* color = colors.data() + ColorComponents * static_cast<size_t>(i);
  return { 1.0 * color[0], 1.0 * color[1], 1.0 * color[2] };
}

/// Puts the point and its nearest neighbours to the vote on its colour.
/// @param colorOf gives the colour of a point
template <typename Colors>
void PutVoters(const LocalQuadric& quadric, int i, const Neighbors& neighbors,
  const Colors& colorOf, ColorVote& vote)
{
  const double inverse = 1.0 / SpacingOf(neighbors);
  vote.Begin();
  for (int k = 0; k <= neighbors.Count() && !vote.IsFull(); ++k)
  {
    double u, v;
    quadric.Project(k, u, v);
    vote.Add(static_cast<float>(inverse * u), static_cast<float>(inverse * v),
      colorOf(k == 0 ? i : neighbors.Ids[k - 1]));
  }
}

/// What the fits at a sample say.
struct SampleFit
{
  float Deviation = 0.0f; // of the residuals, in spacings; 0: clean
  float Kurtosis = 0.0f;  // of the residuals; 0: unknown
  float Contrast = -1.0f; // of the colours; -1: unknown
  float Thickness = 0.0f; // smallest variance over the middle one
  float Growth = 0.0f;    // of the residuals
  ColorVariogram Colors;
};

/// What is known of a part of the cloud, in spacings.
struct PartNoise
{
  double Deviation = 0.0;    // of the points from the surface; 0: none
  float Displacement = 0.0f; // of the colours along the surface
  bool IsThick = false;      // the points fill space, so that their deviation is not known
  bool IsLeafy = false;      // some points do
};

/// The noise of a part by its fits; without what its colours tell.
PartNoise NoiseOf(const SampleFit* begin, const SampleFit* end)
{
  std::vector<float> deviations, kurtoses, contrasts, thicknesses;
  int clean = 0, growing = 0;
  for (const SampleFit* fit = begin; fit < end; ++fit)
  {
    clean += fit->Deviation == 0.0f ? 1 : 0;
    if (fit->Kurtosis > 0.0f)
    {
      deviations.push_back(fit->Deviation);
      kurtoses.push_back(fit->Kurtosis);
      thicknesses.push_back(fit->Thickness);
      growing += fit->Growth > LargestGrowth ? 1 : 0;
    }
    if (fit->Contrast >= 0.0f)
    {
      contrasts.push_back(fit->Contrast);
    }
  }
  PartNoise noise;
  if (clean >= CleanShare * static_cast<double>(end - begin) || kurtoses.empty())
  {
    return noise;
  }
  noise.IsThick = Median(thicknesses) > LargestThickness;
  const bool isNoise =
    Median(kurtoses) > LeastKurtosis || (!contrasts.empty() && Median(contrasts) < SameColors);
  noise.Deviation = isNoise && !noise.IsThick ? Median(deviations) : 0.0;
  noise.IsLeafy =
    noise.Deviation > LeastLeafy && growing > LeafyShare * static_cast<double>(deviations.size());
  return noise;
}

PartNoise PartNoiseOf(const SampleFit* begin, const SampleFit* end)
{
  ColorVariogram sum;
  for (const SampleFit* fit = begin; fit < end; ++fit)
  {
    sum.Add(fit->Colors);
  }
  PartNoise noise = NoiseOf(begin, end);
  noise.Displacement = static_cast<float>(noise.Deviation) * ColorVote::Displacement(sum);
  return noise;
}

/// The noise of each part of a cloud: runs of samples in Morton order.
class NoiseMap
{
public:
  /// @param values x, y, z, and the fit of each sample
  explicit NoiseMap(const std::vector<float>& values)
    : Grid(PositionsOf(values))
  {
    const size_t samples = values.size() / Stride;
    std::vector<std::pair<std::uint64_t, size_t>> order(samples);
    for (size_t k = 0; k < samples; ++k)
    {
      order[k] = { this->Grid.Key(&values[Stride * k]), k };
    }
    std::sort(order.begin(), order.end());
    std::vector<SampleFit> fits(samples);
    for (size_t k = 0; k < samples; ++k)
    {
      const float* fit = &values[Stride * order[k].second + 3];
      fits[k] = { fit[0], fit[1], fit[2], fit[3], fit[4], {} };
      fits[k].Colors.Nugget = fit[5];
      fits[k].Colors.AtOneSpacing = fit[6];
    }
    const size_t parts = std::max<size_t>(1, samples / SamplesPerPart);
    for (size_t part = 0; part < parts; ++part)
    {
      const size_t begin = part * samples / parts, end = (part + 1) * samples / parts;
      this->Firsts.push_back(begin < samples ? order[begin].first : 0);
      this->Noise.push_back(PartNoiseOf(fits.data() + begin, fits.data() + end));
    }
  }

  static constexpr size_t Stride = 10;

  PartNoise At(const Float3& place) const
  {
    const float position[3] = { place.X, place.Y, place.Z };
    const auto next =
      std::upper_bound(this->Firsts.begin() + 1, this->Firsts.end(), this->Grid.Key(position));
    return this->Noise[static_cast<size_t>(next - this->Firsts.begin()) - 1];
  }

  bool IsNoisy() const
  {
    return std::any_of(this->Noise.begin(), this->Noise.end(),
      [](const PartNoise& noise) { return noise.Deviation > 0.0; });
  }

  bool IsThick() const
  {
    return std::any_of(
      this->Noise.begin(), this->Noise.end(), [](const PartNoise& noise) { return noise.IsThick; });
  }

private:
  static RawVector<float> PositionsOf(const std::vector<float>& values)
  {
    RawVector<float> positions;
    for (size_t at = 0; at < values.size(); at += Stride)
    {
      positions.insert(positions.end(), &values[at], &values[at] + 3);
    }
    return positions;
  }

  MortonGrid Grid;
  std::vector<std::uint64_t> Firsts; // key of the first sample of each part
  std::vector<PartNoise> Noise;      // of each part
};

class Smoother
{
public:
  Smoother(const CleaningProblem& problem, const SampledColors& colors)
    : Problem(problem)
    , Cloud(problem.Cloud())
    , Tree(*problem.Searched.Tree)
    , Colors(colors)
  {
  }

  /// Fits at samples: the values of a NoiseMap. Collective; returns false if stopped.
  bool Measure(bool running, std::vector<float>& values) const
  {
    const double total = static_cast<double>(this->Problem.Total());
    const double share = std::max(SamplesPerPart / total, 1.0 * SamplesPerPart / PartSize);
    const std::vector<int> samples = this->Problem.Samples(share);
    std::vector<SampleFit> fits(samples.size());
    ParallelFor(0, static_cast<vtkIdType>(samples.size()), [&](vtkIdType k, vtkIdType end) {
      PointFit fit;
      for (; k < end; ++k)
      {
        fits[k] = this->MeasureAt(samples[k], fit);
      }
    });
    for (size_t k = 0; k < samples.size(); ++k)
    {
      this->Problem.PutPosition(samples[k], values);
      values.insert(values.end(),
        { fits[k].Deviation, fits[k].Kurtosis, fits[k].Contrast, fits[k].Thickness, fits[k].Growth,
          fits[k].Colors.Nugget, fits[k].Colors.AtOneSpacing });
    }
    return this->Problem.Gather(running, values);
  }

  /// Own points of the parts that fill space.
  vtkIdType CountThick(const NoiseMap& map) const
  {
    std::atomic<vtkIdType> count{ 0 };
    ParallelFor(0, this->Cloud.Size(), [&](vtkIdType begin, vtkIdType end) {
      vtkIdType thick = 0;
      for (int i = static_cast<int>(begin); i < end; ++i)
      {
        thick += this->Problem.IsOwn(i) && map.At(this->Problem.SharedPosition(i)).IsThick ? 1 : 0;
      }
      count += thick;
    });
    return count;
  }

  /// @param colors of the points, or empty
  /// Returns false if stopped.
  bool Smooth(const NoiseMap& map, const CloudColors& colors, const StageProgress& progress,
    SmoothPoints& smooth) const
  {
    smooth.Shifts.resize(this->Cloud.Size());
    smooth.Colors = colors;
    std::atomic<vtkIdType> left{ 0 };
    const bool done =
      ParallelFor(this->Cloud.Size(), progress, [&](vtkIdType begin, vtkIdType end) {
        PointFit fit;
        ColorVote vote;
        vtkIdType leaves = 0;
        for (int i = static_cast<int>(begin); i < end; ++i)
        {
          const PartNoise noise =
            this->Problem.IsOwn(i) ? map.At(this->Problem.SharedPosition(i)) : PartNoise();
          if (noise.Deviation == 0.0 || !this->Fit(i, NeighborsFor(noise.Deviation), fit))
          {
            continue;
          }
          const double deviation = fit.Quadric.Deviation(1.0);
          if (noise.IsLeafy && this->Growth(i, deviation, fit) > LargestGrowth)
          {
            ++leaves;
            continue;
          }
          smooth.Shifts[i] =
            this->IsShape(i, noise, deviation, fit) ? Vector3{} : ShiftOf(fit, deviation);
          if (noise.Deviation < LargestFoldNoise && fit.Quadric.Bend() > LeastBend &&
            this->FitFold(i, fit))
          {
            smooth.Shifts[i] = fit.ToFold;
          }
          if (noise.Displacement > 0.0f)
          {
            PutVoters(
              fit.Quadric, i, fit.All, [&](int k) { return ColorOf(colors, k); }, vote);
            vote.Choose(
              noise.Displacement, smooth.Colors.data() + ColorComponents * static_cast<size_t>(i));
          }
        }
        left += leaves;
      });
    smooth.Thick += left;
    return done;
  }

private:
  /// The quadric through a point's neighbours, and through the nearest of them.
  struct PointFit
  {
    Neighbors All, Nearest, Wide;
    LocalQuadric Quadric, Near;
    FoldFit Fold;
    Vector3 ToFold; // from the point
  };

  static int NeighborsFor(double deviation)
  {
    return std::clamp(
      static_cast<int>(NeighborsPerNoise * deviation), LeastNeighbors, MostNeighbors);
  }

  bool Fit(int i, int count, PointFit& fit) const
  {
    this->Tree.FindNearest(i, count, fit.All);
    if (fit.All.Count() < NearFit)
    {
      return false; // a region with hardly any points
    }
    fit.Quadric.Fit(this->Cloud, i, fit.All);
    return fit.Quadric.IsValid();
  }

  /// Whether a fold is nearer to the points about point i than any quadric. A fold beyond the
  /// neighbours of the smoothing is none: the two planes are those of two things, such as leaves.
  bool FitFold(int i, PointFit& fit) const
  {
    const int count = static_cast<int>(FoldNeighbors * fit.All.Count());
    this->Tree.FindNearest(i, std::clamp(count, LeastFoldNeighbors, MostFoldNeighbors), fit.Wide);
    fit.Near.Load(this->Cloud, i, fit.Wide);
    const QuadricCloud& points = fit.Near.Points();
    const int nearest = fit.All.Count() + 1;
    const double squares = fit.Quadric.UnbiasedSquares();
    const double most = FoldVariance * squares * static_cast<double>(points.size()) / nearest;
    if (!fit.Fold.MayFit(points, fit.Quadric, most))
    {
      return false;
    }
    fit.Near.Fit(fit.Wide);
    if (!fit.Near.IsValid() || !fit.Fold.Fit(fit.Near, FoldShare * fit.Near.Squares()) ||
      fit.Fold.SquaresOf(points, nearest) >= squares ||
      fit.Fold.FoldDistance() > std::sqrt(fit.All.SquaredDistances.back()) ||
      fit.Fold.IsRounded(points, SpacingOf(fit.Wide)))
    {
      return false;
    }
    fit.ToFold = fit.Fold.Shift();
    return IsNear(fit.ToFold, fit.Fold.Deviation(points));
  }

  SampleFit MeasureAt(int i, PointFit& fit) const
  {
    SampleFit sample;
    if (!this->Fit(i, NearFit, fit) || fit.Quadric.Deviation(SpacingOf(fit.All)) < CleanResidual)
    {
      return sample;
    }
    sample.Deviation = CleanResidual;
    if (!this->Fit(i, WideFit, fit))
    {
      return sample;
    }
    const Residuals residuals = fit.Quadric.Measure(SpacingOf(fit.All));
    sample.Deviation = static_cast<float>(residuals.Deviation);
    sample.Kurtosis = static_cast<float>(residuals.Kurtosis);
    if (this->Colors.Array)
    {
      sample.Contrast = static_cast<float>(fit.Quadric.ColorContrast(i, fit.All, this->Colors));
      ColorVote vote;
      PutVoters(
        fit.Quadric, i, fit.All, [this](int k) { return this->Colors.Get(k); }, vote);
      sample.Colors = vote.Measure();
    }
    this->Tree.FindNearest(i, MostNeighbors, fit.All);
    sample.Thickness = static_cast<float>(LocalQuadric::Thickness(this->Cloud, i, fit.All));
    if (this->Fit(i, NeighborsFor(residuals.Deviation), fit))
    {
      const double deviation = fit.Quadric.Deviation(1.0);
      sample.Growth = static_cast<float>(this->Growth(i, deviation, fit));
    }
    return sample;
  }

  /// How many times as large the residuals are as those of the nearest neighbours.
  /// @param deviation of the residuals, world units
  double Growth(int i, double deviation, PointFit& fit) const
  {
    const auto fewer = static_cast<std::ptrdiff_t>(FewerNeighbors * fit.All.Count());
    const auto& ids = fit.All.Ids;
    const auto& distances = fit.All.SquaredDistances;
    fit.Nearest.Ids.assign(ids.begin(), ids.begin() + fewer);
    fit.Nearest.SquaredDistances.assign(distances.begin(), distances.begin() + fewer);
    fit.Near.Fit(this->Cloud, i, fit.Nearest);
    const double near = fit.Near.IsValid() ? fit.Near.Deviation(1.0) : 0.0;
    return near > 0.0 ? deviation / near : 0.0;
  }

  /// Whether the quadric misses more than noise.
  /// @param deviation of the residuals, world units
  bool IsShape(int i, const PartNoise& noise, double deviation, PointFit& fit) const
  {
    const double misfit = deviation / (noise.Deviation * SpacingOf(fit.All));
    const bool isSlight = misfit > SlightMisfit && noise.Deviation < LeastLeafy;
    return misfit > LargestMisfit || (isSlight && this->Growth(i, deviation, fit) > SlightGrowth);
  }

  /// @param deviation of the residuals, world units
  static Vector3 ShiftOf(const PointFit& fit, double deviation)
  {
    const Vector3 shift = fit.Quadric.Shift();
    const bool isNoise = deviation > CleanResidual * SpacingOf(fit.All) && IsNear(shift, deviation);
    return isNoise ? shift : Vector3{};
  }

  static bool IsNear(const Vector3& shift, double deviation)
  {
    const double limit = LargestShift * deviation;
    return Dot(shift, shift) <= limit * limit;
  }

  const CleaningProblem& Problem;
  const LocalCloud& Cloud;
  const NeighborSearch& Tree;
  const SampledColors& Colors;
};
}

bool SmoothNoise(const CleaningProblem& problem, vtkPointSet* input, const StageProgress& progress,
  SmoothPoints& smooth)
{
  smooth = SmoothPoints();
  if (problem.Total() <= WideFit)
  {
    return true; // too few to tell noise from shape
  }
  const SampledColors samples{ FindColors(input), problem.Cloud() };
  const Smoother smoother(problem, samples);
  std::vector<float> values;
  if (!smoother.Measure(progress.Step(0.0), values))
  {
    return false;
  }
  const NoiseMap map(values);
  smooth.Thick = map.IsThick() ? smoother.CountThick(map) : 0;
  if (!map.IsNoisy())
  {
    return progress.Step(1.0);
  }
  return smoother.Smooth(
    map, GatherColors(input, problem.Cloud()), progress.Part(0.1, 1.0), smooth);
}
}
