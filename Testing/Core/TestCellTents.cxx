// SPDX-License-Identifier: BSD-3-Clause
/**
 * The tents that a coarse grid's layers become, for every instruction set that this machine has,
 * against their definition in double; and which layers may be two surfaces.
 */
#include "Core/Raster/RasterTarget.h"
#include "Core/Raster/TwoSurfaces.h"
#include "TargetUnderTest.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"
#include "TileUnderTest.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

using namespace SurfelSplatting;

namespace
{
/// A splat's share of a cell.
struct Share
{
  double Weight, Opacity, Depth, Half; ///< Half of the z-range's length
  double Color[3], Point[2];
};

std::vector<Share> RandomShares(Random& random, double unit)
{
  const double width = random.Uniform(0.0, 1.0), away = std::exp(random.Uniform(-1.0, 3.0));
  const double half = unit * std::exp(random.Uniform(-7.0, 0.0));
  const int surfaces = random.Integer(0, 3) == 0 ? 2 : 1;
  std::vector<Share> shares(static_cast<std::size_t>(random.Integer(1, 12)));
  for (Share& s : shares)
  {
    const double z = away + random.Integer(0, surfaces - 1) + width * random.Uniform(-0.3, 0.3);
    s = { random.Uniform(1e-3, 0.2), random.Uniform(0.0, 1.0), unit * z, half, {}, {} };
    for (double& c : s.Color)
    {
      c = random.Uniform(0.0, 1.0);
    }
    for (double& u : s.Point)
    {
      u = random.Uniform(-0.7, 0.7);
    }
  }
  return shares;
}

void Store(PixelTile& tile, int block, int l, const std::vector<Share>& shares)
{
  OpenLayers& open = tile.Open[block];
  LensLayers& lens = tile.Lens[block];
  CoarseLayers& c = tile.Coarse[block];
  float* const colors[] = { open.Red, open.Green, open.Blue };
  float* const withX[] = { c.RedX, c.GreenX, c.BlueX };
  float* const withY[] = { c.RedY, c.GreenY, c.BlueY };
  for (const Share& s : shares)
  {
    c.Near[l] = std::min(c.Near[l], static_cast<float>(s.Depth - s.Half));
  }
  const auto add = [&](float* sums, double x) { sums[l] += static_cast<float>(x); };
  for (const Share& s : shares)
  {
    const double seen = s.Weight * s.Opacity, depth = s.Depth - c.Near[l];
    add(open.Weight, s.Weight);
    add(open.Opacity, seen);
    add(open.Depth, s.Weight * depth);
    add(c.SquaredDepth, s.Weight * std::pow(depth, 2));
    add(c.CubedDepth, s.Weight * std::pow(depth, 3));
    add(c.FourthDepth, s.Weight * std::pow(depth, 4));
    add(c.HalfRange, s.Weight * s.Half);
    add(lens.FillX, s.Weight * s.Point[0]);
    add(lens.FillY, s.Weight * s.Point[1]);
    for (int k = 0; k < 3; ++k)
    {
      add(colors[k], seen * s.Color[k]);
      add(withX[k], seen * s.Color[k] * s.Point[0]);
      add(withY[k], seen * s.Color[k] * s.Point[1]);
    }
    add(c.XX, seen * s.Point[0] * s.Point[0]);
    add(c.XY, seen * s.Point[0] * s.Point[1]);
    add(c.YY, seen * s.Point[1] * s.Point[1]);
  }
}

void CheckMeans(const CellTents& tents, int l, const std::vector<Share>& shares)
{
  double weight = 0.0, seen = 0.0, depth = 0.0, x = 0.0, y = 0.0, red = 0.0, redX = 0.0, xy = 0.0;
  for (const Share& s : shares)
  {
    weight += s.Weight;
    seen += s.Weight * s.Opacity;
    depth += s.Weight * s.Depth;
    x += s.Weight * s.Point[0];
    y += s.Weight * s.Point[1];
    red += s.Weight * s.Opacity * s.Color[0];
    redX += s.Weight * s.Opacity * s.Color[0] * s.Point[0];
    xy += s.Weight * s.Opacity * s.Point[0] * s.Point[1];
  }
  x /= weight;
  y /= weight;
  CHECK_NEAR(tents.Opacity[l], seen / weight, 1e-5);
  CHECK_NEAR(tents.Depth[l], depth / weight, 1e-5 * depth / weight);
  CHECK_NEAR(tents.PointX[l], x, 1e-5);
  CHECK_NEAR(tents.PointY[l], y, 1e-5);
  CHECK_NEAR(tents.Red[l], red / seen, 1e-5);
  CHECK_NEAR(tents.RedX[l], redX / seen - red / seen * x, 1e-5);
  CHECK_NEAR(tents.XY[l], xy / seen - x * y, 1e-5);
  CHECK(tents.Near[l] < tents.Depth[l]);
  CHECK(tents.Depth[l] < tents.Far[l]);
}

/// The scalar layer of a cell.
LayerDepths LayerOf(const PixelTile& tile, int block, int l)
{
  const OpenLayers& open = tile.Open[block];
  const CoarseLayers& c = tile.Coarse[block];
  const float weight = open.Weight[l], first = open.Depth[l];
  return { weight, c.Near[l] + first / weight, first, c.SquaredDepth[l], c.CubedDepth[l],
    c.FourthDepth[l], c.HalfRange[l] / weight };
}

struct Cells
{
  std::vector<std::vector<Share>> Shares; ///< [block][lane], empty: no layer
  int Layers = 0, Possible = 0, Two = 0;

  static void Closed(
    void* self, const PixelTile& tile, int block, unsigned int lanes, const CellTents& tents)
  {
    auto* cells = static_cast<Cells*>(self);
    for (int l = 0; l < PixelsPerBlock; ++l)
    {
      const auto& shares = cells->Shares[static_cast<std::size_t>(block * PixelsPerBlock + l)];
      CHECK((lanes >> l & 1) == (shares.empty() ? 0u : 1u));
      if (shares.empty())
      {
        continue;
      }
      CheckMeans(tents, l, shares);
      const LayerDepths layer = LayerOf(tile, block, l);
      const LayerPart whole = WholeLayer(layer);
      // The variance is a small difference of rounded squares.
      const double rounding = 1e-3 * layer.First / layer.Weight + 1e-6 * whole.Far;
      CHECK_NEAR(tents.Near[l], whole.Near, rounding);
      CHECK_NEAR(tents.Far[l], whole.Far, rounding);
      const bool isPossible = (tents.MayBeTwo >> l & 1) != 0;
      TwoNormals fit{};
      LayerPart parts[2] = {};
      const bool splits = SplitLayer(layer, whole, fit, parts);
      CHECK((isPossible || !splits));
      ++cells->Layers;
      cells->Possible += isPossible ? 1 : 0;
      cells->Two += splits ? 1 : 0;
    }
  }
};

void TestTents(const RasterTarget& target, Random& random, double unit, Cells& cells)
{
  const auto tile = EmptyTile();
  cells.Shares.assign(std::size_t{ BlocksPerTile } * PixelsPerBlock, {});
  for (int block = 0; block < BlocksPerTile; ++block)
  {
    for (int l = 0; l < PixelsPerBlock; ++l)
    {
      // All cells of the first block have a layer, some of the others.
      if (block == 0 || random.Integer(0, 3) > 0)
      {
        auto& shares = cells.Shares[static_cast<std::size_t>(block * PixelsPerBlock + l)];
        shares = RandomShares(random, unit);
        Store(*tile, block, l, shares);
      }
    }
  }
  RasterSettings settings{ 4.0f, 1e30f };
  settings.Pass = RasterPass::Collect;
  target.CloseAll(*tile, settings, { &cells, nullptr, &Cells::Closed });
}

const RasterTarget* const Targets[] = { &RasterTargetBaseline,
#ifdef SURFELSPLATTING_X86_TARGETS
  &RasterTargetAVX2, &RasterTargetAVX512
#endif
};

/// The program's argument is baseline, avx2 or avx512.
TEST_CASE("Tents of cells")
{
  const RasterTarget* target = TargetUnderTest(Targets);
  if (!target)
  {
    return;
  }
  Random random(11);
  for (const double unit : { 1e-4, 1.0, 1e6 })
  {
    Cells cells;
    for (int i = 0; i < 20; ++i)
    {
      TestTents(*target, random, unit, cells);
    }
    std::printf("unit %g: of %d layers %d may be two, %d are\n", unit, cells.Layers, cells.Possible,
      cells.Two);
    CHECK(cells.Two > cells.Layers / 50);
    CHECK(cells.Possible < 2 * cells.Two);
  }
}
}
