// SPDX-License-Identifier: BSD-3-Clause
/**
 * Which nodes of a hierarchy are drawn: a cut through the tree, coarse where blur or the pixel hide
 * what is lost, without what the view cannot see.
 *
 * Two rules, with one error e for both, 1 by default:
 *
 * - Moments: sigma^2 <= e^2 (0.95^2 h + 0.42^2 V_I), the variance of the node on the screen against
 *   those of pixel filter and lens. The node is drawn with its full covariance and a colour
 *   gradient.
 *
 * - Paper: r <= e max(C, sqrt(h)), the projected radius of the node's bounding sphere against the
 *   circle of confusion or the pixel (Krivanek, Zara, Bouatouch 2003, section 4, "LOD selection").
 *   Its nodes have mean colours, and W = M V_r M' + h + circumellipse(M V_q M', V_I).
 *
 * Nodes whose area vectors cancel (thin or folded things: the sum no longer says what they hide)
 * have to be smaller: by clamp((|A| / area - 0.5) / 0.4, 0.1, 1).
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Base/PixelBox.h"
#include "Core/Hierarchy/ClusterBounds.h"
#include "Core/Lens/Lens.h"
#include "Core/Lens/View.h"

#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
enum class CutRule
{
  Leaves, ///< the finest level everywhere
  Paper,
  Moments
};

struct CutSettings
{
  CutRule Rule = CutRule::Moments;
  double Error = 1.0;        ///< e, >= 0
  bool SkipOutside = true;   ///< what cannot blur into the picture
  bool SkipBackFaces = true; ///< one-sided surfels seen from behind
};

/// A run of consecutive nodes that are drawn; all of one level, and below one entry of the
/// ClusterBounds.
struct CutRange
{
  std::size_t Begin;
  std::uint32_t Count;
  std::uint32_t Level;
  bool Wide = false;          ///< all of its splats are wide enough for a coarse grid
  float Near = -1e30f;        ///< none of its splats begins before
  float Far = 1e30f;          ///< none of them ends behind
  PixelBox Box{ 0, 0, 0, 0 }; ///< holds all of its splats
};

struct CutStatistics
{
  std::uint64_t VisitedNodes = 0;  ///< entries of the ClusterBounds that were looked at
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

/// What the splats of a cut are seen through.
struct CutCamera
{
  const View& Projection;
  const Lens& Optics;
  double SupportRadius; ///< of the largest kernel, in standard deviations of W
  double Prefilter;     ///< h, px^2
};

/// Memory of SelectCut, kept from frame to frame.
struct CutWork
{
  /// A subtree that is walked on its own.
  struct Subtree
  {
    int Tree, Level;
    std::size_t Index;
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
CutStatistics SelectCut(const SurfelCloud& cloud, const CutCamera& camera,
  const CutSettings& settings, const Executor& executor, CutWork& work,
  std::vector<CutRange>& runs);
}
