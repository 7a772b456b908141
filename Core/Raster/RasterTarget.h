// SPDX-License-Identifier: BSD-3-Clause
/**
 * The raster's inner loops, one translation unit per instruction set (RasterTarget*.cxx, all from
 * RasterImplementation.h), chosen when the library is loaded. These files use no inline
 * function of the standard library: one compiled for AVX could end up in code that runs everywhere.
 */
#pragma once

#include "Core/Base/Tiles.h"
#include "Core/Lens/LensSectors.h"
#include "Core/Splats/Splat.h"
#include "Core/Splats/Tent.h"

#include <cstdint>

namespace SurfelSplatting
{
/// A pixel is opaque where less than this shines through its finished layers.
constexpr float LeastTransmittance = 1.0f / 512.0f;

/// Kernels of one surface add up to less than this.
constexpr float MostRipple = 1.25f;

/// Pixels of a tile in blocks of four by four, row by row: what the vector units take at a time,
/// and what a splat in focus covers few of.
constexpr int BlockSize = 4; ///< px
constexpr int PixelsPerBlock = BlockSize * BlockSize;
constexpr int BlocksPerRow = TileSize / BlockSize;
constexpr int BlocksPerTile = BlocksPerRow * BlocksPerRow;

/// Open layers of a block's pixels, the fields of Layer; all that most splats touch.
struct alignas(64) OpenLayers
{
  float Far[PixelsPerBlock];
  float Weight[PixelsPerBlock], Opacity[PixelsPerBlock];
  float Red[PixelsPerBlock], Green[PixelsPerBlock], Blue[PixelsPerBlock], Depth[PixelsPerBlock];
};

/// What is finished of a block's pixels, the fields of the frame, and what goes with it.
struct alignas(64) FinishedLayers
{
  float Transmittance[PixelsPerBlock];
  float Red[PixelsPerBlock], Green[PixelsPerBlock], Blue[PixelsPerBlock], Depth[PixelsPerBlock];
  float OccluderDepth[PixelsPerBlock]; ///< layers behind are hidden by another prop
  float Near[PixelsPerBlock]; ///< of the open layer; kept where somebody listens to its closing
  float Fragments[PixelsPerBlock]; ///< so far; kept where somebody listens
  /// For sectors: share of the lens that finished layers cover, whatever their opacity.
  float Covered[PixelsPerBlock];
  /// For sectors: largest share of the light that depends on which parts of the lens things cover:
  /// min(c, 1 - c) w for a layer of coverage w behind others that cover c; T (1 - MostRipple / w)
  /// for one whose weights w add up to more than rippling kernels' do, T being what shines through
  /// to it.
  float Conflict[PixelsPerBlock];
};

struct PixelTile
{
  OpenLayers Open[BlocksPerTile];
  FinishedLayers Finished[BlocksPerTile];
  /// Bit i: no pixel of block i lets more than LeastTransmittance through. Where what is hidden is
  /// skipped, nothing is added to it any more.
  std::uint64_t Opaque;
};
static_assert(BlocksPerTile == 64, "a bit of PixelTile::Opaque each");

/// Called with the lanes (bit l: pixel l) of a block whose layers are about to be closed; null:
/// nobody listens.
struct CloseCallback
{
  void (*Function)(void* user, const PixelTile& tile, int block, unsigned int lanes);
  void* User;
};

/// What splats are added to.
enum class RasterPass
{
  Layers,  ///< the A-buffer
  Depths,  ///< the z-buffer: where the nearest surface ends
  Nearest, ///< what begins before that, one layer
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
  RasterPass Pass = RasterPass::Layers;
  bool SkipHidden = false;    ///< add nothing to opaque blocks
  bool NoteConflicts = false; ///< for sectors
};

/// A splat and what belongs to it.
struct SplatData
{
  const Splat& Shape;
  const SplatGradient* Gradient; ///< or null: one colour
  const LensSlope* Slope;        ///< to draw it in RasterSettings::Sector, or null
};

/// Where a splat or a tent lies in a tile.
struct TilePlace
{
  PixelBox Span; ///< the tile's pixels in its box
  float X, Y;    ///< its centre, px from the tile's lower left corner
};

struct RasterTarget
{
  /// Adds a splat to the blocks that its span touches; returns the number of fragments.
  std::uint64_t (*AddSplat)(PixelTile& tile, const SplatData& splat, const TilePlace& place,
    const RasterSettings& settings, const CloseCallback& callback);
  /// The same for a tent.
  std::uint64_t (*AddTent)(PixelTile& tile, const Tent& tent, const TilePlace& place,
    const RasterSettings& settings, const CloseCallback& callback);
  /// Composites the open layers of a block that end before a depth, where nothing more begins
  /// before it.
  void (*CloseBefore)(PixelTile& tile, int block, float near, const RasterSettings& settings);
  /// Composites all open layers of a tile.
  void (*CloseAll)(PixelTile& tile, const RasterSettings& settings);
  const char* Name;
};

extern const RasterTarget RasterTargetBaseline;
#ifdef SURFELSPLATTING_X86_TARGETS
extern const RasterTarget RasterTargetAVX2;
extern const RasterTarget RasterTargetAVX512;
#endif

/// The best that this processor runs.
const RasterTarget& SelectRasterTarget();
}
