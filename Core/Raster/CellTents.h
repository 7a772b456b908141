// SPDX-License-Identifier: BSD-3-Clause
/**
 * The tents (Tent.h) of the open layers of a coarse grid's block, sixteen cells at a time.
 *
 * Included by the translation units of the raster's targets (RasterTarget.h), whose own this code
 * is.
 */
#pragma once

#include "Core/Raster/LayerDepths.h"
#include "Core/Raster/RasterTarget.h"
#include "Core/Simd/Lanes.h"

namespace SurfelSplatting
{
namespace
{
/// Lanes whose layers SplitLayer (TwoSurfaces.h) may split, by the conditions of FitTwoNormals in
/// floats. They are wider by a twentieth, for the rounding of the fourth moment. NaN may be split.
SURFELSPLATTING_INLINE unsigned int MayBeTwo(const DepthMoments<Lanes>& layer)
{
  // In units of half a z-range, so that powers neither overflow nor underflow.
  const Lanes unit = 1.0f / layer.HalfRange, first = unit / layer.Weight;
  const Lanes mean = first * layer.First, second = first * unit * layer.Squared;
  const Lanes third = first * unit * unit * layer.Cubed;
  const Lanes fourth = first * unit * unit * unit * layer.Fourth;
  const Lanes variance = second - mean * mean;
  const Lanes central3 = third - mean * (3.0f * second - 2.0f * mean * mean);
  const Lanes central4 =
    fourth - mean * (4.0f * third - mean * (6.0f * second - 3.0f * mean * mean));
  const Lanes squared = central3 * central3, cube = variance * variance * variance;
  const LaneMask isShort = 4.0f * cube + squared < 3.6f * variance * variance;
  constexpr float ofCube = 2.0f * (1.0f - LeastApart * LeastApart);
  constexpr float ofSquared = 1.0f / LeastApart - 1.0f;
  const Lanes most = (1.05f * ofCube + 0.05f) * cube + (1.05f * ofSquared) * squared;
  const LaneMask isEven = central4 * variance - cube - squared > most;
  return ~(isShort.ToBits() | isEven.ToBits());
}

/// @param block of a coarse grid; tents of cells without a layer are undefined
SURFELSPLATTING_INLINE void MakeTents(const PixelTile& tile, int block, CellTents& to)
{
  const OpenLayers& open = tile.Open[block];
  const LensLayers& lens = tile.Lens[block];
  const CoarseLayers& c = tile.Coarse[block];
  const Lanes weight = Lanes::Load(open.Weight), opacity = Lanes::Load(open.Opacity);
  const Lanes perWeight = 1.0f / weight;
  const Lanes perOpacity = Select(opacity > 0.0f, 1.0f / opacity, 0.0f);
  const Lanes first = Lanes::Load(open.Depth);
  const DepthMoments<Lanes> depths{ weight, Lanes::Load(c.Near) + first * perWeight, first,
    Lanes::Load(c.SquaredDepth), Lanes::Load(c.CubedDepth), Lanes::Load(c.FourthDepth),
    Lanes::Load(c.HalfRange) * perWeight };
  const DepthRange<Lanes> whole = WholeLayer(depths);
  whole.Near.Store(to.Near);
  whole.Far.Store(to.Far);
  whole.Depth.Store(to.Depth);
  (opacity * perWeight).Store(to.Opacity);
  const Lanes x = Lanes::Load(lens.FillX) * perWeight, y = Lanes::Load(lens.FillY) * perWeight;
  x.Store(to.PointX);
  y.Store(to.PointY);
  // A colour and its covariances with the point.
  const auto color = [&](const float* sum, const float* timesX, const float* timesY, float* mean,
                       float* withX, float* withY) {
    const Lanes value = Lanes::Load(sum) * perOpacity;
    value.Store(mean);
    (Lanes::Load(timesX) * perOpacity - value * x).Store(withX);
    (Lanes::Load(timesY) * perOpacity - value * y).Store(withY);
  };
  color(open.Red, c.RedX, c.RedY, to.Red, to.RedX, to.RedY);
  color(open.Green, c.GreenX, c.GreenY, to.Green, to.GreenX, to.GreenY);
  color(open.Blue, c.BlueX, c.BlueY, to.Blue, to.BlueX, to.BlueY);
  (Lanes::Load(c.XX) * perOpacity - x * x).Store(to.XX);
  (Lanes::Load(c.XY) * perOpacity - x * y).Store(to.XY);
  (Lanes::Load(c.YY) * perOpacity - y * y).Store(to.YY);
  to.MayBeTwo = MayBeTwo(depths);
}
}
}
