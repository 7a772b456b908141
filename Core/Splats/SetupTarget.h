// SPDX-License-Identifier: BSD-3-Clause
/**
 * Set-up of splats: culls surfels, projects them, blurs them by the lens, and shades them. Its
 * stages are templates (SetupImplementation.h). For each instruction set they are compiled for as
 * many surfels at a time as a register holds doubles, and once more for one surfel at a time.
 *
 * Code compiled for one instruction set must not end up in functions that run on every processor.
 * The translation units of the targets therefore call only functions that are always inlined.
 */
#pragma once

#include "Core/Base/PixelBox.h"
#include "Core/Hierarchy/CutRange.h"
#include "Core/Lens/Lens.h"
#include "Core/Lens/LensVisibility.h"
#include "Core/Lens/ResamplingKernel.h"
#include "Core/Lens/View.h"
#include "Core/Splats/Splat.h"
#include "Core/Surfels/Shading.h"
#include "Core/Surfels/SurfelCloud.h"

#include <cstddef>
#include <cstdint>

namespace SurfelSplatting
{
/// What the colour of a splat shows. Only Own is lit.
enum class Paint
{
  Own,
  LevelColors,  ///< a colour for each level of the hierarchy
  LevelNumbers, ///< red: level / MaxPaintedLevel, leaves 0
  Normals       ///< (n + 1) / 2, where n is the unit normal of the visible side in world space
};
constexpr double MaxPaintedLevel = 64.0;

/// Inputs that are the same for all surfels of a cloud in a frame.
struct SetupJob
{
  SurfelCloud Cloud;
  double Linear[3][3], Translation[3]; ///< local to camera
  double AreaToCamera[3][3];
  double WorldToCamera[3][3]; ///< without translation
  double CameraToLocal[3][3]; ///< inverse of Linear, 0 if there is none
  double Stretch;             ///< |det Linear|, by which volumes grow

  View Camera;
  double LensRadius = 0.0, InverseFocalDistance = 0.0; ///< Lens.h
  LensShape Shape, ShapeRoot;                  ///< of the lens or cell on the screen, and its root
  double LeastShape = 1.0, LargestShape = 1.0; ///< its eigenvalues
  bool WeighsLens = false; ///< weigh each point of the lens with the area it sees (Lens.h)

  KernelType Kernel = KernelType::PearsonII;
  TruncatedGaussian Gaussian = TruncatedGaussian(2.5);
  double Prefilter = 1.0;     ///< h, px^2
  bool KeepsMass = false;     ///< of captures, when h widens them
  double DefocusFactor = 0.0; ///< variance that the lens adds, in units of C^2
  bool PaperDetail = false;   ///< draw nodes as in the paper, without gradients
  bool CoarseGrids = false;
  bool GaussianRuns = false;
  bool DepthBuffered = false;

  Paint Colors = Paint::Own;
  double Color[3] = { 1, 1, 1 }; ///< of surfels without colours of their own
  Lighting Shading;              ///< not lit unless Colors is Paint::Own
};

/// Destination of the splats. The arrays have room for all surfels of a call. Gradients holds only
/// those of splats that have one.
struct SplatOutput
{
  Splat* Splats;
  PixelBox* Boxes;
  float* Orders;
  LensFootprint* Footprints; ///< or null
  unsigned char* GridLevels; ///< or null: all splats are on the picture itself
  SplatGradient* Gradients;  ///< of the whole list
  std::size_t FirstGradient; ///< index of this output's first gradient in it
  std::size_t Count = 0, NumberOfGradients = 0, Invalid = 0, Blurred = 0;
  unsigned int Levels = 0;         ///< bit l: some are on the grid of level l
  float LargestCoarseColor = 0.0f; ///< of splats on coarse grids, all channels
  float LargestDelay = 0.0f;       ///< SplatList::Part
};

struct SetupTarget
{
  /// Appends the visible splats of `count` surfels or nodes of a run, without the first `skip`.
  void (*MakeSplats)(const SetupJob& job, const CutRange& run, std::size_t skip, std::size_t count,
    SplatOutput& output);
  const char* Name;
};

/// The fastest target that this processor supports.
const SetupTarget& SelectSetupTarget();

extern const SetupTarget SetupTargetScalar; ///< one surfel at a time, for comparison
extern const SetupTarget SetupTargetBaseline;
#ifdef SURFELSPLATTING_X86_TARGETS
extern const SetupTarget SetupTargetAVX2;
extern const SetupTarget SetupTargetAVX512;
#endif
}
