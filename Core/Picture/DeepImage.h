// SPDX-License-Identifier: BSD-3-Clause
/**
 * A picture that keeps its layers. Each pixel has samples by ascending depth with premultiplied
 * colour and alpha; composited front to back they give the picture.
 *
 * Samples are tidy in the sense of OpenEXR (F. Kainz, "Interpreting OpenEXR Deep Pixels", 2013):
 * sorted, and they do not overlap. Those of surfaces and captures have no extent in depth (a
 * z-range tells which splats belong to one surface, not how thick it is), and there is at most one
 * at each depth. The Gaussians of a volume, of which each is spread over some of its neighbours,
 * become samples with an extent, in which the light is absorbed evenly.
 *
 * Cells of the lens are joined exactly. With T_k the transmittance of cell k
 * before a sample with colour c_k and alpha_k, the mean picture is the sum of mean(T_k c_k), and
 * the mean transmittance T falls by mean(T_k alpha_k) at the sample's depth. Hence
 *
 *   alpha_i = 1 - T_i / T_(i-1),   c_i = mean(T_k c_k) / T_(i-1).
 *
 * Samples of several cells would overlap; then those of volumes have no extent, either.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Raster/ABuffer.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
struct DeepSample
{
  float Red, Green, Blue, Alpha; ///< premultiplied, linear; alpha in (0, 1]
  float Depth;                   ///< distance along the view direction, world units
  float Back;                    ///< where it ends; Depth if it has no extent
};

class DeepImage : public LayerSink
{
public:
  /// Empties the image and sets its size, px.
  /// @param hasExtents whether samples of volumes get an extent; for pictures of one cell
  void Begin(int width, int height, bool hasExtents = false);

  void BeginCell() override { ++this->Cells; }
  void BeginTile(const PixelBox& tile) override;
  void Receive(int x, int y, const VisibleLayer& layer) override;

  /// Samples behind a smaller transmittance are dropped: they add less than 1/255 to the picture.
  static constexpr float MinTransmittance = 1.0f / 4096.0f;

  /// Layers leak into the picture bit by bit. What adds less alpha than this joins the sample
  /// before.
  static constexpr float MinAlpha = 1.0f / 256.0f;

  /// Gaussians of a volume join the sample in front up to so many of their deviations behind its
  /// first one: as far as what each stands for reaches; and farther as long as the sample hides no
  /// more than MostAlpha of the picture, by which the transmittance within it may be wrong at most.
  static constexpr float ReachOfGaussian = 2.0f, ReachOfSample = 8.0f;
  static constexpr float MostAlpha = 1.0f / 16.0f;

  /// Makes the samples. Call after the last cell.
  void Finish(const Executor& executor);

  int Width() const { return this->Columns; }
  int Height() const { return this->Rows; }

  /// Valid after Finish. The samples of pixel p = y width + x are Samples()[Offsets()[p]] up to,
  /// but not including, Samples()[Offsets()[p + 1]].
  const std::vector<std::uint64_t>& Offsets() const { return this->Ends; }
  const std::vector<DeepSample>& Samples() const { return this->All; }

private:
  /// What layers add to the picture of their cell: T c, T alpha.
  struct Part
  {
    std::uint32_t Pixel; // index within the tile
    float Spread;        // least of its layers; 0: of no volume
    DeepSample Visible;
  };
  using Parts = std::vector<Part>;

  static bool Joins(const VisibleLayer& layer, const Part& part);
  static void ExtendMedia(Part* begin, Part* end);
  void FinishTile(std::size_t tile, std::vector<DeepSample>& samples);

  int Columns = 0;
  int Rows = 0;
  int Cells = 0;
  bool HasExtents = false;
  std::vector<std::uint32_t> Last; // [pixels] the pixel's last part in its tile, plus 1; 0: none
  std::vector<Parts> Tiles;
  std::vector<std::uint64_t> Ends;
  std::vector<DeepSample> All;
};
}
