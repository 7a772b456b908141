// SPDX-License-Identifier: BSD-3-Clause
/**
 * The set-up of splats, several surfels at a time: MakeSplat's formulas (SplatSetup.cxx, where each
 * has its source) in vectors of doubles, one translation unit per instruction set like the raster
 * (RasterTarget.h). Every lane is a surfel; what a lane gives does not depend on its neighbours.
 */
#pragma once

#include "Core/Lens/LensSectors.h"
#include "Core/Splats/Splat.h"
#include "Core/Surfels/HierarchyNode.h"

#include <cstddef>
#include <cstdint>

namespace SurfelSplatting
{
/// Light and material as Shading.h has them, without spots. Both ends of the set-up know no more
/// than plain numbers of each other: nothing compiled for AVX may end up in code that runs
/// everywhere.
struct SetupLight
{
  double Color[3], Position[3], Direction[3], Attenuation[3];
  bool Positional, LoneHeadlight;
};

/// What is the same for all surfels of a cloud in a frame.
struct SetupJob
{
  // The cloud (SurfelCloud.h).
  const float* PositionsFloat;
  const double* PositionsDouble;
  const float *Covariances, *AreaVectors, *Opacities;
  const unsigned char* TwoSided;
  const unsigned char* ColorsUChar;
  const float* ColorsFloat;
  std::size_t NumberOfSurfels;
  const HierarchyNode* Nodes;  ///< surfel NumberOfSurfels is the first of them
  const NodeColor* NodeColors; ///< or null
  double Opacity;
  double Linear[3][3], Translation[3]; ///< local to camera
  double AreaToCamera[3][3];

  // View and lens (View.h, Lens.h).
  bool Parallel;
  double Fx, Fy, Cx, Cy, Near, Far;
  int Width, Height;
  double LensRadius, InverseFocalDistance;
  bool Offsets; ///< blur is centred where the light passes (Lens.h, MeanApertureSample)

  // Kernels (ResamplingKernel.h).
  bool Gaussian; ///< the paper's
  double Prefilter, Support, Mass, Tau;
  double DefocusFactor; ///< variance that the lens adds, in units of C^2
  bool CoarseGrids;
  bool DepthBuffered;

  // Light.
  bool Lit; ///< false: surfels are as they are
  const SetupLight* Lights;
  std::size_t NumberOfLights;
  double Ambient, Diffuse, Specular, SpecularPower;
  double Color[3], AmbientColor[3], SpecularColor[3];
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

extern const SetupTarget SetupTargetBaseline;
#ifdef SURFELSPLATTING_X86_TARGETS
extern const SetupTarget SetupTargetAVX2;
extern const SetupTarget SetupTargetAVX512;
#endif
}
