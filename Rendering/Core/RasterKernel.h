// SPDX-License-Identifier: BSD-3-Clause
/**
 * The raster's inner loops, one translation unit per instruction set (RasterKernel*.cxx, all from
 * RasterKernelImplementation.h), chosen when the library is loaded. These files use no inline
 * function of the standard library: one compiled for AVX could end up in code that runs everywhere.
 */
#pragma once

#include "Lanes.h"
#include "LensSectors.h"
#include "Splat.h"

#include <cstdint>

namespace SurfelSplatting
{
constexpr int TileSize = 32; ///< px

/// A pixel is opaque where less than this shines through its finished layers.
constexpr float LeastTransmittance = 1.0f / 512.0f;

/// Kernels of one surface add up to less than this.
constexpr float MostRipple = 1.25f;

/// Pixels of a tile in blocks of one row by eight, what the vector units take at a time.
constexpr int BlocksPerRow = TileSize / LaneCount;
constexpr int BlocksPerTile = BlocksPerRow * TileSize;

/// Open layers and finished pixels of eight neighbours; the fields of Layer and of the frame.
struct alignas(64) PixelBlock
{
  Lanes Near, Far;
  Lanes Weight, Opacity;
  Lanes Red, Green, Blue, Depth;

  Lanes Transmittance;
  Lanes OutRed, OutGreen, OutBlue, OutDepth;
  Lanes Limit;   ///< layers behind this depth are hidden by another prop
  Lanes Covered; ///< share of the lens that finished layers cover, whatever their opacity
  /// Largest share of the light that depends on which parts of the lens things cover: min(c, 1 - c)
  /// w for a layer of coverage w behind others that cover c; T (1 - MostRipple / w) for one whose
  /// weights w add up to more than rippling kernels' do, T being what shines through to it.
  Lanes Conflict;
};

/// Called with the lanes of a block whose layers are about to be closed; null: nobody listens.
struct CloseCallback
{
  void (*Function)(void* user, const PixelBlock& block, int index, const LaneMask& lanes);
  void* User;
};

/// What is the same for all splats of a frame.
struct RasterSettings
{
  float Support; ///< squared radius q of the kernels' support
  /// Of the splats so far: those on coarse grids, then those that a tile has added. Colour
  /// gradients can overshoot where a surface ends: a resolved layer is clamped to what splats can
  /// give.
  float LargestColor;
  LensSector Sector = {}; ///< that is drawn
  float LeastConflict = DefaultLeastConflict;
};

struct RasterKernel
{
  /// Adds a splat, centred at x, y px in the tile, to rows [rowBegin, rowEnd) of it; returns the
  /// number of fragments.
  /// @param slope of a splat in a sector of the lens, or null
  std::uint64_t (*AddSplat)(PixelBlock* blocks, const Splat& splat, const SplatGradient* gradient,
    const LensSlope* slope, int rowBegin, int rowEnd, float x, float y,
    const RasterSettings& settings, const CloseCallback& callback);
  /// Whether nothing that begins at a depth or behind it can change a pixel of the tile by more
  /// than LeastTransmittance.
  bool (*IsOpaque)(const PixelBlock* blocks, float near);
  /// Composites all open layers of a tile.
  void (*CloseAll)(PixelBlock* blocks, const RasterSettings& settings);
  const char* Name;
};

extern const RasterKernel RasterKernelBaseline;
#ifdef SURFELSPLATTING_X86_KERNELS
extern const RasterKernel RasterKernelAVX2;
extern const RasterKernel RasterKernelAVX512;
#endif

/// The best that this processor runs.
inline const RasterKernel& SelectRasterKernel()
{
#ifdef SURFELSPLATTING_X86_KERNELS
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
    __builtin_cpu_supports("avx512dq"))
  {
    return RasterKernelAVX512;
  }
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
  {
    return RasterKernelAVX2;
  }
#endif
  return RasterKernelBaseline;
}
}
