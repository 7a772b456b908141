// SPDX-License-Identifier: BSD-3-Clause
/**
 * The raster's inner loops, one translation unit per instruction set (RasterTarget*.cxx, all from
 * RasterImplementation.h). SelectRasterTarget chooses one when the library is loaded. These files
 * use no inline function of the standard library: the linker could use a copy compiled for AVX in
 * code that runs everywhere.
 */
#pragma once

#include "Core/Base/Tiles.h"
#include "Core/Lens/Lens.h"
#include "Core/Lens/LensVisibility.h"
#include "Core/Splats/Splat.h"
#include "Core/Splats/Tent.h"

#include <cstdint>

namespace SurfelSplatting
{
/// A pixel is opaque when less than this shines through its finished layers.
constexpr float MinTransmittance = 1.0f / 512.0f;

/// A tile's pixels are stored in blocks of 4 x 4, row by row: sixteen are processed at a time, and
/// a splat in focus covers few blocks.
constexpr int BlockSize = 4; ///< px
constexpr int PixelsPerBlock = BlockSize * BlockSize;
constexpr int BlocksPerRow = TileSize / BlockSize;
constexpr int BlocksPerTile = BlocksPerRow * BlocksPerRow;

/// The block of a tile's pixel, and the pixel's place in it.
SURFELSPLATTING_INLINE int BlockOfPixel(int x, int y)
{
  return y / BlockSize * BlocksPerRow + x / BlockSize;
}
SURFELSPLATTING_INLINE int LaneOfPixel(int x, int y)
{
  return y % BlockSize * BlockSize + x % BlockSize;
}

/// OpenLayers::Far where there is no layer. Every comparison with NaN is false: nothing ends there.
constexpr float NoFar = __builtin_nanf("");

/// The open layers of a block's pixels. Most splats touch nothing else. Colours are sums of w o c,
/// or, in tilted blocks, of w o T(u) c.
struct alignas(64) OpenLayers
{
  float Far[PixelsPerBlock];                             ///< of their z-ranges
  float Weight[PixelsPerBlock], Opacity[PixelsPerBlock]; ///< sum w, sum w o
  float Red[PixelsPerBlock], Green[PixelsPerBlock], Blue[PixelsPerBlock];
  float Depth[PixelsPerBlock]; ///< sum w z; of coarse grids sum w (z - CoarseLayers::Near)
  float Gaps[PixelsPerBlock];  ///< sum w g, g the length of the gaps behind that were left open
};

/// First moments over the lens of the open layers (LensVisibility.h).
struct alignas(64) LensLayers
{
  float FillX[PixelsPerBlock], FillY[PixelsPerBlock]; ///< sum w u
  /// In tilted blocks only:
  float Seen[PixelsPerBlock];                         ///< sum w o T(u)
  float SeenX[PixelsPerBlock], SeenY[PixelsPerBlock]; ///< sum w o T(u) u
};

/// Two surfaces in one open layer, which tents show: they end at different depths, or find no room.
struct alignas(64) TentLayers
{
  float Farther[PixelsPerBlock];       ///< LayerEnds
  float FartherWeight[PixelsPerBlock]; ///< LayerEnds::Weight
  /// ShareOfRefused of what there was no room for: sum w, sum w u.
  float Refused[PixelsPerBlock], RefusedX[PixelsPerBlock], RefusedY[PixelsPerBlock];
};

/// What else is known about the layers of a coarse grid's cells (Tent.h).
struct alignas(64) CoarseLayers
{
  float Near[PixelsPerBlock];                       ///< of their z-ranges
  float RedX[PixelsPerBlock], RedY[PixelsPerBlock]; ///< sum w o c u
  float GreenX[PixelsPerBlock], GreenY[PixelsPerBlock];
  float BlueX[PixelsPerBlock], BlueY[PixelsPerBlock];
  float XX[PixelsPerBlock], XY[PixelsPerBlock], YY[PixelsPerBlock]; ///< sum w o u u'
  float HalfRange[PixelsPerBlock];    ///< sum w (far - near) / 2 of the splats
  float SquaredDepth[PixelsPerBlock]; ///< sum w (z - Near)^2
  float CubedDepth[PixelsPerBlock];   ///< sum w (z - Near)^3
  float FourthDepth[PixelsPerBlock];  ///< sum w (z - Near)^4
  float PointDepthX[PixelsPerBlock], PointDepthY[PixelsPerBlock]; ///< sum w u (z - Near)
  float OpacityDepth[PixelsPerBlock];                             ///< sum w o (z - Near)
  float RedDepth[PixelsPerBlock], GreenDepth[PixelsPerBlock],
    BlueDepth[PixelsPerBlock]; ///< sum w o c (z - Near)
};

/// The finished part of a block's pixels: the fields of the frame and what belongs to them.
struct alignas(64) FinishedLayers
{
  float Transmittance[PixelsPerBlock];                      ///< mean of T(u) over the lens
  float ThroughX[PixelsPerBlock], ThroughY[PixelsPerBlock]; ///< mean of u T(u)
  /// Means of (2 |u|^2 - 1) T(u), (u_x^2 - u_y^2) T(u), 2 u_x u_y T(u).
  float ThroughRim[PixelsPerBlock], ThroughAcross[PixelsPerBlock], ThroughDiagonal[PixelsPerBlock];
  float Red[PixelsPerBlock], Green[PixelsPerBlock], Blue[PixelsPerBlock], Depth[PixelsPerBlock];
  float OccluderDepth[PixelsPerBlock]; ///< layers behind this are hidden by another prop
  float Fragments[PixelsPerBlock];     ///< so far; only with a callback
};

/// How uncertain it is what is seen of the finished layers (Core/Picture/DoubtfulTiles.h).
struct alignas(64) DoubtedLayers
{
  float Doubt[PixelsPerBlock]; ///< so far
  float Width[PixelsPerBlock]; ///< share of the lens through which the last layers, or what is
                               ///< behind them, are seen
  /// Colour of the last layer; after Gaussians in space, their mean.
  float Red[PixelsPerBlock], Green[PixelsPerBlock], Blue[PixelsPerBlock];
  /// Doubts about Gaussians in space, signed: colours that vary at random add up to nothing.
  float RedDrift[PixelsPerBlock], GreenDrift[PixelsPerBlock], BlueDrift[PixelsPerBlock];
  float Variation[PixelsPerBlock]; ///< mean of |T(u) - T| over the lens
  /// For layers of which a part has leaked: the weight that stays, and the whole layers' share of
  /// the lens and interval. What stays is seen beside what has leaked, of which there is no doubt.
  float LeftWeight[PixelsPerBlock], LeftCover[PixelsPerBlock], LeftInterval[PixelsPerBlock];
};

struct PixelTile
{
  OpenLayers Open[BlocksPerTile];
  LensLayers Lens[BlocksPerTile];
  CoarseLayers Coarse[BlocksPerTile];
  FinishedLayers Finished[BlocksPerTile];
  DoubtedLayers Doubted[BlocksPerTile]; ///< with RasterSettings::Doubts only
  TentLayers Tents[BlocksPerTile];      ///< of blocks WithTents
  /// Bit i: no pixel of block i lets more than MinTransmittance through. With
  /// RasterSettings::ShortCuts nothing more is added to the block.
  std::uint64_t Opaque;
  /// Bit i: no pixel of block i lets more than DarkTransmittance through (BroadGaussians.h); not
  /// known of all such blocks.
  std::uint64_t Dark;
  /// Bit i: T depends on the point of the lens in block i; fragments are weighted with it.
  std::uint64_t Tilted;
  std::uint64_t WithTents; ///< bit i: block i has TentLayers
};
static_assert(BlocksPerTile == 64, "a bit of PixelTile::Opaque each");

/// The cells of a run, and the picture's part in the tile.
struct RunGrid
{
  int Intervals;
  int Width, Height; ///< 1 to TileSize, px
  bool Doubts;       ///< as in RasterSettings
};

/// What was in front of a run, in its cells.
struct RunStart
{
  FinishedLayers Before[BlocksPerTile];
};

/// What the layers of a block add to the picture.
struct alignas(64) LeakedLayers
{
  float Red[PixelsPerBlock], Green[PixelsPerBlock],
    Blue[PixelsPerBlock];      ///< premultiplied, visible
  float Alpha[PixelsPerBlock]; ///< what they take of the transmittance in front of them
  /// With a callback:
  float Depth[PixelsPerBlock];    ///< mean, world units along the view direction
  float Coverage[PixelsPerBlock]; ///< share of what is behind that they cover, whatever the opacity
  float Spread[PixelsPerBlock];   ///< VisibleLayer::Spread
};

/// The tents of a block's cells (Tent.h), but for what follows from their places.
struct alignas(64) CellTents
{
  float Near[PixelsPerBlock], Far[PixelsPerBlock], Depth[PixelsPerBlock];
  float Red[PixelsPerBlock], Green[PixelsPerBlock], Blue[PixelsPerBlock], Opacity[PixelsPerBlock];
  float PointX[PixelsPerBlock], PointY[PixelsPerBlock];
  float RedX[PixelsPerBlock], RedY[PixelsPerBlock], GreenX[PixelsPerBlock], GreenY[PixelsPerBlock];
  float BlueX[PixelsPerBlock], BlueY[PixelsPerBlock];
  float XX[PixelsPerBlock], XY[PixelsPerBlock], YY[PixelsPerBlock];
  unsigned int MayBeTwo; ///< lanes whose layers may be two surfaces (TwoSurfaces.h)
};

/// Functions that are called with the lanes (bit l: pixel l) of a block. Null ones are not called.
struct RasterCallbacks
{
  void* User;
  /// For layers of which a part joins the finished ones, all of it in the end.
  void (*Leaked)(
    void* user, const PixelTile& tile, int block, unsigned int lanes, const LeakedLayers& leaked);
  /// For layers of a coarse grid that are about to be emptied, unless they are too light to be
  /// seen. Required by RasterPass::Collect.
  void (*Closed)(
    void* user, const PixelTile& tile, int block, unsigned int lanes, const CellTents& tents);
};

/// The buffer that the raster adds splats to.
enum class RasterPass
{
  Layers,  ///< the A-buffer
  Collect, ///< layers of a coarse grid, which are not composited
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
  /// The radius of the blur at depth z, world units, is |z BlurPerDepth - LensRadius|. 0: no lens.
  float LensRadius = 0.0f, BlurPerDepth = 0.0f;
  /// Symmetric, determinant 1: maps a disc to an ellipse as a lens (LensShape). Points of the lens
  /// are those of the unit disc.
  float RootXX = 1.0f, RootXY = 0.0f, RootYY = 1.0f;
  RasterPass Pass = RasterPass::Layers;
  /// Change pixels by about MinTransmittance to save time: add nothing to opaque blocks, and end
  /// layers beside an item that begins far behind them (BlockLayers.h).
  bool ShortCuts = false;
  bool Doubts = false;   ///< sum up PixelTile::Doubted
  bool HasLayers = true; ///< the tile may have open layers
  /// Splats begin so far in front of the depth by which they are sorted at most, world units.
  float LargestDelay = 0.0f;

  /// Called on every processor, so not in a target.
  void SetShape(const LensShape& shape)
  {
    const LensShape root = shape.Root(); // of determinant 1
    this->RootXX = static_cast<float>(root.XX);
    this->RootXY = static_cast<float>(root.XY);
    this->RootYY = static_cast<float>(root.YY);
  }

  SURFELSPLATTING_INLINE bool IsLensRound() const
  {
    return this->RootXX == 1.0f && this->RootXY == 0.0f;
  }
};

/// Where a splat or a tent lies in a tile.
struct TilePlace
{
  PixelBox Span; ///< the tile's pixels in its box
  float X, Y;    ///< its centre, px from the tile's lower left corner
};

/// Transmittances from which on a block is bright (AncestorChoice.h).
struct BrightLimits
{
  float Largest;        ///< of its pixels
  float RootMeanSquare; ///< of them
};

/// Sets of blocks, as in PixelTile::Opaque.
struct BrightBlocks
{
  std::uint64_t ByLargest, ByMean;
  float MeanSquare[BlocksPerTile]; ///< of what they let through
};

/// Splats of surfels and tents that are added to a tile together.
constexpr int BatchSize = 64;

/// A splat or a tent of a batch.
struct BatchItem
{
  const Splat* Body;              ///< null for tents
  const Tent* Cell;               ///< null for splats
  const SplatGradient* Gradient;  ///< or null: one colour
  const LensFootprint* Footprint; ///< of splats, if there is a lens; else null
  TilePlace Place;
  float LargestColor; ///< RasterSettings::LargestColor from this item on
};

struct RasterTarget
{
  /// Adds up to BatchSize splats and tents to the blocks that their spans touch, as if one after
  /// another; returns the number of fragments.
  std::uint64_t (*AddBatch)(PixelTile& tile, const BatchItem* batch, int count,
    const RasterSettings& settings, const RasterCallbacks& callbacks);
  /// Adds a Gaussian in space (Splat.h). Its fragments are composited at once.
  /// @param lens its SpaceFootprint, or null: no lens
  std::uint64_t (*AddGaussian)(PixelTile& tile, const Splat& splat, const LensFootprint* lens,
    const TilePlace& place, const RasterSettings& settings, const RasterCallbacks& callbacks);
  /// Begins a run of Gaussians behind the finished layers of a tile (GaussianRun.h).
  void (*BeginRun)(const PixelTile& tile, const RunGrid& grid, PixelTile& run, RunStart& start);
  /// Composites it.
  void (*AddRun)(PixelTile& tile, const PixelTile& run, const RunStart& start, const RunGrid& grid);
  /// Lanes of a block that nothing which begins behind a depth can change by more than
  /// MinTransmittance.
  unsigned int (*HiddenFrom)(
    const PixelTile& tile, int block, float near, const RasterSettings& settings);
  /// Blocks whose finished layers let enough through.
  /// @param behind of each block, a factor of T
  BrightBlocks (*FindBright)(
    const PixelTile& tile, const float* behind, const BrightLimits& limits);
  /// Composites all open layers of a tile, or hands them over (RasterPass::Collect).
  void (*CloseAll)(
    PixelTile& tile, const RasterSettings& settings, const RasterCallbacks& callbacks);
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
