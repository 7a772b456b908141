// SPDX-License-Identifier: BSD-3-Clause
/**
 * From a surfel to a splat: cull, project, blur by the lens, shade.
 */
#pragma once

#include "Core/Hierarchy/HierarchyCut.h"
#include "Core/Lens/Lens.h"
#include "Core/Lens/LensSectors.h"
#include "Core/Lens/ResamplingKernel.h"
#include "Core/Lens/SubApertures.h"
#include "Core/Lens/View.h"
#include "Core/Splats/Splat.h"
#include "Core/Surfels/SurfelCloud.h"

#include <array>
#include <vector>

namespace SurfelSplatting
{
struct SplatSettings
{
  KernelType Kernel = KernelType::PearsonII;
  double Cutoff = 2.5;    ///< c on the Gaussian's exponent, (0, 20]
  double Prefilter = 1.0; ///< h, variance of the pixel filter in px^2, > 0
};

/// What splats show as their colour; all but their own is unlit.
enum class Paint
{
  Own,
  LevelColors,  ///< a colour for each level of the hierarchy
  LevelNumbers, ///< red: level / LargestPaintedLevel, leaves 0
  Normals       ///< (n + 1) / 2, n being the unit normal on the side that is seen, in the world
};
constexpr double LargestPaintedLevel = 64.0;

/// Everything that is the same for all surfels of a frame.
struct SplatContext
{
  View Camera;
  Lens Optics;
  ApertureSampling Sampling;                  ///< of the lens, by the splatter
  float LeastConflict = DefaultLeastConflict; ///< of sectors (LensSectors.h)
  bool Sectors = false;      ///< visibility by sectors of the lens (LensSectors.h); Pearson II only
  std::vector<Light> Lights; ///< camera space
  SplatSettings Settings;
  CutSettings Cut;
  bool SkipHidden = true;  ///< what lies behind opaque layers, in tiles that are all opaque
  bool CoarseGrids = true; ///< wide splats on grids of larger cells
  /// For comparison: a plain z-buffer instead of layers. Of what each pixel sees, the nearest
  /// surface alone, whatever its opacity (and too little of it where surfels are smaller than a
  /// pixel: a bound on time rather than a picture); coarse grids, sectors and skipping of the
  /// hidden are off.
  bool DepthBuffered = false;
  bool ScalarSetup = false; ///< splats one by one, by MakeSplat, for comparison
  Paint Colors = Paint::Own;
};

enum class SplatStatus
{
  Visible,
  Culled,
  Invalid
};

/// A cloud in the frame's camera space.
struct PlacedCloud
{
  const SurfelCloud& Cloud;
  Affine3 LocalToCamera;
  std::array<Vector3, 3> AreaToCamera;

  PlacedCloud(const View& view, const SurfelCloud& cloud)
    : Cloud(cloud)
    , LocalToCamera(Affine3::Compose(view.WorldToCamera, cloud.LocalToWorld))
    , AreaToCamera(LocalToCamera.AreaMatrix())
  {
  }
};

/// What MakeSplat fills in.
struct SplatRecord
{
  Splat S; ///< its Gradient is NoGradient, or 0 where Gradient is set
  PixelBox Box;
  SplatGradient Gradient;
  LensSlope Slope; ///< set where there are sectors
  bool Blurred;    ///< by the lens
  int GridLevel;   ///< of the coarse grid that it is drawn on (CoarseGrid.h); 0: the picture
};

/// Projects one surfel, or one node of a hierarchy (of level > 0). The scalar reference of the
/// set-up.
SplatStatus MakeSplat(const SplatContext& context, const TruncatedGaussian& gaussian,
  const PlacedCloud& cloud, std::size_t surfel, int level, SplatRecord& record);
}
