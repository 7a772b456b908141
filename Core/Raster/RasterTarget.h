// SPDX-License-Identifier: BSD-3-Clause
/**
 * The raster's inner loops, one translation unit per instruction set (RasterTarget*.cxx, all from
 * RasterImplementation.h). SelectRasterTarget chooses one when the library is loaded. These files
 * use no inline function of the standard library: the linker could use a copy compiled for AVX in
 * code that runs everywhere.
 */
#pragma once

#include "Core/Base/Tiles.h"
#include "Core/Lens/LensSectors.h"
#include "Core/Splats/Splat.h"
#include "Core/Splats/Tent.h"

#include <cstdint>

namespace SurfelSplatting
{
/// A pixel is opaque when less than this shines through its finished layers.
constexpr float MinTransmittance = 1.0f / 512.0f;

/// The sum of the kernels of one surface is less than this.
constexpr float MaxRipple = 1.25f;

/// A tile's pixels are stored in blocks of 4 x 4, row by row: sixteen are processed at a time, and
/// a splat in focus covers few blocks.
constexpr int BlockSize = 4; ///< px
constexpr int PixelsPerBlock = BlockSize * BlockSize;
constexpr int BlocksPerRow = TileSize / BlockSize;
constexpr int BlocksPerTile = BlocksPerRow * BlocksPerRow;

/// The open layers of a block's pixels, with the fields of Layer. Most splats touch nothing else.
struct alignas(64) OpenLayers
{
  float Far[PixelsPerBlock];
  float Weight[PixelsPerBlock], Opacity[PixelsPerBlock];
  float Red[PixelsPerBlock], Green[PixelsPerBlock], Blue[PixelsPerBlock], Depth[PixelsPerBlock];
  float Seen[PixelsPerBlock];                         ///< sum w o s
  float SeenX[PixelsPerBlock], SeenY[PixelsPerBlock]; ///< sum w o s u
  float FillX[PixelsPerBlock], FillY[PixelsPerBlock]; ///< sum w u
};

/// The finished part of a block's pixels: the fields of the frame and what belongs to them.
struct alignas(64) FinishedLayers
{
  float Transmittance[PixelsPerBlock];
  float Red[PixelsPerBlock], Green[PixelsPerBlock], Blue[PixelsPerBlock], Depth[PixelsPerBlock];
  float OccluderDepth[PixelsPerBlock]; ///< layers behind this are hidden by another prop
  float Near[PixelsPerBlock];          ///< of the open layer; only with a CloseCallback
  float Fragments[PixelsPerBlock];     ///< so far; only with a CloseCallback
  float ThroughX[PixelsPerBlock], ThroughY[PixelsPerBlock]; ///< mean of u T(u)
  float SeenMean[PixelsPerBlock], SeenX[PixelsPerBlock], SeenY[PixelsPerBlock];
};

struct alignas(64) OpenMoments
{
  float RedX[PixelsPerBlock], RedY[PixelsPerBlock], GreenX[PixelsPerBlock], GreenY[PixelsPerBlock];
  float BlueX[PixelsPerBlock], BlueY[PixelsPerBlock];
  float XX[PixelsPerBlock], XY[PixelsPerBlock], YY[PixelsPerBlock];
  float HalfRange[PixelsPerBlock], Spread[PixelsPerBlock];
};

struct PixelTile
{
  OpenLayers Open[BlocksPerTile];
  OpenMoments Moments[BlocksPerTile];
  FinishedLayers Finished[BlocksPerTile];
  /// Bit i: no pixel of block i lets more than MinTransmittance through. With
  /// RasterSettings::SkipHidden nothing more is added to the block.
  std::uint64_t Opaque;
};
static_assert(BlocksPerTile == 64, "a bit of PixelTile::Opaque each");

/// Called with the lanes (bit l: pixel l) of a block whose layers are about to be closed. A null
/// function is not called.
struct CloseCallback
{
  void (*Function)(void* user, const PixelTile& tile, int block, unsigned int lanes, const float* keep);
  void* User;
};

/// The buffer that the raster adds splats to.
enum class RasterPass
{
  Layers,  ///< the A-buffer
  Depths,  ///< the z-buffer: the far end of the nearest surface
  Nearest, ///< one layer of the splats that begin in front of that
};

/// Settings that are the same for all splats of a frame.
struct RasterSettings
{
  float Support; ///< squared radius q of the kernels' support
  /// Largest colour of the splats on coarse grids and of those that the tile has added so far.
  /// Resolved layers are clamped to it, since colour gradients can overshoot where a surface ends.
  float LargestColor;
  float LensRadius = 0.0f, BlurPerDepth = 0.0f;
  RasterPass Pass = RasterPass::Layers;
  bool SkipHidden = false; ///< add nothing to opaque blocks
  bool Collect = false;    ///< layers are not composited
};

/// A splat and its optional data.
struct SplatData
{
  const Splat& Body;
  const SplatGradient* Gradient; ///< or null: one colour
  const LensSlope* Slope;        ///< to draw it in RasterSettings::Sector, or null
};

/// Where a splat or a tent lies in a tile.
struct TilePlace
{
  PixelBox Span; ///< the tile's pixels in its box
  float X, Y;    ///< its centre, px from the tile's lower left corner
};

extern float SP[16];
struct RasterTarget
{
  /// Adds a splat to the blocks that its span touches; returns the number of fragments.
  std::uint64_t (*AddSplat)(PixelTile& tile, const SplatData& splat, const TilePlace& place,
    const RasterSettings& settings, const CloseCallback& callback);
  /// The same for a tent.
  std::uint64_t (*AddTent)(PixelTile& tile, const Tent& tent, const TilePlace& place,
    const RasterSettings& settings, const CloseCallback& callback);
  /// Lanes of a block that nothing which begins behind a depth can change by more than
  /// MinTransmittance.
  unsigned int (*HiddenFrom)(
    const PixelTile& tile, int block, float near, const RasterSettings& settings);
  /// Composites all open layers of a tile.
  void (*CloseAll)(PixelTile& tile, const RasterSettings& settings);
  const char* Name;
};

extern const RasterTarget RasterTargetBaseline;
#ifdef SURFELSPLATTING_X86_TARGETS
extern const RasterTarget RasterTargetAVX2;
extern const RasterTarget RasterTargetAVX512;
#endif

/// The best one that this processor can run.
const RasterTarget& SelectRasterTarget();
}
