// SPDX-License-Identifier: BSD-3-Clause
/**
 * Selects which nodes of a hierarchy are drawn: a cut through the tree that is coarse where blur or
 * the pixel hides the loss, and leaves out what the view cannot see. SplatList.h and LazySplats.h
 * make splats of it.
 *
 * There are two rules, both with an error e, 1 by default:
 *
 * - Moments: sigma^2 <= e^2 (0.80^2 h + 0.34^2 V_I), the nodes' variance on the screen
 *   (NodeExtent::Sigma) against those of pixel filter and lens; 0.90 and 0.37 of Gaussians in
 *   space. Nodes are drawn with their full covariance and a colour gradient. Below the size at
 *   which a node is drawn, its two children merge (CutRange.h). The coarsest level that is fine
 *   enough counts, whatever finer ones are.
 *
 * - Paper: r <= e max(C, sqrt(h)), the projected radius of the node's bounding sphere against the
 *   circle of confusion or the pixel (Krivanek, Zara, Bouatouch 2003, section 4, "LOD selection").
 *   Its nodes have mean colours, and W = M V_r M' + h + circumellipse(M V_q M', V_I).
 *
 * The leaves of captures overlap and are no finer than their node: where the lens blurs, sigma^2 is
 * without the leaves' own variance (NodeExtent::Coherence).
 *
 * Nodes whose area vectors cancel (thin or folded surfaces, where the sum no longer tells how much
 * they hide) must be smaller by clamp((|A| / area - 0.6) / 0.35, 0.1, 1).
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Hierarchy/CutRange.h"
#include "Core/Lens/Lens.h"
#include "Core/Lens/View.h"

#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
struct SurfelCloud;

enum class CutRule
{
  Leaves, ///< the finest level everywhere
  Paper,
  Moments
};

struct CutSettings
{
  CutRule Rule = CutRule::Moments;
  double Error = 1.0;    ///< e, >= 0
  std::size_t Cells = 1; ///< of the lens, whose pictures are averaged
  double BlurGain = 1.0; ///< factor on sqrt(V_I) of a cell, since the mean of cells is blurred more
  bool SkipOutside = true;   ///< skip surfels that cannot blur into the picture
  bool SkipBackFaces = true; ///< skip one-sided surfels seen from behind
};

struct CutStatistics
{
  std::uint64_t VisitedNodes = 0;  ///< entries of the ClusterBounds that were examined
  std::uint64_t OutsideLeaves = 0; ///< skipped: cannot reach the picture
  std::uint64_t BackLeaves = 0;    ///< skipped: seen from behind
  std::uint64_t Nodes = 0;         ///< chosen

  void Add(const CutStatistics& other)
  {
    this->VisitedNodes += other.VisitedNodes;
    this->OutsideLeaves += other.OutsideLeaves;
    this->BackLeaves += other.BackLeaves;
    this->Nodes += other.Nodes;
  }
};

/// Camera, lens and filters through which the splats of a cut are seen.
struct CutCamera
{
  const View& Projection;
  const Lens& Optics;
  double SupportRadius;       ///< of the largest kernel, in standard deviations of W
  double Prefilter;           ///< h, px^2
  double LensVariance = 0.25; ///< that the lens adds, in units of C^2 (Lens.h, DefocusVariance)
  /// Smallest radius and largest semi-axis of the lens's cells (CutSettings::Cells), over the
  /// lens's radius.
  double CellShare = 1.0, CellReach = 1.0;
};

/// Memory of SelectCut, kept from frame to frame.
struct CutWork
{
  /// A subtree that is walked on its own.
  struct Subtree
  {
    int Tree, Level;
    std::size_t Index;
    double Least, Limit; ///< finest and coarsest level; fraction: the share of merging
  };

  /// The cut of a subtree.
  struct Part
  {
    std::vector<Subtree> Stack;
    std::vector<CutRange> Runs;
    CutStatistics Statistics;
  };

  std::vector<Subtree> Subtrees;
  std::vector<Part> Parts;
};

/// Writes the cut of a cloud with a ClusterBounds into runs, the same at any number of threads.
/// All cells of the lens share one cut: what any point of the lens can see, with the boxes of a
/// cell at the lens's centre, which may be beyond the picture.
/// @throw DamagedMemory if the cloud has a guard that finds damage
CutStatistics SelectCut(const SurfelCloud& cloud, const CutCamera& camera,
  const CutSettings& settings, const Executor& executor, CutWork& work,
  std::vector<CutRange>& runs);

/// Writes those runs of a cut for all cells that one of them can see, with its boxes.
/// @param view from the lens's centre @param center of the cell, world units in camera space
void SeeFromCell(const std::vector<CutRange>& all, const View& view, const Lens& lens,
  const Vector3& center, std::vector<CutRange>& runs);
}
