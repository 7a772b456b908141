// SPDX-License-Identifier: BSD-3-Clause
/**
 * What leaks of the A-buffer's layers where gaps open, against the rule in double and against what
 * must not depend on it.
 */
#include "Core/Lens/LayerLeaks.h"
#include "Core/Raster/TileRaster.h"
#include "ReferenceLayers.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"
#include "TileUnderTest.h"
#include "WideSplats.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>

using namespace SurfelSplatting;
using namespace WideSplats;

namespace
{
/// Random streams, with gaps of all sizes, against the rule in double.
TEST_CASE("Leaking streams")
{
  Random random(8);
  double worst = 0.0;
  for (int i = 0; i < 2000; ++i)
  {
    const bool onLens = i % 2 == 0;
    // The focus so far off that the blur is Blur at every depth.
    ReferenceLayers layers(onLens ? ReferenceLens{ Blur, 1e9 } : ReferenceLens{});
    std::vector<Wide> splats;
    float near = 1.0f;
    for (int k = random.Integer(1, 20); k > 0; --k)
    {
      Wide w;
      near += static_cast<float>(random.Uniform(0.0, 1.0) * random.Integer(0, 2));
      w.Near = near;
      w.Far = near + static_cast<float>(random.Uniform(0.05, 0.5));
      const bool light = random.Integer(0, 1) == 0;
      w.Weight = static_cast<float>(light ? random.Uniform(0.0, 0.01) : random.Uniform(0.01, 0.6));
      w.Kernel = static_cast<float>(random.Uniform(0.09, 1.0));
      w.Red = static_cast<float>(random.Uniform(0.0, 1.0));
      w.Opacity = 0.75f; // of mixed ones, see BruteForceSplatter.h
      w.PointX = static_cast<float>(random.Uniform(-0.5, 0.5));
      w.PointY = static_cast<float>(random.Uniform(-0.5, 0.5));
      splats.push_back(w);
      ReferenceFragment f;
      f.Near = w.Near;
      f.Far = w.Far;
      f.Weight = w.Weight;
      f.Kernel = w.Kernel;
      f.Opacity = w.Opacity;
      f.Depth = 0.5 * (f.Near + f.Far);
      f.Color[0] = w.Red;
      f.OnLens = onLens;
      f.U[0] = w.PointX;
      f.U[1] = w.PointY;
      layers.Add(f);
    }
    layers.Finish();
    const Pixel p = Draw(splats, onLens);
    const double off =
      std::max(std::abs(p.Red - layers.Color[0]), std::abs(p.Alpha - (1.0 - layers.Through)));
    worst = std::max(worst, off);
    // Rounding, and on the lens MinTilt.
    CHECK(off < (onLens ? 1.0 / 512.0 : 2e-5));
  }
  std::printf("leaking streams: off by %.1e at most\n", worst);
}

/// A splat that covers two pixels of a block also ends layers of others, if they lie far enough in
/// front of it, and only with ShortCuts. The picture is the same.
TEST_CASE("Layers beside a splat")
{
  const RasterTarget& target = SelectRasterTarget();
  const TilePlace all{ { 0, 0, BlockSize, BlockSize }, 2.0f, 2.0f };
  const TilePlace left{ { 0, 1, 1, 3 }, 0.5f, 2.0f };
  constexpr float range = 0.1f, band = 0.5f * range;
  for (const float bands : { 60.0f, 70.0f })
  {
    std::unique_ptr<PixelTile> tiles[2];
    for (const bool shortCuts : { false, true })
    {
      RasterSettings settings{ 5.0f, 1.0f };
      settings.ShortCuts = shortCuts;
      tiles[shortCuts] = EmptyTile();
      PixelTile& tile = *tiles[shortCuts];
      Splat s = SplatOf({ 1.0f, 1.0f, 0.6f, 0.5f });
      AddSplat(target, tile, { s, nullptr, nullptr }, all, settings, Nobody);
      s.Near = 1.0f + bands * band;
      s.Far = s.Near + range;
      s.A = s.B = 5.0f; // a radius of 1 px
      AddSplat(target, tile, { s, nullptr, nullptr }, left, settings, Nobody);
      const bool ended = shortCuts && bands > 64.0f; // WidestGap
      const float* through = tile.Finished[0].Transmittance;
      CHECK_NEAR(through[LaneOfPixel(0, 1)], 0.4, 1e-6);
      CHECK_NEAR(through[LaneOfPixel(3, 1)], ended ? 0.4 : 1.0, 1e-6);
      CHECK((tile.Open[0].Weight[LaneOfPixel(3, 1)] == 0.0f) == ended);
      s.A = s.B = 1e-30f;
      AddSplat(target, tile, { s, nullptr, nullptr }, all, settings, Nobody);
      target.CloseAll(tile, settings, Nobody);
    }
    CHECK(std::memcmp(tiles[0]->Finished, tiles[1]->Finished, sizeof(tiles[0]->Finished)) == 0);
  }
}

/// A splat of hardly any weight within a gap changes nothing, wherever it is: exp(-gap / band) is
/// additive where the bands are equal, as through a wide lens.
TEST_CASE("Path independence")
{
  double worst[3] = { 0, 0, 0 }; // centred, off centre, and there too full
  for (const bool centred : { true, false })
  {
    for (const float weight : { 0.3f, 0.9f, 1.0f, 1.2f })
    {
      for (const float opacity : { 0.5f, 0.99f, 1.0f })
      {
        for (const float gap : { 0.1f, 0.7f, 2.0f, 5.0f })
        {
          const float x = centred ? 0.0f : 0.3f;
          const Wide a{ 1.0f, 1.0f, weight, 1.0f, opacity, x, 0.0f };
          const Wide b{ 1.0f + gap, 1.0f + gap, 0.8f, 0.25f, 1.0f, -x, 0.1f };
          const Pixel plain = Draw({ a, b }, true);
          std::vector<Wide> all{ a };
          for (int i = 1; i < 4; ++i)
          {
            const float z = 1.0f + 0.25f * static_cast<float>(i) * gap;
            all.push_back({ z, z, 1e-12f, 0.0f, 1.0f, 0.5f, 0.5f });
          }
          all.push_back(b);
          double& largest = worst[centred ? 0 : weight < 1.0f ? 1 : 2];
          largest = std::max(largest, Difference(plain, Draw(all, true)));
        }
      }
    }
  }
  std::printf("splats without weight in gaps change %.1e; off the lens's centre %.1e, %.1e\n",
    worst[0], worst[1], worst[2]);
  CHECK(worst[0] < 2e-6);
  CHECK(worst[1] < 2e-6);
  CHECK(worst[2] < 2e-6);
}

/// Nor does one whose z-range is shorter, so that its band is, or one that would bridge the gap: it
/// leaks over 64 w / LeakingWeight bands at most.
TEST_CASE("Splats without weight")
{
  double worst = 0.0;
  for (const bool onLens : { false, true })
  {
    for (const float weight : { 0.3f, 0.9f, 1.0f, 1.15f })
    {
      const Wide front{ 1.0f, 1.5f, 0.4f, 0.5f, 1.0f, 0.7f, 0.0f };
      const Wide a{ 4.0f, 4.5f, weight, 1.0f, 0.95f, 0.2f, 0.0f };
      const Wide b{ 5.0f, 6.0f, 0.8f, 0.25f, 1.0f, -0.3f, 0.1f };
      const Pixel plain = Draw({ front, a, b }, onLens);
      for (const float near : { 3.5f, 4.75f })
      {
        for (const float length : { 0.001f, 5.0f })
        {
          const Wide without{ near, near + length, 1e-11f, 0.0f, 1.0f, 0.5f, 0.5f };
          worst = std::max(worst, Difference(plain, Draw({ front, a, b, without }, onLens)));
        }
      }
    }
  }
  std::printf("splats without weight of any length change %.1e\n", worst);
  CHECK(worst < 2e-6);
}

/// Behind a light splat its layer has leaked over a share of the gap in the splat's bands, of which
/// 64 count at most. The next splat finds the rest of the gap, less what the light one reaches, in
/// its own bands: the gap that the light one has closed makes the layer no longer.
TEST_CASE("Light splats in gaps")
{
  const Wide a{ 1.0f, 2.0f, 0.5f, 1.0f, 1.0f, 0, 0 };
  for (const float weight : { 5e-5f, 2e-4f, 1e-3f, 4e-3f })
  {
    const double share = 1.0 - std::pow(std::max(0.0, 1.0 - weight / 0.002), 4.0);
    const double reach = std::min(1.0, weight / 0.004);
    for (const float gap : { 0.125f, 0.5f, 2.0f })
    {
      for (const float bands : { 1.0f, 8.0f, 64.0f, 1000.0f })
      {
        const float end = 2.0f + gap, band = gap / bands;
        const Wide light{ end, end + band, weight, 0.0f, 1.0f, 0, 0 };
        const double reached = reach * (band + (1.0 - share) * gap);
        const double rest = std::max(0.0, (1.0 - share) * gap - reached);
        // The layer's length behind its mean depth is 0.5, then what the light one adds.
        const double first = 0.5 * (band + 0.5), second = 0.5 * (1.0 + 0.5 + reached);
        const double leaked = share * std::min(gap / first, 64.0);
        const double alone = 0.5 * (1.0 + 0.5); // the band of the last splat without it
        const auto z = static_cast<float>(2.0 + alone * (leaked + rest / second));
        const Pixel p = Draw({ a, light, { end, end + 1.0f, 0.45f, 0.0f, 1.0f, 0, 0 } }, false);
        const Pixel same = Draw({ a, { z, z + 1.0f, 0.45f, 0.0f, 1.0f, 0, 0 } }, false);
        // What it covers itself, as much again since it moves the layer's mean depth, and what is
        // too light to leak on its own (GapOfLayer).
        const double stays = std::exp(-leaked);
        const double dropped = 0.5 * stays < FullyLeakingWeight ? 0.225 * stays : 0.0;
        CHECK_NEAR(p.Alpha, same.Alpha, 2.0 * weight + dropped + 2e-6);
      }
    }
  }
}

/// Where a layer ends, and its mean depth.
struct End
{
  double Far, Mean;
};

/// Where a splat of length 1 begins that is as many bands behind a layer as one at `near` is behind
/// another.
float NearBehind(const End& layer, const End& other, double near, bool onLens)
{
  const auto band = [&](const End& e) {
    return 0.5 * (1.0 + e.Far - e.Mean) + (onLens ? 0.125 * Blur : 0.0);
  };
  return static_cast<float>(layer.Far + (near - other.Far) * band(layer) / band(other));
}

/// Two halves of a splat take its layer nearly as far as the whole one: what begins behind them
/// finds the same gap.
TEST_CASE("Halves of a splat")
{
  for (const float weight : { 2e-4f, 5e-4f, 1e-3f })
  {
    const Wide a{ 1.0f, 2.0f, 0.5f, 1.0f, 1.0f, 0, 0 };
    const Wide whole{ 1.5f, 4.0f, weight, 1.0f, 1.0f, 0, 0 };
    Wide half = whole;
    half.Weight *= 0.5f;
    const Wide behind{ 4.0f, 5.0f, 0.45f, 0.0f, 1.0f, 0, 0 };
    const Pixel two = Draw({ a, half, half, behind }, false);
    // The end moves by 1 - (1 - x / 2)^2 instead of x, x = w / WeightOfReach, of 2 world units.
    const double x = weight / WeightOfReach, left = 1.0 - 0.5 * x;
    const double mean = (0.5 * 1.5 + weight * 2.75) / (0.5 + weight);
    const float z =
      NearBehind({ 2.0 + 2.0 * x, mean }, { 2.0 + 2.0 * (1.0 - left * left), mean }, 4.0, false);
    const Pixel same = Draw({ a, whole, { z, z + 1.0f, 0.45f, 0.0f, 1.0f, 0, 0 } }, false);
    CHECK_NEAR(two.Alpha, same.Alpha, 1e-5);
  }
}

/// Through a lens, the tail of a kernel, half of KernelOfReach, lengthens a layer half as far as
/// the middle of one does; one that begins a layer as far. In focus all do.
TEST_CASE("Tails in gaps")
{
  for (const bool onLens : { false, true })
  {
    for (const float weight : { 2e-4f, 1e-3f, 2e-3f })
    {
      for (const float cover : { 0.5f * CoverOfReach, CoverOfReach })
      {
        const Wide a{ 1.0f, 2.0f, cover, 1.0f, 1.0f, 0, 0 };
        const Wide middle{ 1.5f, 4.0f, weight, 1.0f, 1.0f, 0, 0 };
        Wide tail = middle;
        tail.Kernel = 0.5f * KernelOfReach;
        const bool shorter = onLens && cover == CoverOfReach;
        const double reach = 2.0 * weight / WeightOfReach;
        const double mean = (cover * 1.5 + weight * 2.75) / (cover + weight);
        const float z = NearBehind(
          { 2.0 + (shorter ? 0.5 : 1.0) * reach, mean }, { 2.0 + reach, mean }, 4.0, onLens);
        const Pixel one = Draw({ a, tail, { z, z + 1.0f, 0.45f, 0.0f, 1.0f, 0, 0 } }, onLens);
        const Pixel same = Draw({ a, middle, { 4.0f, 5.0f, 0.45f, 0.0f, 1.0f, 0, 0 } }, onLens);
        CHECK_NEAR(one.Alpha, same.Alpha, 2e-6);
      }
    }
  }
}

/// The middle of a kernel that is hardly flatter than a bell lengthens a layer by its weight,
/// though its SmoothProfile is small there: such surfaces came apart, and flashed in motion.
TEST_CASE("Middles of kernels")
{
  for (const float weight : { 2e-4f, 1e-3f, 2e-3f })
  {
    const Wide a{ 1.0f, 2.0f, CoverOfReach, 1.0f, 1.0f, 0, 0 };
    const Wide behind{ 4.0f, 5.0f, 0.45f, 0.0f, 1.0f, 0, 0 };
    Wide middle{ 1.5f, 4.0f, weight, 1.0f, 1.0f, 0, 0 };
    const Pixel same = Draw({ a, middle, behind }, true);
    for (const float steepness : { 0.01f, 0.1f, 0.5f, 1.0f, 3.0f })
    {
      middle.Steepness = steepness;
      CHECK_NEAR(Draw({ a, middle, behind }, true).Alpha, same.Alpha, 2e-6);
    }
  }
}

/// Two tents that end at different depths give their layer two ends, in either order.
TEST_CASE("Ends of two tents")
{
  Tent wide{};
  wide.InverseCell = 1.0f / 64.0f;
  wide.Opacity = 1.0f;
  wide.Near = 1.0f;
  wide.Far = wide.Depth = 2.0f;
  Tent narrow = wide;
  narrow.InverseCell = 1.0f / 8.0f;
  narrow.Weight = 0.03f;
  narrow.Far = 4.0f;
  RasterSettings settings{ 9.0f, 1e30f };
  const TilePlace place{ { 0, 0, TileSize, TileSize }, 0.5f, 0.5f };
  for (const bool onLens : { false, true })
  {
    settings.LensRadius = onLens ? Blur : 0.0f;
    settings.SetShape({});
    for (const float cover : { 0.01f, 0.3f, 0.9f })
    {
      wide.Weight = cover;
      for (const bool wideFirst : { false, true })
      {
        const auto tile = EmptyTile();
        AddTent(SelectRasterTarget(), *tile, wideFirst ? wide : narrow, place, settings);
        AddTent(SelectRasterTarget(), *tile, wideFirst ? narrow : wide, place, settings);
        for (int x = 0; x < BlockSize; ++x)
        {
          CHECK_NEAR(tile->Open[0].Far[x], 2.0, 1e-6);
          CHECK_NEAR(tile->Tents[0].Farther[x], 4.0, 1e-6);
          CHECK_NEAR(tile->Tents[0].FartherWeight[x], 0.03 * (1.0 - x / 8.0), 1e-6);
        }
      }
    }
  }
}

/// Of three ends two become one: the mean end stays, and a tent of hardly any weight changes
/// nothing.
TEST_CASE("Ends of many tents")
{
  Random random(5);
  for (int i = 0; i < 1000; ++i)
  {
    LayerEnds<double> ends{ 0, 0, 0 };
    double weight = 0.0, sum = 0.0;
    for (int k = 0; k < 12; ++k)
    {
      const double end = random.Uniform(1.0, 5.0), added = random.Uniform(0.01, 0.3);
      const LayerEnds<double> same = AddEnd(ends, weight, end, 1e-12);
      ends = AddEnd(ends, weight, end, added);
      weight += added;
      sum += added * end;
      CHECK(ends.Far <= ends.Farther);
      CHECK(ends.Weight >= 0.0);
      CHECK(ends.Weight <= weight * (1.0 + 1e-12));
      CHECK_NEAR((weight - ends.Weight) * ends.Far + ends.Weight * ends.Farther, sum, 1e-9);
      if (k > 1)
      {
        const LayerEnds<double> again = AddEnd(same, weight - added, end, added);
        CHECK_NEAR(again.Far, ends.Far, 1e-6);
        CHECK_NEAR(again.Farther, ends.Farther, 1e-6);
        CHECK_NEAR(again.Weight, ends.Weight, 1e-6);
      }
    }
  }
}

/// What shines through two tents, of which the second joins the first to a splat behind both.
double ThroughJoint(float joint)
{
  RasterSettings settings{ 9.0f, 1e30f };
  settings.LensRadius = 0.1f * Blur;
  settings.SetShape({});
  const PixelBox all{ 0, 0, TileSize, TileSize };
  const auto tile = EmptyTile();
  Tent tent{};
  tent.InverseCell = 1.0f / 1024.0f;
  tent.Opacity = 1.0f;
  tent.Weight = 0.3f;
  tent.Near = 1.0f;
  tent.Far = tent.Depth = 2.0f;
  AddTent(SelectRasterTarget(), *tile, tent, { all, 0.5f, 0.5f }, settings);
  if (joint > 0.0f)
  {
    tent.Weight = joint;
    tent.Far = 8.0f;
    AddTent(SelectRasterTarget(), *tile, tent, { all, 0.5f, 0.5f }, settings);
  }
  tent.Weight = 0.3f;
  tent.Near = 7.0f;
  tent.Far = 8.0f;
  AddTent(SelectRasterTarget(), *tile, tent, { all, 0.5f, 0.5f }, settings);
  SelectRasterTarget().CloseAll(*tile, settings, Nobody);
  return tile->Finished[0].Transmittance[0];
}

/// Two layers let the product through, one layer the rest of the sum. From one to the other it goes
/// with the joint's share, without a jump, and is there at ShareOfJoint.
TEST_CASE("Joints fade in")
{
  CHECK_NEAR(ThroughJoint(0.0f), 0.7 * 0.7, 2e-3);
  double last = ThroughJoint(0.0f);
  constexpr float step = 1.0f / 256.0f;
  for (int i = 1; i <= 60; ++i)
  {
    const float joint = step * static_cast<float>(i);
    const double through = ThroughJoint(joint);
    // Over the last LeastGap nothing leaks.
    CHECK(std::abs(through - last) < 4.0 * step);
    const double whole = 1.0 - 0.6 - joint;
    if (joint / (0.3 + joint) > ShareOfJoint + 0.01f)
    {
      CHECK_NEAR(through, whole, 1e-3);
    }
    else
    {
      CHECK(through > whole - 1e-3);
    }
    last = through;
  }
}

/// A wall and half a leaf before it in one layer cover all of the lens, though the wall has room
/// beside the leaf only.
TEST_CASE("A wall behind half a leaf")
{
  const RasterTarget& target = SelectRasterTarget();
  RasterSettings settings{ 9.0f, 1e30f };
  settings.LensRadius = 0.1f * Blur;
  settings.SetShape({});
  const auto tile = EmptyTile();
  const PixelBox all{ 0, 0, TileSize, TileSize };
  Tent tent{};
  tent.InverseCell = 1.0f / 1024.0f;
  tent.Opacity = 1.0f;
  tent.Near = 2.0f;
  tent.Far = tent.Depth = 3.0f;
  tent.Weight = 0.5f;
  tent.PointX = 0.424f; // of half a disc
  tent.XX = 0.07f;
  tent.YY = 0.25f;
  AddTent(target, *tile, tent, { all, 0.5f, 0.5f }, settings);
  tent.Weight = 1.0f;
  tent.PointX = 0.0f;
  tent.XX = 0.25f;
  AddTent(target, *tile, tent, { all, 0.5f, 0.5f }, settings);
  CHECK(tile->Tents[0].Refused[0] > 0.05f);
  target.CloseAll(*tile, settings, Nobody);
  CHECK(tile->Finished[0].Transmittance[0] < 0.02f);
}

/// As a layer becomes heavier, no more than its weight is added: it joins what follows at first,
/// and leaks then.
TEST_CASE("Light layers")
{
  for (const bool onLens : { false, true })
  {
    Pixel last = Draw({ { 4.0f, 5.0f, 0.5f, 0.0f, 1.0f, 0, 0 } }, onLens);
    constexpr float step = 1.0f / 8192.0f;
    for (int i = 1; i < 256; ++i)
    {
      const Wide light{ 1.0f, 2.0f, step * static_cast<float>(i), 1.0f, 1.0f, 0, 0 };
      const Pixel p = Draw({ light, { 4.0f, 5.0f, 0.5f, 0.0f, 1.0f, 0, 0 } }, onLens);
      CHECK(std::abs(p.Alpha - last.Alpha) < 1.5f * step);
      CHECK(std::abs(p.Red - last.Red) < 1.5f * step);
      last = p;
    }
  }
}

/// Tiny steps in depth move the pixel a little, from overlap through a gap that opens to layers far
/// apart.
TEST_CASE("Continuity in the gap")
{
  for (const bool onLens : { false, true })
  {
    for (const float weight : { 0.3f, 0.9f, 1.15f })
    {
      for (const float opacity : { 0.5f, 0.9f })
      {
        constexpr int Steps = 3000;
        double largest = 0.0, across = 0.0;
        const double step = 12.0 / Steps; // bands
        Pixel last{};
        for (int i = -100; i < Steps; ++i)
        {
          const auto gap = static_cast<float>(step * i);
          const Wide a{ 1.0f, 2.0f, weight, 1.0f, opacity, 0.2f, 0.0f };
          const Wide b{ 2.0f + gap, 3.0f + gap, 0.9f, 0.0f, 1.0f, -0.1f, 0.2f };
          const Pixel p = Draw({ a, b }, onLens);
          largest = i > -100 ? std::max(largest, Difference(p, last)) : 0.0;
          across = std::max(across, std::abs(p.Red - (i > -100 ? last.Red : p.Red)));
          last = p;
        }
        const Wide a{ 1.0f, 2.0f, weight, 1.0f, opacity, 0.2f, 0.0f };
        const Pixel touching = Draw({ a, { 2.0f, 3.0f, 0.9f, 0.0f, 1.0f, -0.1f, 0.2f } }, onLens);
        const Pixel apart = Draw({ a, { 2.000001f, 3.0f, 0.9f, 0.0f, 1.0f, -0.1f, 0.2f } }, onLens);
        // T' / T = (1 - a) / (1 - d a) falls with d by a / (1 - a) at most: 9 at alpha = 0.9.
        // LargestGap ends what is left of a layer, less than 1/1024 of it.
        CHECK(largest < 10.0 * step);
        CHECK(Difference(touching, apart) < 2e-5);
      }
    }
  }
}

/// The one jump: of an opaque layer nothing stays, and a splat that touches it still joins, as long
/// as there is room. With a weight of 1 in both, half of the pixel; full layers (ripple's
/// compensation makes most of them) have none.
TEST_CASE("Jump behind opaque layers")
{
  for (const bool onLens : { false, true })
  {
    for (const float weight : { 0.99f, 1.0f, 1.05f, 1.1f, 1.2f, 1.3f })
    {
      const Wide a{ 1.0f, 2.0f, weight, 1.0f, 1.0f, 0, 0 };
      const Pixel touching = Draw({ a, { 2.0f, 3.0f, 1.0f, 0.0f, 1.0f, 0, 0 } }, onLens);
      const Pixel apart = Draw({ a, { 2.000001f, 3.0f, 1.0f, 0.0f, 1.0f, 0, 0 } }, onLens);
      const double jump = Difference(touching, apart);
      std::printf("opaque, weight %.2f%s: %.4f\n", weight, onLens ? ", lens" : "", jump);
      CHECK(jump <= 0.5 + 1e-6);
      if (weight < 1.0f)
      {
        CHECK(jump < 1e-3); // all of it within 0.01 bands
      }
      if (weight >= (onLens ? 1.2f : 1.1f))
      {
        CHECK(jump < 1e-6);
      }
    }
  }
}

/// Nothing else comes: a layer that leaks in many bits gives what it gives at once. Of one that
/// covers all, exp(-4 gap / band) is open for what is behind a gap.
TEST_CASE("Opaque and alone")
{
  for (const bool onLens : { false, true })
  {
    for (const float weight : { 0.3f, 1.0f, 1.2f })
    {
      for (const float opacity : { 0.3f, 0.95f, 1.0f })
      {
        const Wide a{ 1.0f, 1.5f, weight, 0.75f, opacity, 0, 0 };
        std::vector<Wide> bits{ a };
        for (int i = 1; i < 30; ++i)
        {
          const float z = 1.5f + 0.11f * static_cast<float>(i);
          bits.push_back({ z, z + 0.05f, 1e-12f, 0.0f, 1.0f, 0, 0 });
        }
        CHECK(Difference(Draw(bits, onLens), Draw({ a }, onLens)) < 2e-6);
        if (weight >= 1.0f && opacity == 1.0f)
        {
          for (const float gap : { 1e-5f, 0.01f, 0.3f, 3.0f, 9.0f })
          {
            const Wide behind{ 1.5f + gap, 1.6f + gap, 0.1f, 0.0f, 1.0f, 0, 0 };
            const Pixel p = Draw({ a, behind }, onLens);
            // The means of z-range and layer: 0.1, and 0.25 behind its mean depth.
            const double bands = gap / (0.5 * (0.1 + 0.25) + (onLens ? 0.125 * Blur : 0.0));
            const double leaked = bands > 1.0 / 32.0 ? bands : 0.0; // nothing leaks over less
            CHECK(p.Red <= 0.75 + 1e-6);
            CHECK(p.Red >= 0.75 * (1.0 - std::exp(-4.0 * leaked) * 0.1 / (weight + 0.1)) - 1e-6);
            CHECK_NEAR(p.Alpha, 1.0, 1e-6);
          }
        }
      }
    }
  }
}

/// The doubt about what is seen of a pixel's layers through the lens
/// (Core/Picture/DoubtfulTiles.h).
double DoubtOf(const std::vector<Wide>& splats)
{
  SplatList list;
  TileBins bins;
  FillList(splats, true, list, bins);
  Picture picture(Size, Size);
  TileRaster raster;
  RasterSettings settings{ 5.0f, 1.0f };
  settings.LensRadius = 0.1f * Blur;
  settings.Doubts = true;
  raster.Set(settings, nullptr, nullptr, false);
  return raster.Render(list, bins, 0, picture.Get()).Doubt;
}

/// Two layers that cover half of the lens each may hide one another or lie side by side. Whether
/// the first one has leaked in parts adds hardly any doubt, and takes none away.
TEST_CASE("Doubt about layers that leak in parts")
{
  const Wide a{ 1.0f, 1.5f, 0.5f, 1.0f, 1.0f, 0, 0 }, b{ 4.0f, 4.5f, 0.5f, 0.0f, 1.0f, 0, 0 };
  const Wide c{ 8.0f, 8.5f, 1.2f, 1.0f, 1.0f, 0, 0 };
  const double doubt = DoubtOf({ a, b, c });
  CHECK_NEAR(doubt, 0.5, 0.03); // the interval is (0, 0.5), the contrast 1
  for (const int count : { 1, 3, 10 })
  {
    std::vector<Wide> parts{ a, b, c };
    for (int i = 0; i < count; ++i)
    {
      const float z = 1.6f + 0.2f * static_cast<float>(i);
      parts.push_back({ z, z + 0.01f, 1e-4f / static_cast<float>(count), 1.0f, 1.0f, 0, 0 });
    }
    CHECK_NEAR(DoubtOf(parts), doubt, 0.2 * doubt); // counted as other layers: 0.3 too much
  }
}
}
