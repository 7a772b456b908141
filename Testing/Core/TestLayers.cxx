// SPDX-License-Identifier: BSD-3-Clause
/**
 * Layers of the A-buffer: unions of overlapping z-ranges; what leaks of them where a gap opens, and
 * what has room in them.
 */
#include "Core/Lens/LensVisibility.h"
#include "Core/Raster/TileRaster.h"
#include "ReferenceLayers.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"
#include "WholeLens.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

using namespace SurfelSplatting;

namespace
{
constexpr int Size = 16; // px of the frames here

/// What pixels get, as it comes.
class RecordingSink : public LayerSink
{
public:
  RecordingSink(int width, int height)
    : Width(width)
    , Parts(static_cast<std::size_t>(width) * height)
  {
  }
  void Receive(int x, int y, const VisibleLayer& layer) override
  {
    this->Parts[static_cast<std::size_t>(y) * this->Width + x].push_back(layer);
  }

  int Width;
  std::vector<std::vector<VisibleLayer>> Parts;
};

/// A splat so wide that it has its full weight all over a small frame, at one point of the lens.
struct Wide
{
  float Near = 0, Far = 0, Weight = 0, Red = 0, Opacity = 1;
  float PointX = 0, PointY = 0;
};

Splat SplatOf(const Wide& w)
{
  Splat s{};
  s.X = s.Y = 8.0f;
  s.Shape = -1.0f;
  s.A = s.B = 1e-30f;
  s.Weight = w.Weight;
  s.Near = w.Near;
  s.Far = w.Far;
  s.Gradient = NoGradient;
  s.Red = w.Red;
  s.Opacity = w.Opacity;
  return s;
}

void FillList(const std::vector<Wide>& splats, bool onLens, SplatList& list, TileBins& bins)
{
  list.Clear(onLens);
  for (const Wide& w : splats)
  {
    list.Add(SplatOf(w), { 0, 0, Size, Size });
    if (onLens)
    {
      list.Footprints[list.Splats.Size() - 1] = WholeLens(w.PointX, w.PointY, 0.0f);
    }
  }
  BinSplats(list, 0, { Size, Size }, SerialExecutor(), bins);
  SortBins(list, SerialExecutor(), bins);
}

struct Pixel
{
  double Red, Alpha, Depth;
};

/// Radius of the blur for splats on the lens, the same at every depth: the focus is at infinity.
constexpr float Blur = 1.0f;

/// The picture of a stream, in focus or on the lens. All its pixels are equal, and what the sink
/// got adds up to them.
Pixel Draw(const std::vector<Wide>& splats, bool onLens)
{
  SplatList list;
  TileBins bins;
  FillList(splats, onLens, list, bins);
  RecordingSink sink(Size, Size);
  Picture picture(Size, Size);
  TileRaster raster;
  RasterSettings settings{ 5.0f, 1.0f };
  settings.LensRadius = onLens ? Blur : 0.0f;
  raster.Set(settings, nullptr, &sink, false);
  raster.Render(list, bins, 0, picture.Get());
  for (int i = 0; i < Size * Size; ++i)
  {
    CHECK(picture.Color[4 * i] == picture.Color[0]);
    CHECK(picture.Color[4 * i + 3] == picture.Color[3]);
  }
  double red = 0.0, alpha = 0.0;
  for (const VisibleLayer& part : sink.Parts[0])
  {
    red += part.Red;
    alpha += part.Alpha;
    CHECK(part.Alpha > 0.0f);
    CHECK(part.Coverage >= 0.0f);
    CHECK(part.Coverage <= 1.0f);
  }
  CHECK_NEAR(red, picture.Color[0], 1e-6);
  CHECK_NEAR(alpha, picture.Color[3], 1e-6);
  return { picture.Color[0], picture.Color[3], picture.Depth[0] };
}

double Difference(const Pixel& a, const Pixel& b)
{
  return std::max(std::abs(a.Red - b.Red), std::abs(a.Alpha - b.Alpha));
}

/// A layer of a coarse grid.
struct CellLayer
{
  float Near, Weight, Red, Depth; ///< the last three are sums
  double HalfRange = 0.0, SquaredDepth = 0.0;
};

bool Same(const CellLayer& a, const CellLayer& b)
{
  return a.Near == b.Near && a.Weight == b.Weight && a.Red == b.Red && a.Depth == b.Depth;
}

/// The layers of splats that come by near depth, in double.
/// @param close whether rounding may decide where a layer ends
std::vector<CellLayer> LayersInOrder(std::vector<Wide> splats, bool& close)
{
  std::stable_sort(
    splats.begin(), splats.end(), [](const Wide& a, const Wide& b) { return a.Near < b.Near; });
  std::vector<CellLayer> layers;
  close = false;
  for (const Wide& w : splats)
  {
    bool begins = layers.empty();
    if (!begins)
    {
      const CellLayer& last = layers.back();
      const double mean = last.Depth / last.Weight;
      const double deviation =
        std::sqrt(std::max(last.SquaredDepth / last.Weight - mean * mean, 0.0));
      const double gap = w.Near - mean - last.HalfRange / last.Weight - 2.75 * deviation;
      close |= std::abs(gap) < 1e-4 && deviation > 1e-6;
      begins = gap > 1e-9;
    }
    if (begins)
    {
      layers.push_back({ w.Near, 0.0f, 0.0f, 0.0f });
    }
    CellLayer& open = layers.back();
    const float z = 0.5f * (w.Near + w.Far);
    open.Weight += w.Weight;
    open.Red += w.Weight * w.Red;
    open.Depth += w.Weight * z;
    open.HalfRange += w.Weight * 0.5 * (w.Far - w.Near);
    open.SquaredDepth += static_cast<double>(w.Weight) * z * z;
  }
  return layers;
}

/// Layers of a coarse grid, which are handed over whole.
class RecordingCells : public CellSink
{
public:
  std::vector<CellLayer> Layers[Size * Size];

  void Receive(int x, int y, const PixelTile& tile, int block, int l) override
  {
    const OpenLayers& open = tile.Open[block];
    this->Layers[y * Size + x].push_back(
      { tile.Coarse[block].Near[l], open.Weight[l], open.Red[l], open.Depth[l] });
  }

  /// @return the layers of a stream, for each pixel
  explicit RecordingCells(const std::vector<Wide>& splats)
  {
    SplatList list;
    TileBins bins;
    FillList(splats, false, list, bins);
    Picture picture(Size, Size);
    TileRaster raster;
    raster.SetCoarse({ 5.0f, 1.0f }, *this);
    raster.Render(list, bins, 0, picture.Get());
  }
};

/// The stream with one open layer per pixel, on z-ranges of few bits: ends that touch exactly,
/// equal ranges, ranges within ranges. Weights sum to less than what has room, and float sums are
/// exact.
/// @return whether it was compared
bool TestStream(Random& random)
{
  std::vector<Wide> splats;
  const int count = random.Integer(0, 30);
  for (int i = 0; i < count; ++i)
  {
    Wide w;
    w.Near = static_cast<float>(random.Integer(-40, 40));
    w.Far = w.Near + static_cast<float>(random.Integer(0, 6) * random.Integer(0, 1));
    // exp(-0) is 1 in the raster too: weights are exact.
    w.Weight = static_cast<float>(random.Integer(1, 8)) / 256.0f;
    w.Red = 0.5f;
    splats.push_back(w);
  }
  bool close = false;
  const std::vector<CellLayer> expected = LayersInOrder(splats, close);
  if (close)
  {
    return false;
  }
  for (const std::vector<CellLayer>& pixel : RecordingCells(splats).Layers)
  {
    CHECK(pixel.size() == expected.size());
    CHECK(std::equal(pixel.begin(), pixel.end(), expected.begin(), expected.end(), Same));
  }
  return true;
}

TEST_CASE("Streams of splats")
{
  Random random(7);
  int compared = 0;
  for (int i = 0; i < 300; ++i)
  {
    compared += TestStream(random) ? 1 : 0;
  }
  CHECK(compared > 250);
}

/// A splat of hardly any weight does not join two surfaces of a cell, however long it is.
TEST_CASE("Bridge")
{
  const Wide front{ 1.0f, 1.25f, 0.5f, 0.5f }, back{ 4.0f, 4.25f, 0.5f, 0.5f };
  const Wide bridge{ 1.125f, 5.0f, 1.0f / 256.0f, 0.5f };
  for (const std::vector<CellLayer>& pixel : RecordingCells({ front, bridge, back }).Layers)
  {
    REQUIRE(pixel.size() == 2);
    CHECK(pixel[1].Near == 4.0f);
  }
}

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
      w.Red = static_cast<float>(random.Uniform(0.0, 1.0));
      w.Opacity = 0.75f; // of mixed ones, see BruteForceSplatter.h
      w.PointX = static_cast<float>(random.Uniform(-0.5, 0.5));
      w.PointY = static_cast<float>(random.Uniform(-0.5, 0.5));
      splats.push_back(w);
      ReferenceFragment f;
      f.Near = w.Near;
      f.Far = w.Far;
      f.Weight = w.Weight;
      f.Reach = std::min(1.0, w.Weight / 0.0015); // the kernel's peak is over all of the tile
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
/// 64 count at most. The next splat finds the rest of the gap, less what the light one reaches.
TEST_CASE("Light splats in gaps")
{
  const Wide a{ 1.0f, 2.0f, 0.5f, 1.0f, 1.0f, 0, 0 };
  for (const float weight : { 5e-5f, 2e-4f, 1e-3f, 4e-3f })
  {
    const double share = 1.0 - std::pow(std::max(0.0, 1.0 - weight / 0.002), 4.0);
    const double reach = std::min(1.0, weight / 0.0015);
    for (const float gap : { 0.125f, 0.5f, 2.0f })
    {
      for (const float bands : { 1.0f, 8.0f, 64.0f, 1000.0f })
      {
        const float end = 2.0f + gap, band = gap / bands;
        const Wide light{ end, end + band, weight, 0.0f, 1.0f, 0, 0 };
        const double rest = std::max(0.0, (1.0 - share) * gap - reach * band);
        const double all = share * std::min(bands, 64.0f) + rest;
        const auto z = static_cast<float>(2.0 + all);
        const Pixel p = Draw({ a, light, { end, end + 1.0f, 0.45f, 0.0f, 1.0f, 0, 0 } }, false);
        const Pixel same = Draw({ a, { z, z + 1.0f, 0.45f, 0.0f, 1.0f, 0, 0 } }, false);
        // What it covers itself, and what one leak over 7 bands or more drops, of two not all.
        const double dropped = all > 7.0 ? 0.225 * std::exp(-7.0) : 0.0;
        CHECK_NEAR(p.Alpha, same.Alpha, weight + dropped + 2e-6);
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

/// Tiny steps of a weight move the pixel a little.
TEST_CASE("Continuity in the weight")
{
  for (const bool onLens : { false, true })
  {
    constexpr int Steps = 1500;
    double largest = 0.0;
    Pixel last{};
    for (int i = 0; i <= Steps; ++i)
    {
      const float weight = 1.5f * static_cast<float>(i) / Steps;
      const Pixel p = Draw({ { 1.0f, 2.0f, 0.5f, 1.0f, 0.9f, 0.2f, 0.0f },
                             { 1.5f, 2.5f, weight, 0.5f, 0.9f, 0.1f, 0.1f },
                             { 2.0f, 3.0f, 0.4f, 0.0f, 0.8f, 0.3f, -0.2f },
                             { 4.0f, 5.0f, 0.7f, 1.0f, 1.0f, -0.2f, 0.0f } },
        onLens);
      largest = i > 0 ? std::max(largest, Difference(p, last)) : 0.0;
      last = p;
    }
    // What has room falls from all to nothing over FullKnee of the weight: by 10 times the step, of
    // a splat of 0.4.
    std::printf(
      "weight%s: %.1f of a step at most\n", onLens ? ", lens" : "", largest * Steps / 1.5);
    CHECK(largest < 5.0 * 1.5 / Steps);
  }
}

/// Far apart, layers are composited as they are: min(1, sum w) of mean opacity and colour, over
/// what is behind.
TEST_CASE("Far apart")
{
  for (const bool onLens : { false, true })
  {
    for (const float weight : { 0.25f, 0.8f, 1.25f })
    {
      const Wide a{ 1.0f, 1.5f, weight, 1.0f, 0.6f, 0, 0 };
      const Wide b{ 100.0f, 101.0f, 0.5f, 0.25f, 0.8f, 0, 0 };
      const double alpha = std::min(1.0, static_cast<double>(weight)) * 0.6;
      const Pixel p = Draw({ a, b }, onLens);
      CHECK_NEAR(p.Red, alpha + (1.0 - alpha) * 0.5 * 0.8 * 0.25, 1e-6);
      CHECK_NEAR(p.Alpha, 1.0 - (1.0 - alpha) * (1.0 - 0.4), 1e-6);
      CHECK_NEAR(p.Depth, alpha > 0.5 ? 1.25 : p.Alpha > 0.5 ? 100.5 : 0.0, 1e-4);
    }
  }
}

/// A full layer takes nothing more, and what comes to one with little room adds little.
TEST_CASE("Full layers")
{
  for (const bool onLens : { false, true })
  {
    const float full = onLens ? 1.2f : 1.1f;
    const Wide more{ 1.5f, 2.5f, 1.0f, 0.0f, 1.0f, 0, 0 };
    const Wide first{ 1.0f, 2.0f, full, 1.0f, 1.0f, 0, 0 };
    CHECK(Difference(Draw({ first, more }, onLens), Draw({ first }, onLens)) == 0.0);
    Wide nearly = first;
    nearly.Weight = full - 0.01f; // a tenth of it counts
    const Pixel p = Draw({ nearly, more }, onLens);
    CHECK_NEAR(p.Red, nearly.Weight / (nearly.Weight + 0.1), 1e-5);
    nearly.Weight = full - 0.11f; // all of it
    const Pixel q = Draw({ nearly, more }, onLens);
    CHECK_NEAR(q.Red, nearly.Weight / (nearly.Weight + 1.0), 1e-6);
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
            const double bands = gap / (0.1 + (onLens ? Blur : 0.0));
            const double leaked = bands > 1.0 / 64.0 ? bands : 0.0; // nothing leaks over less
            CHECK(p.Red <= 0.75 + 1e-6);
            CHECK(p.Red >= 0.75 * (1.0 - std::exp(-4.0 * leaked) * 0.1 / (weight + 0.1)) - 1e-6);
            CHECK_NEAR(p.Alpha, 1.0, 1e-6);
          }
        }
      }
    }
  }
}

TestCloud RandomCloud()
{
  Random random(6);
  TestCloud cloud;
  for (int i = 0; i < 250; ++i)
  {
    TestSurfel s;
    const double z = random.Uniform(1.0, 4.0);
    s.Position = { random.Uniform(-0.6, 0.6) * z, random.Uniform(-0.6, 0.6) * z, z };
    s.Normal = random.Direction();
    s.SigmaU = random.Uniform(0.02, 0.2);
    s.SigmaV = random.Uniform(0.02, 0.2);
    s.Area = 4.0 * s.SigmaU * s.SigmaV;
    s.Opacity = static_cast<float>(random.Uniform(0.2, 1.0));
    s.TwoSided = true;
    cloud.Add(s);
  }
  return cloud;
}

TEST_CASE("Scene")
{
  constexpr int Width = 40, Height = 36;
  const TestCloud cloud = RandomCloud();
  const std::vector<SurfelCloud> clouds{ cloud.Get() };
  SplatContext context = TestContext();
  context.Camera = PinholeView(Width, Height, 40.0);
  context.Optics = { 0.05, 2.0 };
  for (const bool coarseGrids : { false, true })
  {
    context.CoarseGrids = coarseGrids;
    RecordingSink sink(Width, Height);
    const Picture picture = RenderPicture(context, clouds, SerialExecutor(), nullptr, &sink);
    int several = 0;
    for (std::size_t i = 0; i < sink.Parts.size(); ++i)
    {
      several += sink.Parts[i].size() > 1 ? 1 : 0;
      double red = 0.0, alpha = 0.0, before = 0.0;
      for (const VisibleLayer& part : sink.Parts[i])
      {
        red += part.Red;
        alpha += part.Alpha;
        before = part.Depth;
        CHECK(part.Depth > 0.0f);
      }
      // The frame is made of what the sink received: four roundings for each of a few parts.
      CHECK_NEAR(picture.Color[4 * i], red, 2e-6);
      CHECK_NEAR(picture.Color[4 * i + 3], alpha, 2e-6);
      CHECK((alpha == 0.0) == (before == 0.0));
    }
    CHECK(several > Width * Height / 10);
  }
}

/// The z-buffer for comparison: of opaque surfaces in focus, the A-buffer's picture.
TEST_CASE("Depth buffered")
{
  SplatContext context = TestContext();
  context.Camera = PinholeView(128, 128, 150.0);
  TestCloud cloud;
  Random random(4);
  for (int i = 0; i < 40000; ++i)
  {
    TestSurfel s;
    const bool ball = i % 2 == 0;
    s.Normal = random.Direction();
    s.Position = { 0.5 * s.Normal[0], 0.5 * s.Normal[1], 2.0 + 0.5 * s.Normal[2] };
    s.Area = 4.0 * Pi * 0.25 / 20000;
    if (!ball) // a wall that the ball sticks in, slanted
    {
      s.Normal = { 0.6, 0.0, -0.8 };
      const double across = random.Uniform(-1.5, 1.5);
      s.Position = { 0.8 * across, random.Uniform(-1.5, 1.5), 2.2 + 0.6 * across };
      s.Area = 9.0 / 20000;
    }
    s.SigmaU = s.SigmaV = 0.6 * std::sqrt(s.Area);
    s.Color = { static_cast<float>(ball), static_cast<float>(0.5 + 0.5 * s.Position[0]), 0, 1 };
    cloud.Add(s);
  }
  const Picture layers = RenderPicture(context, cloud);
  context.DepthBuffered = true;
  const Picture nearest = RenderPicture(context, cloud);
  int off = 0;
  for (std::size_t i = 0; i < layers.Color.size(); i += 4)
  {
    off += std::abs(layers.Color[i] - nearest.Color[i]) > 0.1f ? 1 : 0;
  }
  CHECK(off < 128 * 128 / 40); // silhouettes, where nothing is behind the nearest layer
  std::printf("z-buffer: %d of %d pixels off\n", off, 128 * 128);
}
}
