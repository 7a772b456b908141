// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Raster/AncestorChoice.h"

#include "Core/Raster/BlockMasks.h"

#include <algorithm>

namespace SurfelSplatting
{
AncestorChoice::AncestorChoice(const LazySplats& lazy, const RasterTarget& target,
  const PixelTile& tile, const GaussianRun& front, int x, int y)
  : Lazy(lazy)
  , OriginX(x)
  , OriginY(y)
{
  const LazySplats::LittleLight& little = lazy.CoarserBelow();
  if (little.InBlur <= 0.0f)
  {
    return;
  }
  float behind[BlocksPerTile];
  if (front.IsOpen())
  {
    front.LargestThrough(behind);
  }
  else
  {
    std::fill_n(behind, BlocksPerTile, 1.0f);
  }
  this->Bright = target.FindBright(tile, behind, { little.OfVolumes, little.InBlur });
  std::fill_n(this->Sums[0], BlocksPerRow + 1, 0.0f);
  for (int j = 0; j < BlocksPerRow; ++j)
  {
    float row = this->Sums[j + 1][0] = 0.0f;
    for (int i = 0; i < BlocksPerRow; ++i)
    {
      row += this->Bright.MeanSquare[j * BlocksPerRow + i];
      this->Sums[j + 1][i + 1] = this->Sums[j][i + 1] + row;
    }
  }
}

/// Mean square of T in the blocks that a span of the tile's pixels touches.
float AncestorChoice::MeanSquare(const PixelBox& span) const
{
  const int left = span.X0 / BlockSize, right = (span.X1 + BlockSize - 1) / BlockSize;
  const int low = span.Y0 / BlockSize, high = (span.Y1 + BlockSize - 1) / BlockSize;
  const float sum = (this->Sums[high][right] - this->Sums[high][left]) -
    (this->Sums[low][right] - this->Sums[low][left]);
  return sum / static_cast<float>((right - left) * (high - low));
}

bool AncestorChoice::IsDim(std::uint32_t run) const
{
  const PixelBox& box = this->Lazy.Bounds(run);
  const PixelBox span{ std::max(0, box.X0 - this->OriginX), std::max(0, box.Y0 - this->OriginY),
    std::min(TileSize, box.X1 - this->OriginX), std::min(TileSize, box.Y1 - this->OriginY) };
  const bool isBlurred = this->Lazy.IsBlurred(run), isOfVolume = this->Lazy.IsOfVolume(run);
  if (!isBlurred && !isOfVolume)
  {
    const float most = this->Lazy.CoarserBelow().OfCaptures;
    return this->MeanSquare(span) < most * most;
  }
  const std::uint64_t blocks = BlocksOf(span);
  return (isBlurred && (blocks & this->Bright.ByMean) == 0) ||
    (isOfVolume && (blocks & this->Bright.ByLargest) == 0);
}
}
