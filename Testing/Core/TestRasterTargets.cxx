// SPDX-License-Identifier: BSD-3-Clause
/**
 * The loops of the raster for every instruction set that this machine has, against a scalar one in
 * double; the exponential; the choice of the target.
 */
#include "Core/Lens/LensVisibility.h"
#include "Core/Lens/ResamplingKernel.h"
#include "Core/Raster/RasterTarget.h"
#include "Core/Simd/Lanes.h"
#include "ScalarRaster.h"
#include "TargetUnderTest.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"
#include "TileUnderTest.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>
#include <string>

using namespace SurfelSplatting;

namespace
{
constexpr RasterSettings Settings{ Support, 1e30f };

/// A lens in focus at no splat's depth, where a gap would be LargestGap bands, but for roundings;
/// no layer is ever clamped to the largest colour.
constexpr ReferenceLens WithLens{ 0.4, 2.45 };
RasterSettings LensSettings()
{
  RasterSettings settings = Settings;
  settings.LensRadius = static_cast<float>(WithLens.Radius);
  settings.BlurPerDepth = static_cast<float>(WithLens.Radius / WithLens.FocalDistance);
  settings.SetShape(ShapeOfLens);
  return settings;
}

/// Sums what layers add to each pixel.
struct LeakSum
{
  double Red[TileSize * TileSize] = {}, Alpha[TileSize * TileSize] = {};
  int Calls = 0;

  static void Leaked(
    void* self, const PixelTile& tile, int block, unsigned int lanes, const LeakedLayers& leaked)
  {
    CHECK((lanes >> PixelsPerBlock) == 0);
    auto* sum = static_cast<LeakSum*>(self);
    ++sum->Calls;
    for (int l = 0; l < PixelsPerBlock; ++l)
    {
      if ((lanes >> l & 1) != 0 && tile.Open[block].Weight[l] > 0.0f)
      {
        const int x = block % BlocksPerRow * BlockSize + l % BlockSize;
        const int y = block / BlocksPerRow * BlockSize + l / BlockSize;
        CHECK(leaked.Red[l] >= 0.0f);
        CHECK(leaked.Alpha[l] >= 0.0f);
        sum->Red[y * TileSize + x] += leaked.Red[l];
        sum->Alpha[y * TileSize + x] += leaked.Alpha[l];
      }
    }
  }
};

struct Worst
{
  double Color = 0, Moment = 0;
  long Compared = 0, Bounded = 0;
};

void CompareTile(const PixelTile& tile, const ScalarTile& scalar, const LeakSum& sum, Worst& worst)
{
  for (int i = 0; i < TileSize * TileSize; ++i)
  {
    const ScalarPixel& p = scalar[i];
    const int x = i % TileSize, y = i / TileSize;
    const int block = y / BlockSize * BlocksPerRow + x / BlockSize;
    const int l = y % BlockSize * BlockSize + x % BlockSize;
    const OpenLayers& open = tile.Open[block];
    const FinishedLayers& done = tile.Finished[block];
    const double bound = p.Bound();
    ++worst.Compared;
    if (!p.Undecided && bound < 1e-3)
    {
      ++worst.Bounded;
      CHECK_NEAR(done.Red[l], p.Layers.Color[0], bound + 1e-7);
      CHECK_NEAR(done.Transmittance[l], p.Layers.Through, bound + 1e-7);
      worst.Color = std::max(worst.Color, std::abs(done.Red[l] - p.Layers.Color[0]));
    }
    const double length = std::hypot(done.ThroughX[l], done.ThroughY[l]);
    CHECK(done.Transmittance[l] >= 0.0f);
    CHECK(done.Transmittance[l] <= 1.0f);
    // InverseRoot, which shortens moments, is off by up to 6.2e-5 of its value.
    CHECK(length <= (1.0 + 7e-5) * ReferenceLargestMoment(done.Transmittance[l]) + 1e-6);
    worst.Moment = std::max(worst.Moment, length);
    // The callbacks got all of the picture: each sum is off by a rounding for each part.
    CHECK_NEAR(sum.Red[i], done.Red[l], 4e-6);
    CHECK_NEAR(sum.Alpha[i], 1.0 - done.Transmittance[l], 4e-6);
    CHECK(open.Weight[l] == 0.0f);
    CHECK(std::isnan(open.Far[l])); // NoFar: all layers ended
  }
}

/// What lies behind opaque blocks changes nothing where it is skipped, and no more than
/// MinTransmittance where it is not.
void TestOpaqueBlocks(const RasterTarget& target)
{
  Splat wall{}, behind{};
  wall.A = wall.B = behind.A = behind.B = 1e-4f;
  wall.Weight = behind.Weight = 2.0f;
  wall.Opacity = behind.Opacity = 1.0f;
  wall.Near = wall.Far = 1.0f;
  wall.Green = behind.Red = 1.0f;
  const PixelBox left{ 0, 0, TileSize / 2, TileSize }, all{ 0, 0, TileSize, TileSize };
  for (const bool skip : { false, true })
  {
    RasterSettings settings = Settings;
    settings.ShortCuts = skip;
    const auto tile = EmptyTile();
    std::uint64_t fragments[3];
    AddSplat(target, *tile, { wall, nullptr, nullptr }, { left, 16, 16 }, settings, Nobody);
    CHECK(tile->Opaque == 0); // still open
    for (int i = 0; i < 3; ++i)
    {
      behind.Near = behind.Far = 2.0f + static_cast<float>(i);
      fragments[i] =
        AddSplat(target, *tile, { behind, nullptr, nullptr }, { all, 16, 16 }, settings, Nobody);
    }
    CHECK(fragments[0] == TileSize * TileSize);
    CHECK(fragments[1] == (skip ? TileSize * TileSize / 2 : TileSize * TileSize));
    CHECK(fragments[2] == (skip ? 0u : TileSize * TileSize));
    CHECK(tile->Opaque == ~std::uint64_t{ 0 });
    target.CloseAll(*tile, settings, Nobody);
    for (int i = 0; i < BlocksPerTile; ++i)
    {
      const bool covered = i % BlocksPerRow < BlocksPerRow / 2;
      CHECK_NEAR(tile->Finished[i].Red[5], covered ? 0.0 : 1.0, MinTransmittance);
      CHECK_NEAR(tile->Finished[i].Green[5], covered ? 1.0 : 0.0, MinTransmittance);
    }
  }
}

/// What HiddenFrom calls hidden is: whatever comes there, if its z-range is short against the band
/// (HiddenFrom knows no splat's; a longer one keeps more of the open layer to join).
void TestHidden(const RasterTarget& target)
{
  Random random(3);
  int hidden = 0, seen = 0;
  double worst = 0.0;
  for (int i = 0; i < 4000; ++i)
  {
    const bool onLens = i % 2 == 0;
    const RasterSettings settings = onLens ? LensSettings() : Settings;
    const auto tile = EmptyTile();
    Splat s{};
    s.A = s.B = 1e-20f;
    s.Shape = -1.0f;
    float near = 1.0f;
    const PixelBox box{ 0, 0, BlockSize, BlockSize };
    const auto add = [&](float weight, float opacity, float red) {
      s.Weight = weight;
      s.Opacity = opacity;
      s.Red = red;
      s.Near = s.Far = near;
      const LensFootprint footprint =
        WholeLens(static_cast<float>(random.Uniform(-0.5, 0.5)), 0.0f, 0.0f);
      AddSplat(target, *tile, { s, nullptr, onLens ? &footprint : nullptr }, { box, 2, 2 },
        settings, Nobody);
    };
    for (int k = random.Integer(1, 3); k > 0; --k)
    {
      add(static_cast<float>(random.Uniform(0.9, 1.5)), random.Integer(0, 1) == 0 ? 1.0f : 0.9985f,
        0.0f);
      near += random.Integer(0, 1) == 0 ? 0.0f : static_cast<float>(random.Uniform(0.0, 1.0));
    }
    near += static_cast<float>(random.Uniform(0.0, 1.0));
    const bool isHidden = (target.HiddenFrom(*tile, 0, near, settings) & 1) != 0;
    add(1.0f, 1.0f, 1.0f);
    target.CloseAll(*tile, settings, Nobody);
    hidden += isHidden ? 1 : 0;
    seen += isHidden ? 0 : 1;
    worst = isHidden ? std::max<double>(worst, tile->Finished[0].Red[0]) : worst;
  }
  std::printf("%s: behind what hides %.5f is seen at most\n", target.Name, worst);
  CHECK(worst <= MinTransmittance);
  CHECK(hidden > 1000);
  CHECK(seen > 100);
}

/// Random splats, in focus or through the lens.
void TestSplats(const RasterTarget& target, bool onLens, bool opaque)
{
  Random random(8), roundings(9);
  Worst worst;
  const RasterSettings settings = onLens ? LensSettings() : Settings;
  for (int repeat = 0; repeat < 60; ++repeat)
  {
    const auto tile = EmptyTile();
    ScalarTile scalar(TileSize * TileSize, ScalarPixel(onLens ? WithLens : ReferenceLens()));
    LeakSum sum;
    const RasterCallbacks callbacks{ &sum, &LeakSum::Leaked, nullptr };
    long difference = 0, undecided = 0;
    for (PlacedSplat& p : RandomSplats(random, repeat == 0 ? 0 : 1 + repeat % 40))
    {
      p.S.Opacity = opaque ? 1.0f : p.S.Opacity;
      const std::uint64_t fragments = AddSplat(target, *tile,
        { p.S, p.HasGradient ? &p.Gradient : nullptr, onLens ? &p.Footprint : nullptr },
        { p.Span, p.X, p.Y }, settings, callbacks);
      difference += std::abs(
        static_cast<long>(fragments) - static_cast<long>(AddScalar(scalar, p, onLens, roundings)));
    }
    target.CloseAll(*tile, settings, callbacks);
    for (ScalarPixel& p : scalar)
    {
      p.Finish();
      undecided += p.Undecided ? 1 : 0;
    }
    CHECK(difference <= undecided);
    CHECK(undecided <= 10); // of 1024
    CompareTile(*tile, scalar, sum, worst);
  }
  CHECK(worst.Bounded > 0.98 * static_cast<double>(worst.Compared));
  CHECK((worst.Moment > 0.05) == onLens);
  std::printf("%s%s%s: colour off by %.1e at most, %ld of %ld pixels\n", target.Name,
    onLens ? ", lens" : "", opaque ? ", opaque" : "", worst.Color, worst.Bounded, worst.Compared);
}

/// A batch of splats gives the tile that adding them one by one gives.
void TestBatch(const RasterTarget& target, bool onLens)
{
  Random random(10);
  const RasterSettings settings = onLens ? LensSettings() : Settings;
  for (int repeat = 0; repeat < 20; ++repeat)
  {
    const std::vector<PlacedSplat> splats = RandomSplats(random, 1 + 3 * repeat);
    const auto together = EmptyTile(), single = EmptyTile();
    std::vector<BatchItem> batch;
    std::uint64_t fragments = 0;
    for (const PlacedSplat& p : splats)
    {
      batch.push_back({ &p.S, nullptr, p.HasGradient ? &p.Gradient : nullptr,
        onLens ? &p.Footprint : nullptr, { p.Span, p.X, p.Y }, settings.LargestColor });
      fragments += target.AddBatch(*single, &batch.back(), 1, settings, Nobody);
    }
    REQUIRE(batch.size() <= static_cast<std::size_t>(BatchSize));
    const int count = static_cast<int>(batch.size());
    CHECK(target.AddBatch(*together, batch.data(), count, settings, Nobody) == fragments);
    CHECK(std::memcmp(together->Open, single->Open, sizeof(single->Open)) == 0);
    CHECK(std::memcmp(together->Lens, single->Lens, sizeof(single->Lens)) == 0);
    CHECK(std::memcmp(together->Finished, single->Finished, sizeof(single->Finished)) == 0);
    CHECK(together->Tilted == single->Tilted);
  }
}

/// A tent of 4 px cells about (10, 12): weights fall linearly to 0 along x and y.
void TestTent(const RasterTarget& target)
{
  constexpr float x = 10.0f, y = 12.0f, cell = 4.0f;
  Tent tent{};
  tent.InverseCell = 1.0f / cell;
  tent.Weight = 0.75f;
  tent.Opacity = 0.5f;
  tent.Near = 1.0f;
  tent.Far = 3.0f;
  tent.Depth = 2.5f;
  tent.Red = 0.25f;
  const auto tile = EmptyTile();
  const TilePlace place{ { 6, 8, 14, 16 }, x, y };
  CHECK(AddTent(target, *tile, tent, place, Settings) == 64u);
  for (int i = 0; i < TileSize * TileSize; ++i)
  {
    const int column = i % TileSize, row = i / TileSize;
    const OpenLayers& open = tile->Open[row / BlockSize * BlocksPerRow + column / BlockSize];
    const int l = row % BlockSize * BlockSize + column % BlockSize;
    const double acrossX = std::max(0.0, 1.0 - std::abs(column + 0.5 - x) / cell);
    const double acrossY = std::max(0.0, 1.0 - std::abs(row + 0.5 - y) / cell);
    const double weight = 0.75 * acrossX * acrossY;
    CHECK_NEAR(open.Weight[l], weight, 4.0 * Epsilon);
    CHECK_NEAR(open.Opacity[l], 0.5 * weight, 4.0 * Epsilon);
    CHECK_NEAR(open.Red[l], 0.125 * weight, 4.0 * Epsilon);
    CHECK_NEAR(open.Depth[l], 2.5 * weight, 8.0 * Epsilon);
    if (weight > 0.0)
    {
      CHECK_NEAR(open.Far[l], 3.0, 1e-6); // of the first of its layer
    }
    else
    {
      CHECK(std::isnan(open.Far[l])); // NoFar
    }
  }
}

/// Heavy tents count as if they were added in small parts: from f = 1.1 on, f' = ((1.3 - f) /
/// 0.2)^2.
void TestHeavyTents(const RasterTarget& target)
{
  const auto tile = EmptyTile();
  Tent tent{};
  for (const float weight : { 0.25f, 0.75f, 0.5f })
  {
    tent.Weight = weight;
    AddTent(target, *tile, tent, { { 0, 0, 4, 4 }, 0.0f, 0.0f }, Settings);
  }
  CHECK_NEAR(tile->Open[0].Weight[0], 1.3 - 0.2 / (1.0 + 0.4 / 0.2), 1e-6);
}

/// A tent behind a layer that covers one side of the lens: its colour is seen through the other,
/// with its covariances.
void TestTentBehind(const RasterTarget& target)
{
  const RasterSettings settings = LensSettings();
  const auto tile = EmptyTile();
  Splat half{};
  half.A = half.B = 1e-20f;
  half.Weight = half.Opacity = 0.5f;
  half.Opacity = 1.0f;
  half.Near = half.Far = 1.0f;
  half.Green = 1.0f;
  half.Shape = -1.0f;
  const LensFootprint left = WholeLens(-0.4f, 0.1f, 0.0f);
  const PixelBox all{ 0, 0, TileSize, TileSize };
  AddSplat(target, *tile, { half, nullptr, &left }, { all, 16, 16 }, settings, Nobody);
  Tent tent{};
  tent.InverseCell = 1.0f / 64.0f;
  tent.Weight = 0.9f;
  tent.Opacity = 0.8f;
  tent.Near = 9.0f;
  tent.Far = tent.Depth = 9.5f;
  tent.Red = 0.5f;
  tent.PointX = 0.2f;
  tent.PointY = 0.1f;
  tent.RedX = 0.06f;
  tent.RedY = -0.02f;
  tent.XX = 0.2f;
  tent.XY = 0.01f;
  tent.YY = 0.15f;
  AddTent(target, *tile, tent, { all, 16.5f, 16.5f }, settings);
  target.CloseAll(*tile, settings, Nobody);

  ReferenceLayers layers(WithLens);
  ReferenceFragment f;
  f.Near = f.Far = f.Depth = 1.0;
  f.Weight = 0.5;
  f.OnLens = true;
  f.U[0] = left.MeanX;
  f.U[1] = left.MeanY;
  layers.Add(f);
  f.Near = 9.0;
  f.Far = f.Depth = 9.5;
  f.Weight = 0.9;
  f.Opacity = tent.Opacity;
  f.Color[0] = 0.5;
  f.U[0] = tent.PointX;
  f.U[1] = tent.PointY;
  f.IsTent = true;
  f.ColorU[0][0] = tent.RedX;
  f.ColorU[0][1] = tent.RedY;
  f.UU[0][0] = tent.XX;
  f.UU[0][1] = f.UU[1][0] = tent.XY;
  f.UU[1][1] = tent.YY;
  layers.Add(f);
  layers.Finish();
  const int block = 16 / BlockSize * BlocksPerRow + 16 / BlockSize; // pixel (16, 16), its first
  const FinishedLayers& done = tile->Finished[block];
  CHECK_NEAR(done.Red[0], layers.Color[0], 1e-6);
  CHECK_NEAR(done.Transmittance[0], layers.Through, 1e-6);
  // The root in ShortenToLargest is off by up to 2^-14 of the moment, which is less than 0.08.
  CHECK_NEAR(done.ThroughX[0], layers.ThroughU[0], 5e-6);
  CHECK_NEAR(done.ThroughY[0], layers.ThroughU[1], 5e-6);
  CHECK(layers.Color[0] > 1.2 * 0.5 * 0.5 * 0.9 * 0.8); // more than if layers were independent
}

/// Layers of a coarse grid: plain sums, handed over where a gap opens and at the end.
struct Cells
{
  int Count = 0;
  double Weight = 0, Red = 0, FillX = 0, RedX = 0, XX = 0, HalfRange = 0, Depth = 0,
         SquaredDepth = 0, CubedDepth = 0, FourthDepth = 0, OpacityDepth = 0, RedDepth = 0,
         Near = 0;

  static void Closed(
    void* self, const PixelTile& tile, int block, unsigned int lanes, const CellTents& /* tents */)
  {
    auto* cells = static_cast<Cells*>(self);
    if (block == 0 && (lanes & 1) != 0 && tile.Open[0].Weight[0] > 0.0f)
    {
      ++cells->Count;
      cells->Weight += tile.Open[0].Weight[0];
      cells->Red += tile.Open[0].Red[0];
      cells->FillX += tile.Lens[0].FillX[0];
      const CoarseLayers& c = tile.Coarse[0];
      cells->RedX += c.RedX[0];
      cells->XX += c.XX[0];
      cells->HalfRange += c.HalfRange[0];
      cells->Depth += tile.Open[0].Depth[0];
      cells->SquaredDepth += c.SquaredDepth[0];
      cells->CubedDepth += c.CubedDepth[0];
      cells->FourthDepth += c.FourthDepth[0];
      cells->OpacityDepth += c.OpacityDepth[0];
      cells->RedDepth += c.RedDepth[0];
      cells->Near += c.Near[0];
    }
  }
};

void TestCollect(const RasterTarget& target)
{
  RasterSettings settings = LensSettings();
  settings.Pass = RasterPass::Collect;
  const auto tile = EmptyTile();
  Cells cells;
  const RasterCallbacks callbacks{ &cells, nullptr, &Cells::Closed };
  Splat s{};
  s.A = s.B = 1e-20f;
  s.Weight = 0.25f;
  s.Opacity = 0.5f;
  s.Red = 0.75f;
  s.Shape = -1.0f;
  const LensFootprint footprint = WholeLens(0.25f, 0.0f, 0.0f);
  for (const float near : { 1.0f, 1.5f, 4.0f }) // two that overlap, and one behind a gap
  {
    s.Near = near;
    s.Far = near + 0.5f;
    AddSplat(
      target, *tile, { s, nullptr, &footprint }, { { 0, 0, 4, 4 }, 2, 2 }, settings, callbacks);
    CHECK(cells.Count == (near == 4.0f ? 1 : 0)); // not a leak: all of it, where the gap opens
  }
  target.CloseAll(*tile, settings, callbacks);
  CHECK(cells.Count == 2);
  CHECK_NEAR(cells.Weight, 0.75, 1e-7);
  CHECK_NEAR(cells.Red, 3 * 0.25 * 0.5 * 0.75, 1e-7);
  CHECK_NEAR(cells.FillX, 0.75 * 0.25, 1e-7);
  CHECK_NEAR(cells.RedX, 3 * 0.25 * 0.5 * 0.75 * 0.25, 1e-7);
  CHECK_NEAR(cells.XX, 3 * 0.25 * 0.5 * 0.25 * 0.25, 1e-7);
  CHECK_NEAR(cells.HalfRange, 0.75 * 0.25, 1e-7);
  CHECK_NEAR(cells.Near, 1.0 + 4.0, 0.0);
  // Depths 1.25, 1.75 behind 1, and 4.25 behind 4.
  CHECK_NEAR(cells.Depth, 0.25 * (0.25 + 0.75 + 0.25), 1e-6);
  CHECK_NEAR(cells.SquaredDepth, 0.25 * (0.0625 + 0.5625 + 0.0625), 1e-6);
  CHECK_NEAR(cells.CubedDepth, 0.25 * (0.015625 + 0.421875 + 0.015625), 1e-6);
  CHECK_NEAR(cells.FourthDepth, 0.25 * (0.00390625 + 0.31640625 + 0.00390625), 1e-6);
  CHECK_NEAR(cells.OpacityDepth, 0.25 * 0.5 * (0.25 + 0.75 + 0.25), 1e-6);
  CHECK_NEAR(cells.RedDepth, 0.25 * 0.5 * 0.75 * (0.25 + 0.75 + 0.25), 1e-6);
  CHECK(tile->Finished[0].Transmittance[0] == 1.0f); // nothing was composited
  CHECK(tile->Finished[0].Red[0] == 0.0f);
  CHECK(tile->Open[0].Weight[0] == 0.0f);

  // In front of others, layers that nobody would see are left out. A highlight would be seen.
  Cells light;
  const RasterCallbacks toLight{ &light, nullptr, &Cells::Closed };
  const float colors[] = { 0.75f, 100.0f, 0.75f };
  for (int i = 0; i < 3; ++i)
  {
    s.Near = static_cast<float>(1 + 3 * i);
    s.Far = s.Near + 0.5f;
    s.Weight = 1e-5f;
    s.Red = colors[i];
    AddSplat(
      target, *tile, { s, nullptr, &footprint }, { { 0, 0, 4, 4 }, 2, 2 }, settings, toLight);
    CHECK(light.Count == (i == 2 ? 1 : 0));
  }
  target.CloseAll(*tile, settings, toLight);
  CHECK(light.Count == 2); // nothing is behind the last one
}

/// Values that no set-up should send and that must not reach memory outside of the tile.
void TestExtremes(const RasterTarget& target)
{
  const float infinity = std::numeric_limits<float>::infinity();
  const float values[] = { 0.0f, 1e-45f, 1e-20f, 1.0f, 1e20f, 3e38f, infinity, -infinity, NAN };
  const auto tile = EmptyTile();
  const RasterSettings lens = LensSettings();
  for (float a : values)
  {
    for (float k : values)
    {
      for (float x : values)
      {
        Splat s{};
        s.A = a;
        s.B = 1e-3f;
        s.K = k;
        s.Weight = s.Opacity = 1.0f;
        s.Shape = a > 1.0f ? 3.0f : -1.0f;
        const TilePlace place{ { 0, 0, TileSize, TileSize }, x, 1.0f };
        constexpr std::uint64_t all = TileSize * TileSize;
        CHECK(AddSplat(target, *tile, { s, nullptr, nullptr }, place, Settings, Nobody) <= all);
        const LensFootprint footprint{ x, 0.0f, k, a, x, k, 1.0f, 0.6f };
        CHECK(AddSplat(target, *tile, { s, nullptr, &footprint }, place, lens, Nobody) <= all);
      }
    }
  }
}

/// The largest that the set-up sends, and points far off the lens: T stays within [0, 1].
void TestLargest(const RasterTarget& target)
{
  Random random(12);
  const RasterSettings settings = LensSettings();
  const auto tile = EmptyTile();
  float near = 0.5f;
  for (int i = 0; i < 400; ++i)
  {
    Splat s{};
    const float weights[] = { 1e-20f, 1e-7f, 0.5f, 1.0f, 1e6f, 1e12f };
    s.A = s.B = 1e-20f;
    s.Weight = weights[random.Integer(0, 5)];
    s.Opacity = static_cast<float>(random.Integer(0, 4)) * 0.25f;
    s.Red = weights[random.Integer(0, 5)];
    s.Shape = -1.0f;
    near += static_cast<float>(random.Integer(0, 2)) * 0.05f;
    s.Near = near;
    s.Far = near + static_cast<float>(random.Integer(0, 2)) * 0.02f;
    const float reach = random.Integer(0, 3) == 0 ? 1e6f : 1.0f;
    const LensFootprint footprint = WholeLens(reach * static_cast<float>(random.Uniform(-1.0, 1.0)),
      reach * static_cast<float>(random.Uniform(-1.0, 1.0)), 1e18f);
    AddSplat(target, *tile, { s, nullptr, &footprint }, { { 0, 0, TileSize, TileSize }, 16, 16 },
      settings, Nobody);
    for (int l = 0; l < PixelsPerBlock; ++l)
    {
      const FinishedLayers& done = tile->Finished[i % BlocksPerTile];
      CHECK(done.Transmittance[l] >= 0.0f); // not NaN
      CHECK(done.Transmittance[l] <= 1.0f);
      CHECK(std::isfinite(done.Red[l]));
      CHECK(std::hypot(done.ThroughX[l], done.ThroughY[l]) <= 0.26f);
    }
  }
}

/**
 * exp(-x) over [0, 80]. t = -x log2(e) is rounded to within Epsilon |t| and its constant by 1.3e-8:
 * that is 7.3e-8 x of the result; polynomial and its evaluation, 2e-7.
 */
TEST_CASE("Exponential")
{
  double worstNear = 0.0, worst = 0.0;
  constexpr int Steps = 400000;
  for (int i = 0; i <= Steps; ++i)
  {
    const float x = 80.0f * static_cast<float>(i) / Steps;
    alignas(64) float lanes[LaneCount];
    ExpOfMinus(x).Store(lanes);
    const double expected = std::exp(-static_cast<double>(x));
    const double error = std::abs(lanes[i % LaneCount] / expected - 1.0);
    CHECK_NEAR(error, 0.0, 2e-7 + 7.5e-8 * x);
    worst = std::max(worst, error);
    worstNear = x <= 2.5f ? std::max(worstNear, error) : worstNear;
  }
  std::printf("exp(-x): relative error %.1e over [0, 2.5], %.1e over [0, 80]\n", worstNear, worst);
  alignas(64) float one[LaneCount];
  ExpOfMinus(0.0f).Store(one);
  CHECK(one[0] == 1.0f); // a splat's centre has its full weight
}
}

const RasterTarget* const Targets[] = { &RasterTargetBaseline,
#ifdef SURFELSPLATTING_X86_TARGETS
  &RasterTargetAVX2, &RasterTargetAVX512
#endif
};

/// The best that this machine has is what the raster takes.
TEST_CASE("Selection")
{
  const RasterTarget* best = nullptr;
  for (const char* name : { "baseline", "avx2", "avx512" })
  {
    const RasterTarget* target = FindTarget(name, Targets);
    best = target ? target : best;
  }
  CHECK((SelectRasterTarget().AddBatch == best->AddBatch));
}

/// The program's argument is baseline, avx2 or avx512.
TEST_CASE("Raster targets")
{
  if (const RasterTarget* target = TargetUnderTest(Targets))
  {
    for (const bool onLens : { false, true })
    {
      TestSplats(*target, onLens, false);
      TestSplats(*target, onLens, true);
      TestBatch(*target, onLens);
    }
    TestOpaqueBlocks(*target);
    TestHidden(*target);
    TestTent(*target);
    TestHeavyTents(*target);
    TestTentBehind(*target);
    TestCollect(*target);
    TestLargest(*target);
    TestExtremes(*target);
  }
}
