// SPDX-License-Identifier: BSD-3-Clause
/**
 * Everything that is the same for all surfels of a frame.
 */
#pragma once

#include "Core/Hierarchy/HierarchyCut.h"
#include "Core/Lens/Lens.h"
#include "Core/Lens/LensSectors.h"
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
  double Cutoff = 2.5;    ///< c on the Gaussian's exponent, (0, 20]
  double Prefilter = 1.0; ///< h, variance of the pixel filter in px^2, > 0
};

struct SplatContext
{
  View Camera;
  Lens Optics;
  ApertureSampling Sampling;              ///< of the lens, by the splatter
  float MinConflict = DefaultMinConflict; ///< of sectors (LensSectors.h)
  bool Sectors = false;      ///< visibility by sectors of the lens (LensSectors.h); Pearson II only
  std::vector<Light> Lights; ///< camera space
  SplatSettings Settings;
  CutSettings Cut;
  bool SkipHidden = true;  ///< what lies behind opaque layers, in tiles that are all opaque
  bool CoarseGrids = true; ///< wide splats on grids of larger cells
  /// For comparison: a plain z-buffer instead of layers. Each pixel shows its nearest surface only,
  /// regardless of opacity, and too little of it where surfels are smaller than a pixel: this is a
  /// bound on time rather than a picture. Coarse grids, sectors and skipping of the hidden are off.
  bool DepthBuffered = false;
  bool ScalarSetup = false; ///< splats one by one (SetupTargetScalar), for comparison
  Paint Colors = Paint::Own;
};
}
