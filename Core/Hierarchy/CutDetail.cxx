// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Hierarchy/CutDetail.h"

#include "Core/Surfels/SurfelCloud.h"

#include <algorithm>
#include <limits>

namespace SurfelSplatting
{
namespace
{
/// The leaves of captures overlap and are no finer than their node. Where the lens blurs, only the
/// variance of their places counts. In focus their own variance counts too, for their colours; half
/// of it where the lens has this many times the variance of the pixel filter.
constexpr double UncountedFrom = 2.0;

/// An entry of the ClusterBounds draws its nodes of at most this many levels below. More would
/// draw parts of it too finely, less would visit more entries.
constexpr int MaxLevelsBelow = 4;

/// Nodes merge with their siblings while the allowed size grows by this factor, up to that of their
/// parents. In a wider band pixels change less from frame to frame (1.05: a lion's by up to 3.1
/// levels in a focus pull at 12 px, 1.1: 2.7), but 1.15 loses 0.1 dB at 36 px.
constexpr double MergingBand = 1.1;

/// By how many levels the limits of an entry's children part while its own level falls by one.
constexpr double LimitSlope = 2.0;

/// 0 below 0, 1 above 1.
double SmoothStep(double x)
{
  const double u = std::fmin(1.0, std::fmax(0.0, x));
  return u * u * (3.0 - 2.0 * u);
}

/// Factor of the allowed size of a node that is not coherent.
double CoherenceFactor(double coherence)
{
  return std::fmin(1.0, std::fmax(0.1, (coherence - 0.6) / 0.35));
}

/// Not std::hypot: it rounds differently from glibc 2.35 on, which machines with older ones lack.
double SumOfDeviations(double x, double y)
{
  return std::sqrt(x * x + y * y);
}
}

CutDetail::CutDetail(const SurfelCloud& cloud, const CutCamera& camera, const CutSettings& settings,
  const CutView& view)
  : Table(*cloud.Clusters)
  , Seen(view)
  , Settings(settings)
  , InSpace(cloud.IsInSpace())
  , Prefilter(camera.Prefilter)
{
  // Against all surfels this loses up to 0.15 dB on ray-traced scenes up to 12 px of blur, 0.92 at
  // 36 px; in focus, with about one node per pixel, the picture has 50 dB or more. With 0.34 and
  // 0.80 the loss was 0.11 and 0.63, and blurred frames took 5 % longer. Shaded volumes lose 1 to 2
  // dB at 36 px, and 1 more with 0.42 and 0.95.
  constexpr Shares ofSurfels{ 0.37, 0.84 };
  constexpr Shares ofGaussians{ 0.37, 0.90 };
  this->Share = this->InSpace ? ofGaussians : ofSurfels;
  this->Share.OfLens *= settings.BlurGain;
}

double CutDetail::LevelOf(const CutWork::Subtree& at, const NodeBall& ball) const
{
  const AllowedExtent allowed = this->Allow(ball);
  if (!(allowed.Sigma > 0.0))
  {
    return -1.0;
  }
  return this->Settings.Rule == CutRule::Paper
    ? this->SteppedLevel(at, allowed)
    : std::fmin(std::fmax(this->ContinuousLevel(at, allowed), at.Least), at.Limit);
}

bool CutDetail::IsNear(const CutWork::Subtree& at, double level) const
{
  return level >= at.Level - MaxLevelsBelow || at.Level == this->Table.LowestLevel(at.Tree);
}

CutWork::Subtree CutDetail::Below(const CutWork::Subtree& at, double level) const
{
  const double border = at.Level - MaxLevelsBelow, way = LimitSlope * (border - level);
  const bool paper = this->Settings.Rule == CutRule::Paper;
  return { at.Tree, at.Level - 1, 2 * at.Index, border - way, paper ? at.Limit : border + way };
}

RunDeviations CutDetail::DeviationsOf(const CutWork::Subtree& at, const CutRange& run) const
{
  const int level = static_cast<int>(run.Level), parent = level + (run.Merging > 0.0f ? 1 : 0);
  const NodeExtent &own = this->ExtentAt(at, level), &merged = this->ExtentAt(at, parent);
  if (!this->InSpace)
  {
    // No variance is above that of a leaf plus that of the leaves' places.
    const double leaf = this->Table.Get(at.Level, at.Tree, at.Index).LeafSigma;
    return { SumOfDeviations(leaf, std::fmax(own.Size, merged.Size)), 0.0 };
  }
  const int above = level + LevelsToAncestors;
  const bool has = run.Count >= 1u << LevelsToAncestors && above <= at.Level;
  return { std::fmax(own.Sigma, merged.Sigma), has ? this->ExtentAt(at, above).Sigma : 0.0 };
}

/// Largest extent of a node whose coarseness is nowhere in the ball visible.
CutDetail::AllowedExtent CutDetail::Allow(const NodeBall& ball) const
{
  if (this->Settings.Rule == CutRule::Leaves || !(this->Settings.Error > 0.0))
  {
    return { -1.0, 0.0 };
  }
  if (this->Seen.IsAroundLens(ball))
  {
    return { -1.0, 0.0 };
  }
  const double confusion = this->Seen.SmallestConfusion(ball);
  const double h = this->Prefilter, perPixel = this->Seen.WidthOfPixel(ball);
  if (this->Settings.Rule == CutRule::Paper)
  {
    return { this->Settings.Error * std::fmax(confusion, std::sqrt(h)) * perPixel, 0.0 };
  }
  const double blur =
    SumOfDeviations(this->Share.OfPixel * std::sqrt(h), this->Share.OfLens * 0.5 * confusion);
  const double variance = 0.25 * confusion * confusion;
  return { this->Settings.Error * blur * perPixel, variance / (variance + UncountedFrom * h) };
}

/// The extents of the nodes of a level below an entry, or its own.
const NodeExtent& CutDetail::ExtentAt(const CutWork::Subtree& at, int level) const
{
  return level == at.Level ? this->Table.Get(at.Level, at.Tree, at.Index).Extent
                           : this->Table.Below(at.Level, at.Tree, at.Index)[at.Level - 1 - level];
}

/// Size that must be allowed so that the nodes of a level below an entry may be drawn.
double CutDetail::NeededSize(const CutWork::Subtree& at, int level, double ofLeaves) const
{
  const NodeExtent& extent = this->ExtentAt(at, level);
  const double size = this->Settings.Rule == CutRule::Paper ? extent.Size : extent.Sigma;
  return this->InSpace ? size * std::sqrt(std::fmax(0.0, 1.0 - ofLeaves * (1.0 - extent.Coherence)))
                       : size / CoherenceFactor(extent.Coherence);
}

double CutDetail::SteppedLevel(const CutWork::Subtree& at, const AllowedExtent& allowed) const
{
  const int lowest = std::max(1, at.Level - ClusterBounds::LevelsBelow);
  int level = at.Level;
  while (level >= lowest && allowed.Sigma < this->NeededSize(at, level, allowed.OfLeaves))
  {
    --level;
  }
  return level >= lowest ? level : -1.0;
}

/// The coarsest level that is fine enough, whatever finer ones are. A continuous function of the
/// allowed size. Below the known levels it goes on with half an octave per level.
double CutDetail::ContinuousLevel(const CutWork::Subtree& at, const AllowedExtent& allowed) const
{
  const int lowest = std::max(0, at.Level - ClusterBounds::LevelsBelow);
  double coarser = std::numeric_limits<double>::infinity(); // what the level above needs
  for (int level = at.Level; level >= lowest; --level)
  {
    const double needed = level > 0
      ? std::fmin(this->NeededSize(at, level, allowed.OfLeaves), coarser * (1.0 / MergingBand))
      : 0.0;
    if (allowed.Sigma >= needed)
    {
      return level +
        SmoothStep((MergingBand * allowed.Sigma / coarser - 1.0) / (MergingBand - 1.0));
    }
    coarser = needed;
  }
  return lowest + 2.0 * std::log2(allowed.Sigma / coarser);
}
}
