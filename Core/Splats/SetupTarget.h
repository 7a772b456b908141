// SPDX-License-Identifier: BSD-3-Clause
/**
 * The set-up of splats: cull surfels, project them, blur them by the lens, shade them. Its stages
 * are templates (SetupImplementation.h), compiled once for each instruction set, for as many
 * surfels at a time as a register has doubles, and once for a single one.
 *
 * Nothing compiled for one instruction set may end up in code that runs everywhere. The translation
 * units of the targets therefore call functions that are always inlined, and no others.
 */
#pragma once

#include "Core/Lens/LensSectors.h"
#include "Core/Lens/ResamplingKernel.h"
#include "Core/Lens/View.h"
#include "Core/Splats/Splat.h"
#include "Core/Surfels/Shading.h"
#include "Core/Surfels/SurfelCloud.h"

#include <cstddef>
#include <cstdint>

namespace SurfelSplatting
{
/// What splats show as their colour; all but their own is unlit.
enum class Paint
{
  Own,
  LevelColors,  ///< a colour for each level of the hierarchy
  LevelNumbers, ///< red: level / LargestPaintedLevel, leaves 0
  Normals       ///< (n + 1) / 2, n being the unit normal on the side that is seen, in the world
};
constexpr double LargestPaintedLevel = 64.0;

/// What is the same for all surfels of a cloud in a frame.
struct SetupJob
{
  SurfelCloud Cloud;
  double Linear[3][3], Translation[3]; ///< local to camera
  double AreaToCamera[3][3];
  double WorldToCamera[3][3]; ///< without translation

  View Camera;
  double LensRadius = 0.0, InverseFocalDistance = 0.0; ///< Lens.h
  bool Offsets = false; ///< blur is centred where the light passes (Lens.h, MeanAperturePoint)

  KernelType Kernel = KernelType::PearsonII;
  TruncatedGaussian Gaussian = TruncatedGaussian(2.5);
  double Prefilter = 1.0;     ///< h, px^2
  double DefocusFactor = 0.0; ///< variance that the lens adds, in units of C^2
  bool PaperDetail = false;   ///< nodes as in the paper: no gradients
  bool CoarseGrids = false;
  bool DepthBuffered = false;

  Paint Colors = Paint::Own;
  double Color[3] = { 1, 1, 1 }; ///< of surfels that have none of their own
  ShadingMaterial Surface;
  const ShadingLight* Lights = nullptr;
  std::size_t NumberOfLights = 0;
};

/// Where splats go; the arrays have room for all surfels of a call. Gradients are those of the
/// splats that have one.
struct SplatOutput
{
  Splat* Splats;
  PixelBox* Boxes;
  float* Nears;
  LensSlope* Slopes;         ///< or null
  unsigned char* GridLevels; ///< or null: all on the picture
  SplatGradient* Gradients;  ///< of the whole list
  std::size_t FirstGradient; ///< where this output's begin in it
  std::size_t Count = 0, NumberOfGradients = 0, Invalid = 0, Blurred = 0;
  unsigned int Levels = 0;         ///< bit l: some are on the grid of level l
  float LargestCoarseColor = 0.0f; ///< of splats on coarse grids, all channels
};

struct SetupTarget
{
  /// Appends the visible splats of surfels [begin, begin + count), all of one level.
  void (*MakeSplats)(
    const SetupJob& job, std::size_t begin, std::size_t count, int level, SplatOutput& output);
  const char* Name;
};

/// The best that this processor runs.
const SetupTarget& SelectSetupTarget();

extern const SetupTarget SetupTargetScalar; ///< one surfel at a time, for comparison
extern const SetupTarget SetupTargetBaseline;
#ifdef SURFELSPLATTING_X86_TARGETS
extern const SetupTarget SetupTargetAVX2;
extern const SetupTarget SetupTargetAVX512;
#endif
}
