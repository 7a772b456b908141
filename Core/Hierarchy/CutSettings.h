// SPDX-License-Identifier: BSD-3-Clause
/**
 * What a cut through a hierarchy (HierarchyCut.h) depends on, and its memory.
 */
#pragma once

#include "Core/Hierarchy/CutRange.h"
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
}
