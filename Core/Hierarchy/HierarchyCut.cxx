// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Hierarchy/HierarchyCut.h"

#include "Core/Base/CoarseLevels.h"
#include "Core/Base/MemoryGuard.h"
#include "Core/Hierarchy/ClusterBounds.h"
#include "Core/Surfels/NodeMoments.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace SurfelSplatting
{
namespace
{
/// NodeExtent::Sigma of nodes at an error of 1, as shares of the deviations of lens blur and pixel.
struct Shares
{
  double OfLens, OfPixel;
};
/// Against all surfels it loses up to 0.11 dB on ray-traced scenes up to 12 px of blur, 0.63 at
/// 36 px; in focus, with about one node per pixel, the picture has 50 dB or more. Shaded volumes
/// lose 1 to 2 dB at 36 px, and 1 more with 0.42 and 0.95.
constexpr Shares OfSurfels{ 0.34, 0.80 };
constexpr Shares OfGaussians{ 0.37, 0.90 };
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

/// Ancestors of eight nodes are not drawn where they are larger than these by more than this, blur
/// included: they would have about as many fragments.
constexpr double LargestAncestor = 2.0;

/// By how many levels the limits of an entry's children part while its own level falls by one.
constexpr double LimitSlope = 2.0;

/// Farther beyond the picture, px, nothing is looked for: such boxes cover it from side to side.
constexpr double FarBeyond = 1e8;

/// Not std::hypot: it rounds differently from glibc 2.35 on, which machines with older ones lack.
double Length(double x, double y)
{
  return std::sqrt(x * x + y * y);
}

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

using Subtree = CutWork::Subtree;

/// Sphere in camera space that contains the centres of a node's leaves.
struct Ball
{
  Vector3 Center;
  double Radius;
  double Near() const { return this->Center[2] - this->Radius; }
  double Far() const { return this->Center[2] + this->Radius; }
};

/// x or y on the screen.
struct ScreenAxis
{
  double Focal;  ///< Fx or Fy of the view
  double Center; ///< Cx or Cy
  int Size;      ///< of the picture, px
  /// Lengths of the normals (Focal, border) of the planes through the lens and the borders.
  double LowNormal = Length(Focal, -Center), HighNormal = Length(Focal, Size - Center);
};

struct PixelInterval
{
  int Begin, End;
};

/// How large a node may be.
struct AllowedExtent
{
  double Sigma;    ///< standard deviation, or of the paper's rule the radius, local units
  double OfLeaves; ///< share of the leaves' own variance that is not counted, [0, 1]
};

/// Selects the cut of one cloud.
class CutSelector
{
public:
  CutSelector(const SurfelCloud& cloud, const CutCamera& camera, const CutSettings& settings)
    : Table(*cloud.Clusters)
    , Guard(cloud.Guard)
    , InSpace(cloud.IsInSpace())
    , Layout(Table.Layout())
    , Camera(camera.Projection)
    , Optics(camera.Optics)
    , LensVariance(camera.LensVariance)
    , CellShare(camera.CellShare)
    , LongestAxis(std::sqrt(camera.Optics.Shape.Largest()))
    , CellReach(camera.CellReach * LongestAxis)
    , SupportRadius(camera.SupportRadius)
    , Prefilter(camera.Prefilter)
    , Settings(settings)
    , Share(InSpace ? OfGaussians : OfSurfels)
    , LensShare(Share.OfLens * settings.BlurGain)
    , LocalToCamera(Affine3::Compose(Camera.WorldToCamera, cloud.LocalToWorld))
    , AreaToCamera(LocalToCamera.AreaMatrix())
    , FocalLength(std::fmax(std::abs(Camera.Fx), std::abs(Camera.Fy)))
    , AxisX{ Camera.Fx, Camera.Cx, Camera.Width }
    , AxisY{ Camera.Fy, Camera.Cy, Camera.Height }
  {
    Symmetric3 gram{}; // L'L
    for (const Vector3& row : this->LocalToCamera.L)
    {
      AddOuterProduct(gram, row, 1.0);
    }
    const double largest = gram.LargestEigenvalue();
    this->Scale = std::sqrt(largest);
    // Only similarities preserve the angles of cones.
    const double spread = std::abs(largest - gram.Trace() / 3.0);
    this->ConesHold = spread <= 1e-5 * largest;
  }

  void Walk(const Subtree& start, CutWork::Part& part) const
  {
    part.Runs.clear();
    part.Statistics = CutStatistics();
    part.Stack.assign(1, start);
    while (!part.Stack.empty())
    {
      const Subtree top = part.Stack.back();
      part.Stack.pop_back();
      this->Visit(top, part);
    }
  }

private:
  void Visit(const Subtree& at, CutWork::Part& part) const
  {
    CutStatistics& statistics = part.Statistics;
    ++statistics.VisitedNodes;
    const ClusterBounds::Node& node = this->Table.Get(at.Level, at.Tree, at.Index);
    if (this->Guard)
    {
      this->Guard->Need(&node, sizeof(node));
      this->Guard->Need(this->Table.Below(at.Level, at.Tree, at.Index),
        ClusterBounds::LevelsBelow * sizeof(NodeExtent));
    }
    const Ball ball{ this->LocalToCamera.Apply(
                       { node.Position[0], node.Position[1], node.Position[2] }),
      this->Scale * node.Extent.Size };
    if (this->Settings.SkipOutside && this->IsOutside(node, ball))
    {
      statistics.OutsideLeaves += this->LeavesOf(at);
      return;
    }
    if (this->Settings.SkipBackFaces && at.Tree == HierarchyLayout::OneSided &&
      this->FacesAway(node, ball))
    {
      statistics.BackLeaves += this->LeavesOf(at);
      return;
    }
    const double level = this->DetailLevel(at, this->Allow(ball));
    if (level >= at.Level - MaxLevelsBelow || at.Level == this->Table.LowestLevel(at.Tree))
    {
      this->Choose(at, std::fmax(level, 0.0), ball, part);
      return;
    }
    const Subtree left = this->Below(at, level);
    if (left.Index + 1 < this->Layout.Count(left.Level, at.Tree))
    {
      part.Stack.push_back(left);
      ++part.Stack.back().Index;
    }
    part.Stack.push_back(left);
  }

  /// Size that must be allowed so that the nodes of a level below an entry may be drawn.
  double NeededSize(const Subtree& at, int level, double ofLeaves) const
  {
    const NodeExtent& extent = this->ExtentAt(at, level);
    const double size = this->Settings.Rule == CutRule::Paper ? extent.Size : extent.Sigma;
    return this->InSpace
      ? size * std::sqrt(std::fmax(0.0, 1.0 - ofLeaves * (1.0 - extent.Coherence)))
      : size / CoherenceFactor(extent.Coherence);
  }

  /// The extents of the nodes of a level below an entry, or its own.
  const NodeExtent& ExtentAt(const Subtree& at, int level) const
  {
    return level == at.Level ? this->Table.Get(at.Level, at.Tree, at.Index).Extent
                             : this->Table.Below(at.Level, at.Tree, at.Index)[at.Level - 1 - level];
  }

  /// The coarsest level that is fine enough for a whole subtree, plus the share to which its nodes
  /// merge with their siblings. -1: none of those whose extents are known.
  double DetailLevel(const Subtree& at, const AllowedExtent& allowed) const
  {
    if (!(allowed.Sigma > 0.0))
    {
      return -1.0;
    }
    return this->Settings.Rule == CutRule::Paper
      ? this->SteppedLevel(at, allowed)
      : std::fmin(std::fmax(this->ContinuousLevel(at, allowed), at.Least), at.Limit);
  }

  double SteppedLevel(const Subtree& at, const AllowedExtent& allowed) const
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
  double ContinuousLevel(const Subtree& at, const AllowedExtent& allowed) const
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

  /// The first of an entry's children. Its own nodes and those of its children are of the same
  /// level when it becomes fine enough, so that nothing jumps.
  Subtree Below(const Subtree& at, double level) const
  {
    const double border = at.Level - MaxLevelsBelow, way = LimitSlope * (border - level);
    const bool paper = this->Settings.Rule == CutRule::Paper;
    return { at.Tree, at.Level - 1, 2 * at.Index, border - way, paper ? at.Limit : border + way };
  }

  std::uint64_t LeavesOf(const Subtree& at) const
  {
    return std::min<std::uint64_t>(
             (at.Index + 1) << at.Level, this->Layout.NumberOfLeaves(at.Tree)) -
      (at.Index << at.Level);
  }

  /// Chooses the nodes of a subtree at a level; its fraction is the share to which they merge.
  void Choose(const Subtree& at, double detail, const Ball& ball, CutWork::Part& part) const
  {
    const int level = static_cast<int>(detail);
    const int below = at.Level - level;
    const std::size_t first = at.Index << below;
    const std::size_t last =
      std::min<std::size_t>((at.Index + 1) << below, this->Layout.Count(level, at.Tree));
    CutRange run{ this->Layout.Begin(level, at.Tree) + first,
      static_cast<std::uint32_t>(last - first), static_cast<std::uint32_t>(level) };
    run.Merging = static_cast<float>(detail - level);
    if (run.Merging > 0.0f)
    {
      run.Parents = this->Layout.Begin(level + 1, at.Tree) + first / 2;
    }
    this->Place(this->LargestDeviations(at, run), ball, run);
    if (this->Settings.SkipOutside && IsEmpty(run.Box))
    {
      part.Statistics.OutsideLeaves += this->LeavesOf(at);
      return;
    }
    part.Statistics.Nodes += run.Count;
    part.Runs.push_back(run);
  }

  /// Largest standard deviations of a run's nodes, and of its ancestors; 0: it has none.
  struct Deviations
  {
    double Own, OfAncestors;
  };

  Deviations LargestDeviations(const Subtree& at, const CutRange& run) const
  {
    const int level = static_cast<int>(run.Level), parent = level + (run.Merging > 0.0f ? 1 : 0);
    const NodeExtent &own = this->ExtentAt(at, level), &merged = this->ExtentAt(at, parent);
    if (!this->InSpace)
    {
      // No variance is above that of a leaf plus that of the leaves' places.
      const double leaf = this->Table.Get(at.Level, at.Tree, at.Index).LeafSigma;
      return { this->Scale * Length(leaf, std::fmax(own.Size, merged.Size)), 0.0 };
    }
    const int above = level + LevelsToAncestors;
    const bool has = run.Count >= 1u << LevelsToAncestors && above <= at.Level;
    return { this->Scale * std::fmax(own.Sigma, merged.Sigma),
      has ? this->Scale * this->ExtentAt(at, above).Sigma : 0.0 };
  }

  /// Bounds a run's splats on the screen and in depth.
  void Place(const Deviations& deviations, const Ball& ball, CutRange& run) const
  {
    const View& v = this->Camera;
    const double sigma = std::fmax(deviations.Own, deviations.OfAncestors);
    run.HasAncestors = deviations.OfAncestors > 0.0;
    run.Box = { 0, 0, v.Width, v.Height };
    if (!v.Parallel && !(ball.Near() > 0.0))
    {
      return; // around the lens: anywhere on the screen
    }
    // A splat's z-range is 2 s_z + 0.5 s of its kernel, and thick kernels overestimate s by a
    // quarter: 2.63, and the rest is for rounding (test: Skips). That of a Gaussian in space is its
    // centre, of volumes and a deviation behind it: 0 and 1, and 0.1 for rounding (Boxes of runs).
    const double near = ball.Near() - (this->InSpace ? 0.1 : 2.7) * sigma;
    const double far = ball.Far() + (this->InSpace ? 1.1 : 2.7) * sigma;
    if (!(near <= far))
    {
      return; // wild values from a file: anywhere
    }
    run.Near = static_cast<float>(near - 1e-6 * std::abs(near)); // also after rounding to float
    run.Far = static_cast<float>(far + 1e-6 * std::abs(far));
    double confusion[2] = { 0.0, 0.0 }; // smallest and largest
    double stretch = 1.0, nearest = 1.0;
    if (!v.Parallel)
    {
      const double focus = this->Optics.FocalDistance;
      const double a = this->Optics.RelativeCircleOfConfusion(ball.Near());
      const double b = this->Optics.RelativeCircleOfConfusion(ball.Far());
      const bool inFocus = ball.Near() <= focus && focus <= ball.Far();
      confusion[0] = inFocus ? 0.0 : this->FocalLength * this->CellShare * std::fmin(a, b);
      confusion[1] = this->FocalLength * this->CellReach * std::fmax(a, b);
      nearest = ball.Near();
      stretch = Norm(ball.Center) / ball.Center[2] + ball.Radius / nearest;
    }
    run.Blur = static_cast<float>(confusion[0]);
    run.Wide = CoarseCell(this->Prefilter + 0.25 * confusion[0] * confusion[0]) > 1.0;
    const double perUnit = this->FocalLength * stretch / nearest;
    const double blur = this->Prefilter + 0.25 * confusion[0] * confusion[0];
    const double own = perUnit * deviations.Own, above = perUnit * deviations.OfAncestors;
    run.HasAncestors = run.HasAncestors &&
      above * above + blur <= LargestAncestor * LargestAncestor * (own * own + blur);
    const double size = run.HasAncestors ? std::fmax(own, above) : own;
    const double margin = this->LargestReach(size, confusion[1], run.Wide);
    const PixelInterval x = this->CoveredPixels(ball.Center[0], ball, this->AxisX, margin);
    const PixelInterval y = this->CoveredPixels(ball.Center[1], ball, this->AxisY, margin);
    run.Box = { x.Begin, y.Begin, x.End, y.End };
  }

  /// How far a splat may reach from its centre, px.
  /// @param size of the node, standard deviation, px @param confusion of its blur, C, px
  /// @param wide whether it may be on a coarse grid
  double LargestReach(double size, double confusion, bool wide) const
  {
    if (this->InSpace)
    {
      // The lens adds C^2 / 4; cells reach 1 / RunCellsPerDeviation = 0.714 of the blur's deviation
      // farther. Factors are 1 to 4 % larger, for packed covariances (test: Boxes of runs). The
      // paper's lens adds up to C^2 / 2.77, but what it blurs much ends nearer than SupportRadius.
      const double blur = this->Prefilter + 0.26 * confusion * confusion;
      return this->SupportRadius * std::sqrt(1.02 * size * size + blur) + 0.72 * std::sqrt(blur) +
        1.0;
    }
    // Nodes may be blurred by as much as they are wide (SetupConstants.h, MinNodeBlur).
    const double variance =
      2.0 * size * size + this->Prefilter + this->LensVariance * confusion * confusion;
    // Tents of coarse grids reach a cell farther than the splats.
    return this->SupportRadius * std::sqrt(variance) + (wide ? CoarseCell(variance) : 1.0);
  }

  /// Pixels that a ball with a margin about it covers along an axis. @param x of its centre
  PixelInterval CoveredPixels(
    double x, const Ball& ball, const ScreenAxis& axis, double margin) const
  {
    double low, high;
    const double f = axis.Focal, c = axis.Center, size = axis.Size;
    const double a = f * x - std::abs(f) * ball.Radius, b = f * x + std::abs(f) * ball.Radius;
    if (this->Camera.Parallel)
    {
      low = a;
      high = b;
    }
    else
    {
      low = std::fmin(a / ball.Near(), a / ball.Far());
      high = std::fmax(b / ball.Near(), b / ball.Far());
    }
    // What is beyond the picture from the lens's centre may be in that of a cell.
    const double beyond = this->Settings.Cells > 1 ? FarBeyond : 0.0;
    const auto place = [&](double at) {
      return static_cast<int>(std::fmin(std::fmax(at, -beyond), size + beyond));
    };
    return { place(std::floor(low + c - margin)), place(std::ceil(high + c + margin)) };
  }

  /// Largest extent of a node whose coarseness is nowhere in the ball visible.
  AllowedExtent Allow(const Ball& ball) const
  {
    if (this->Settings.Rule == CutRule::Leaves || !(this->Settings.Error > 0.0))
    {
      return { -1.0, 0.0 };
    }
    double confusion = 0.0, pixelsPerUnit = this->FocalLength;
    if (!this->Camera.Parallel)
    {
      const double near = ball.Near(), far = ball.Far();
      if (!(near > 0.0))
      {
        return { -1.0, 0.0 }; // around the lens
      }
      const double focus = this->Optics.FocalDistance;
      if (!(near <= focus && focus <= far))
      {
        confusion = this->FocalLength * this->CellShare *
          std::fmin(this->Optics.RelativeCircleOfConfusion(near),
            this->Optics.RelativeCircleOfConfusion(far));
      }
      // Off the axis the projection stretches lengths by 1 / cos.
      pixelsPerUnit *= Norm(ball.Center) / (ball.Center[2] * near);
    }
    const double h = this->Prefilter, perPixel = 1.0 / (pixelsPerUnit * this->Scale);
    if (this->Settings.Rule == CutRule::Paper)
    {
      return { this->Settings.Error * std::fmax(confusion, std::sqrt(h)) * perPixel, 0.0 };
    }
    const double blur =
      Length(this->Share.OfPixel * std::sqrt(h), this->LensShare * 0.5 * confusion);
    const double variance = 0.25 * confusion * confusion;
    return { this->Settings.Error * blur * perPixel, variance / (variance + UncountedFrom * h) };
  }

  /// Whether nothing below the node can reach the picture, including blur.
  bool IsOutside(const ClusterBounds::Node& node, const Ball& ball) const
  {
    const View& v = this->Camera;
    if (ball.Far() < v.Near || ball.Near() > v.Far)
    {
      return true;
    }
    if (!v.Parallel && !(ball.Near() > 0.0))
    {
      return false;
    }
    // How far a splat reaches beyond its centre, as a length at the depth of the ball: the standard
    // deviation of W is at most the sum of those of kernel, pixel and lens. Nodes are at most as
    // large as the ball, which contains their centres. A pixel counts as large as its longer side.
    const double spread = this->Scale * node.LeafSigma + ball.Radius;
    const double focal = std::fmin(std::abs(v.Fx), std::abs(v.Fy));
    double reach = 0.0;
    if (v.Parallel)
    {
      reach = spread + (std::sqrt(this->Prefilter) + 1.0) / focal;
    }
    else
    {
      const double stretch = Norm(ball.Center) / ball.Center[2] + ball.Radius / ball.Near();
      for (const double z : { ball.Near(), ball.Far() })
      {
        const double pixel = (std::sqrt(this->Prefilter) + 1.0) * z / focal;
        const double blur = 0.6 * this->LongestAxis * this->Optics.RelativeCircleOfConfusion(z) * z;
        reach = std::fmax(reach, spread * stretch + pixel + blur);
      }
    }
    const double margin = ball.Radius + this->SupportRadius * reach;
    return this->IsBeyond(ball.Center[0], ball.Center[2], this->AxisX, margin) ||
      this->IsBeyond(ball.Center[1], ball.Center[2], this->AxisY, margin);
  }

  /// Whether a ball is outside the picture's strip [0, size] px of an axis.
  bool IsBeyond(double x, double z, const ScreenAxis& axis, double margin) const
  {
    const double f = axis.Focal, c = axis.Center, size = axis.Size;
    const double scaled = f * x, reach = std::abs(f) * margin;
    if (this->Camera.Parallel)
    {
      return scaled + reach < -c || scaled - reach > size - c;
    }
    // Distance from the plane through the lens and the picture's border.
    const double low = -c, high = size - c;
    return scaled - low * z < -axis.LowNormal * margin ||
      scaled - high * z > axis.HighNormal * margin;
  }

  /// Whether n . (x - c) > 0 for all normals n of the node's cone, points x of the ball, and points
  /// c of the lens.
  bool FacesAway(const ClusterBounds::Node& node, const Ball& ball) const
  {
    if (!(node.Cone > 0.0f) || !this->ConesHold)
    {
      return false;
    }
    const Vector3 axis{ node.Axis[0], node.Axis[1], node.Axis[2] };
    const Vector3 a{ Dot(this->AreaToCamera[0], axis), Dot(this->AreaToCamera[1], axis),
      Dot(this->AreaToCamera[2], axis) };
    const double length = Norm(a);
    const double cosCone = node.Cone;
    const double sinCone = std::sqrt(std::fmax(0.0, 1.0 - cosCone * cosCone));
    if (!(length > 0.0))
    {
      return false;
    }
    if (this->Camera.Parallel)
    {
      return a[2] > sinCone * length;
    }
    // Of the ball as seen from the lens, times its distance.
    const double sinBall = ball.Radius + this->Optics.Radius;
    const double squared = Dot(ball.Center, ball.Center) - sinBall * sinBall;
    if (!(squared > 0.0))
    {
      return false;
    }
    const double cosBall = std::sqrt(squared);
    // Cone and ball together take less than a right angle, and the axis is within the rest of it.
    return cosCone * cosBall > sinCone * sinBall &&
      Dot(a, ball.Center) > (sinCone * cosBall + cosCone * sinBall) * length;
  }

  const ClusterBounds& Table;
  const MemoryGuard* Guard;
  bool InSpace; ///< Gaussians, not surfels
  const HierarchyLayout& Layout;
  const View& Camera;
  const Lens& Optics;
  double LensVariance, CellShare, LongestAxis, CellReach, SupportRadius, Prefilter;
  CutSettings Settings;
  Shares Share;
  double LensShare;
  Affine3 LocalToCamera;
  std::array<Vector3, 3> AreaToCamera;
  double FocalLength;
  ScreenAxis AxisX, AxisY;
  double Scale = 1.0;
  bool ConesHold = true;
};

/// Enough subtrees to keep all threads busy, in the order of the leaves.
void MakeSubtrees(const ClusterBounds& table, std::vector<Subtree>& subtrees)
{
  constexpr int levelsBelowRoot = 7;
  subtrees.clear();
  for (int tree = 0; tree < HierarchyLayout::NumberOfTrees; ++tree)
  {
    const int root = table.Layout().RootLevel(tree);
    if (root < 0)
    {
      continue;
    }
    const int level = std::max(table.LowestLevel(tree), root - levelsBelowRoot);
    for (std::size_t j = 0; j < table.Layout().Count(level, tree); ++j)
    {
      subtrees.push_back({ tree, level, j, 0.0, HierarchyLayout::MaximumNumberOfLevels });
    }
  }
}
}

CutStatistics SelectCut(const SurfelCloud& cloud, const CutCamera& camera,
  const CutSettings& settings, const Executor& executor, CutWork& work, std::vector<CutRange>& runs)
{
  const CutSelector selector(cloud, camera, settings);
  MakeSubtrees(*cloud.Clusters, work.Subtrees);
  work.Parts.resize(std::max(work.Parts.size(), work.Subtrees.size()));
  executor.For(work.Subtrees.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
    {
      selector.Walk(work.Subtrees[i], work.Parts[i]);
    }
  });
  CutStatistics statistics;
  runs.clear();
  for (std::size_t i = 0; i < work.Subtrees.size(); ++i)
  {
    const CutWork::Part& part = work.Parts[i];
    runs.insert(runs.end(), part.Runs.begin(), part.Runs.end());
    statistics.Add(part.Statistics);
  }
  return statistics;
}
}
