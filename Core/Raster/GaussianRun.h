// SPDX-License-Identifier: BSD-3-Clause
/**
 * Blurred Gaussians in space that follow one another in depth, composited on cells of d px instead
 * of pixels, so that raster time depends on their number instead of their area.
 *
 * How much the lens blurs depends on the depth alone, so that a tile's Gaussians, sorted by depth,
 * form a few runs of one cell size. A run begins with the mean of the pixels' T and its moments,
 * weighted with T, in each cell. At the end, its pixels take over, interpolated bilinearly between
 * the cells, the factor of T, the colour over T, and the change of the moments over T:
 *
 *   T' = T t,  t = T_1 / T_0;   C' = C + T c,  c = (C_1 - C_0) / T_0;
 *   m' = T' (m / T + m_1 / T_1 - m_0 / T_0)
 *
 * so that pixels in front of the run keep their sharp borders. Doubts go on from those of the pixel
 * in the middle of a cell.
 *
 *   cell (i, j) of a tile is centred at (i d, j d) px: neighbouring tiles share cells at their
 *   border. d is a tile's side over one of RunIntervals (Tiles.h)
 */
#pragma once

#include "Core/Raster/RasterTarget.h"

#include <cstdint>

namespace SurfelSplatting
{
class GaussianRun
{
public:
  bool IsOpen() const { return this->Cell > 0.0f; }
  float CellSize() const { return this->Cell; }

  /**
   * Begins a run in front of which a tile has no open layers.
   * @param cell d, TileSize over one of RunIntervals, px
   * @param part the picture's part in the tile, px
   * @param doubts sum up what the picture's doubts are about
   */
  void Begin(const RasterTarget& target, const PixelTile& tile, float cell, const PictureSize& part,
    bool doubts);

  /// Adds a Gaussian. @param place in the tile, px
  std::uint64_t Add(const RasterTarget& target, const Splat& splat, const LensFootprint& lens,
    const TilePlace& place, const RasterSettings& settings);

  /// Whether nothing behind it is seen.
  bool IsOpaque() const { return ~this->State.Opaque == 0; }

  /// Writes the largest part of what is in front of it that it lets through, for each block.
  void LargestThrough(float (&behind)[BlocksPerTile]) const;

  /// Composites the run into the tile.
  void End(const RasterTarget& target, PixelTile& tile);

  /// Forgets the run.
  void Drop() { this->Cell = 0.0f; }

private:
  /// Range of the cells whose centres are in a box of pixels, along an axis.
  int FirstCell(int pixel) const;
  int EndCell(int pixel, int size) const;

  float Cell = 0.0f;
  RunGrid Grid{};
  PixelTile State; ///< its pixels are the cells
  RunStart Start;
};
}
