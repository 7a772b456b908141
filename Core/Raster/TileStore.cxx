// SPDX-License-Identifier: BSD-3-Clause
/**
 * How the raster of a tile (TileRaster.h) writes its pixels.
 */
#include "Core/Raster/TileRaster.h"

#include "Core/Simd/StreamingStores.h"

#include <algorithm>

namespace SurfelSplatting
{
namespace
{
/// Stores a row of a block, up to four pixels.
inline void StorePixels(
  const FinishedLayers& done, int first, int columns, float* rgba, float* depth)
{
  for (int c = 0; c < columns; ++c)
  {
    const int l = first + c;
    rgba[4 * c] = done.Red[l];
    rgba[4 * c + 1] = done.Green[l];
    rgba[4 * c + 2] = done.Blue[l];
    rgba[4 * c + 3] = 1.0f - done.Transmittance[l];
    depth[c] = done.Depth[l];
  }
}

/// Stores four pixels without reading the frame into the caches, which are too small for it.
inline void StreamPixels(const FinishedLayers& done, int first, float* rgba, float* depth)
{
  for (int l = first; l < first + BlockSize; ++l)
  {
    StreamFour(rgba + 4 * (l - first), done.Red[l], done.Green[l], done.Blue[l],
      1.0f - done.Transmittance[l]);
  }
  const float* d = done.Depth + first;
  StreamFour(depth, d[0], d[1], d[2], d[3]);
}

bool MayStream(const Frame& frame)
{
  return CanStreamTo(frame.Color) && CanStreamTo(frame.Depth) && frame.Width % BlockSize == 0;
}
}

void TileRaster::Store(const Frame& frame) const
{
  const bool stream = MayStream(frame);
  const int rows = std::min(TileSize, frame.Height - this->OriginY);
  const int columns = std::min(TileSize, frame.Width - this->OriginX);
  for (int j = 0; j < rows; ++j)
  {
    const std::size_t first =
      static_cast<std::size_t>(this->OriginY + j) * frame.Width + this->OriginX;
    if (this->IsEmpty)
    {
      std::fill_n(frame.Color + 4 * first, 4 * columns, 0.0f);
      std::fill_n(frame.Depth + first, columns, 0.0f);
      continue;
    }
    const FinishedLayers* row = this->Tile.Finished + j / BlockSize * BlocksPerRow;
    const int inBlock = j % BlockSize * BlockSize;
    for (int i = 0; i < columns; i += BlockSize)
    {
      const FinishedLayers& block = row[i / BlockSize];
      float* color = frame.Color + 4 * (first + i);
      float* depth = frame.Depth + first + i;
      if (stream)
      {
        StreamPixels(block, inBlock, color, depth);
      }
      else
      {
        StorePixels(block, inBlock, std::min(BlockSize, columns - i), color, depth);
      }
    }
  }
  FinishStreaming();
}
}
