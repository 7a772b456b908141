// SPDX-License-Identifier: BSD-3-Clause
/**
 * How coarse the nodes of a cut may be, by the rules that HierarchyCut.h names. Internal to
 * SelectCut.
 */
#pragma once

#include "Core/Hierarchy/CutView.h"

namespace SurfelSplatting
{
class CutDetail
{
public:
  /// All must outlive this.
  CutDetail(const SurfelCloud& cloud, const CutCamera& camera, const CutSettings& settings,
    const CutView& view);

  /// The level at which a subtree is drawn, plus the share to which its nodes merge with their
  /// siblings: the coarsest that is fine enough for all of it. Below 0: none of those whose extents
  /// are known.
  double LevelOf(const CutWork::Subtree& at, const NodeBall& ball) const;

  /// Whether a subtree is drawn at this level, which is not so far below its root that parts of it
  /// would be drawn too finely.
  bool IsNear(const CutWork::Subtree& at, double level) const;

  /// The first of an entry's children. Its own nodes and those of its children are of the same
  /// level when it becomes fine enough, so that nothing jumps.
  CutWork::Subtree Below(const CutWork::Subtree& at, double level) const;

  /// Of a run whose nodes lie below an entry.
  RunDeviations DeviationsOf(const CutWork::Subtree& at, const CutRange& run) const;

private:
  /// NodeExtent::Sigma of nodes at an error of 1, as shares of the deviations of lens blur and
  /// pixel.
  struct Shares
  {
    double OfLens, OfPixel;
  };

  /// How large a node may be.
  struct AllowedExtent
  {
    double Sigma;    ///< standard deviation, or of the paper's rule the radius, local units
    double OfLeaves; ///< share of the leaves' own variance that is not counted, [0, 1]
  };

  AllowedExtent Allow(const NodeBall& ball) const;
  const NodeExtent& ExtentAt(const CutWork::Subtree& at, int level) const;
  double NeededSize(const CutWork::Subtree& at, int level, double ofLeaves) const;
  double SteppedLevel(const CutWork::Subtree& at, const AllowedExtent& allowed) const;
  double ContinuousLevel(const CutWork::Subtree& at, const AllowedExtent& allowed) const;

  const ClusterBounds& Table;
  const CutView& Seen;
  CutSettings Settings;
  bool InSpace; ///< Gaussians, not surfels
  double Prefilter;
  Shares Share;
};
}
