// SPDX-License-Identifier: BSD-3-Clause
/**
 * Settings that are the same for all surfels of a frame.
 */
#pragma once

#include "Core/Base/TileSet.h"
#include "Core/Hierarchy/HierarchyCut.h"
#include "Core/Lens/Lens.h"
#include "Core/Lens/ResamplingKernel.h"
#include "Core/Lens/SubApertures.h"
#include "Core/Lens/View.h"
#include "Core/Splats/SetupTarget.h"
#include "Core/Surfels/Shading.h"

#include <vector>

namespace SurfelSplatting
{
struct SplatSettings
{
  KernelType Kernel = KernelType::PearsonII;
  double Cutoff = 2.5;          ///< c on the Gaussian's exponent, (0, 20]
  double Prefilter = 1.0;       ///< h, variance of the pixel filter in px^2, > 0
  bool KeepCaptureMass = false; ///< captures fade instead of growing where h widens them
};

struct SplatContext
{
  View Camera;
  Lens Optics;
  ApertureSampling Sampling; ///< how the splatter divides the lens
  std::vector<Light> Lights; ///< camera space
  TileSet Drawn;             ///< cells may leave out splats that touch no other tiles
  SplatSettings Settings;
  CutSettings Cut;
  /// Skip surfels behind opaque layers, and end layers early (RasterSettings::ShortCuts).
  bool SkipHidden = true;
  bool CoarseGrids = true;  ///< draw wide splats on grids of larger cells
  bool GaussianRuns = true; ///< draw blurred Gaussians in space on larger cells (GaussianRun.h)
  /// For comparison: a plain z-buffer instead of layers. Each pixel shows only its nearest surface,
  /// regardless of opacity, and too little of it if surfels are smaller than a pixel. This measures
  /// a lower bound of the time and does not give a good picture. It turns off coarse grids and the
  /// skipping of hidden surfels.
  bool DepthBuffered = false;
  bool ScalarSetup = false; ///< set up one surfel at a time (SetupTargetScalar), for comparison
  Paint Colors = Paint::Own;

  /// Whether visibility depends on the point of the lens (LensVisibility.h). The paper's kernel
  /// treats the visibility of layers as independent.
  bool HasLens() const
  {
    return this->Optics.Radius > 0.0 && !this->Camera.Parallel && !this->DepthBuffered &&
      this->Settings.Kernel != KernelType::Gaussian;
  }
};
}
