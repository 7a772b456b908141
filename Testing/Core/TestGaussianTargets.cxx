// SPDX-License-Identifier: BSD-3-Clause
/**
 * What RasterTarget does with Gaussians in space, of every instruction set that this machine has,
 * against the same in double, a pixel at a time (GaussianPixel.h).
 */
#include "Core/Lens/GaussianFootprint.h"
#include "Core/Lens/Lens.h"
#include "Core/Lens/LensVisibility.h"
#include "Core/Raster/RasterTarget.h"
#include "GaussianPixel.h"
#include "TargetUnderTest.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"
#include "WholeLens.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>

using namespace SurfelSplatting;

namespace
{
constexpr RasterCallbacks Nobody{ nullptr, nullptr, nullptr };
constexpr int Pixels = TileSize * TileSize;

int BlockOf(int pixel)
{
  return pixel / TileSize / BlockSize * BlocksPerRow + pixel % TileSize / BlockSize;
}

int LaneOf(int pixel)
{
  return pixel / TileSize % BlockSize * BlockSize + pixel % TileSize % BlockSize;
}

std::unique_ptr<PixelTile> EmptyTile()
{
  auto tile = std::make_unique<PixelTile>();
  *tile = PixelTile{};
  constexpr float infinity = std::numeric_limits<float>::infinity();
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    std::fill_n(tile->Open[i].Far, PixelsPerBlock, -infinity);
    std::fill_n(tile->Finished[i].OccluderDepth, PixelsPerBlock, infinity);
    std::fill_n(tile->Finished[i].Transmittance, PixelsPerBlock, 1.0f);
  }
  return tile;
}

PlacedGaussian RandomGaussian(Random& random, bool onLens)
{
  PlacedGaussian g;
  const double wide = std::pow(10.0, random.Uniform(0.0, 1.5)), flat = random.Uniform(0.05, 1.0);
  g.S.A = static_cast<float>(1.0 / (wide * wide * flat));
  g.S.B = static_cast<float>(1.0 / (wide * wide));
  g.S.K = static_cast<float>(random.Uniform(-1.0, 1.0));
  g.S.Weight = static_cast<float>(random.Uniform(0.05, 1.3));
  const int kind = random.Integer(0, 4);
  const double shapes[] = { -1.0, -random(), random(), 2.2 + random(), 3.0 + 3.0 * random() };
  g.S.Shape = static_cast<float>(shapes[kind]);
  g.S.DepthX = static_cast<float>(kind < 2 ? random.Uniform(9.0, 20.0) : random.Uniform(4.0, 8.0));
  g.S.Opacity = static_cast<float>(std::clamp(random.Uniform(-1.0, 2.0), 0.0, 1.0));
  g.S.Red = static_cast<float>(random());
  g.S.Gradient = InSpace;
  g.X = static_cast<float>(random.Uniform(-10.0, 42.0));
  g.Y = static_cast<float>(random.Uniform(-10.0, 42.0));
  // C^2 / 4 is no more than the smaller variance.
  const double least = 0.5 / std::sqrt((g.S.A * (1.0 + g.S.K * g.S.K) + g.S.B) * Ellipse.Largest());
  g.Footprint.Opacity = static_cast<float>(random());
  g.Footprint.RedX = onLens ? static_cast<float>(random.Uniform(-0.02, 0.02)) : 0.0f;
  g.Footprint.RedY = onLens ? static_cast<float>(random.Uniform(-0.02, 0.02)) : 0.0f;
  g.Footprint.Quarter = onLens ? static_cast<float>(random.Uniform(-least, least)) : 0.0f;
  return g;
}

/// A tile in double, and the same with other roundings: what these do to a pixel cannot be told
/// beforehand.
struct ScalarTile
{
  static constexpr int Copies = 6;
  std::vector<std::array<Pixel, Copies + 1>> All;
  std::vector<bool> Undecided;
  bool Tilted[BlocksPerTile] = {};

  ScalarTile()
    : All(Pixels)
    , Undecided(Pixels)
  {
  }

  /// @param line T is taken for linear
  void Add(const PlacedGaussian& g, bool onLens, bool line, Random& roundings)
  {
    bool touched[BlocksPerTile] = {}, becomes[BlocksPerTile] = {};
    const auto radius = [&](double dx, double dy) {
      const double u = dx + g.S.K * dy;
      return g.S.A * u * u + g.S.B * dy * dy;
    };
    const auto forPixels = [&](const auto& function) {
      for (int k = 0; k < Pixels; ++k)
      {
        const double dx = k % TileSize + 0.5 - g.X, dy = k / TileSize + 0.5 - g.Y;
        function(k, BlockOf(k), dx, dy, radius(dx, dy) < g.S.DepthX);
      }
    };
    forPixels([&](int k, int block, double dx, double dy, bool inside) {
      const double end = Kernel(g.S.Shape, g.S.DepthX, g.S.DepthX);
      const bool isNear = std::abs(radius(dx, dy) - g.S.DepthX) < 1e-4;
      this->Undecided[k] = this->Undecided[k] || (isNear && end > 1e-7);
      touched[block] |= inside;
    });
    const auto by = [&](int block) {
      return line ? SeenBy::Line : this->Tilted[block] ? SeenBy::Moments : SeenBy::Mean;
    };
    forPixels([&](int k, int block, double dx, double dy, bool inside) {
      for (int c = 0; touched[block] && c <= Copies; ++c)
      {
        const Nudge nudge{ c > 0 ? &roundings : nullptr };
        Pixel& p = this->All[k][c];
        if (inside)
        {
          const double squared = AddTo(p, g, dx, dy, by(block), nudge);
          becomes[block] |= c == 0 && onLens && 4.0 * std::sqrt(squared) > 1.0 / 512.0;
        }
        else if (!line)
        {
          LimitMoments(p, nudge);
        }
      }
    });
    for (int b = 0; b < BlocksPerTile; ++b)
    {
      this->Tilted[b] = this->Tilted[b] || becomes[b];
    }
  }

  /// Four times the largest of six draws, and the sums' own.
  double Bound(int k) const
  {
    double spread = 0.0;
    for (const Pixel& moved : this->All[k])
    {
      spread = std::max({ spread, std::abs(moved.Through - this->All[k][0].Through),
        std::abs(moved.Red - this->All[k][0].Red) });
    }
    return 4.0 * spread + 1e-6;
  }
};

struct Worst
{
  double Through = 0.0, Moment = 0.0;
  long Bounded = 0, Compared = 0;
};

void Compare(const PixelTile& tile, const ScalarTile& scalar, Worst& worst)
{
  for (int k = 0; k < Pixels; ++k)
  {
    const FinishedLayers& done = tile.Finished[BlockOf(k)];
    const int l = LaneOf(k);
    const Pixel& p = scalar.All[k][0];
    const double bound = scalar.Bound(k);
    CHECK(done.Transmittance[l] >= 0.0f);
    CHECK(done.Transmittance[l] <= 1.0f);
    ++worst.Compared;
    if (!scalar.Undecided[k] && bound < 1e-3)
    {
      ++worst.Bounded;
      CHECK_NEAR(done.Transmittance[l], p.Through, bound);
      CHECK_NEAR(done.Red[l], p.Red, bound);
      worst.Through = std::max(worst.Through, std::abs(done.Transmittance[l] - p.Through));
      worst.Moment = std::max<double>(worst.Moment, std::hypot(done.ThroughX[l], done.ThroughY[l]));
    }
  }
}

/// Checks the blocks that are marked as dark. @return their number
long CheckDark(const PixelTile& tile)
{
  long dark = 0;
  for (int b = 0; b < BlocksPerTile; ++b)
  {
    const float* through = tile.Finished[b].Transmittance;
    const bool isMarked = (tile.Dark >> b & 1) != 0;
    CHECK((!isMarked || *std::max_element(through, through + PixelsPerBlock) <= 1.0f / 32.0f));
    dark += isMarked ? 1 : 0;
  }
  return dark;
}

/// @param isDark of all blocks, as a claim
void TestAddGaussian(const RasterTarget& target, bool onLens, bool isDark)
{
  Random random(21), roundings(22);
  Worst worst;
  long dark = 0;
  RasterSettings settings{ 5.0f, 1e30f };
  settings.HasLayers = false;
  settings.LensRadius = onLens ? 0.1f : 0.0f;
  settings.SetShape(Ellipse);
  for (int repeat = 0; repeat < 30; ++repeat)
  {
    const auto tile = EmptyTile();
    ScalarTile scalar;
    for (int i = 0; i < repeat; ++i)
    {
      PlacedGaussian g = RandomGaussian(random, onLens);
      g.S.Near = g.S.Far = 1.0f + static_cast<float>(i);
      const LensFootprint stored = StoredOf(g.Footprint);
      tile->Dark = isDark ? ~std::uint64_t{ 0 } : 0;
      target.AddGaussian(*tile, g.S, onLens ? &stored : nullptr,
        { { 0, 0, TileSize, TileSize }, g.X, g.Y }, settings, Nobody);
      const float share = static_cast<float>(LensFragment(g, 0.0, 0.0, {}).Mean);
      scalar.Add(g, onLens, onLens && (isDark || WeightOfRamp(share) == 0.0f), roundings);
      dark += isDark ? 0 : CheckDark(*tile);
    }
    Compare(*tile, scalar, worst);
  }
  std::printf("%s%s%s: off by %.1e at most, %ld of %ld pixels\n", target.Name,
    onLens ? ", lens" : "", isDark ? ", dark" : "", worst.Through, worst.Bounded, worst.Compared);
  CHECK((dark > 0) == (onLens && !isDark));
  CHECK(worst.Bounded > 0.98 * static_cast<double>(worst.Compared));
  CHECK((worst.Moment > 0.05) == onLens);
}

/// What is in focus hides the same share of T at all points of the lens: T's moments over T stay.
void TestInFocus(const RasterTarget& target)
{
  Random random(24);
  RasterSettings settings{ 5.0f, 1e30f };
  settings.HasLayers = false;
  settings.LensRadius = 0.1f;
  const auto tile = EmptyTile();
  const auto add = [&](PlacedGaussian g) {
    const LensFootprint stored = StoredOf(g.Footprint);
    target.AddGaussian(
      *tile, g.S, &stored, { { 0, 0, TileSize, TileSize }, g.X, g.Y }, settings, Nobody);
  };
  for (int i = 0; i < 8; ++i)
  {
    PlacedGaussian blurred = RandomGaussian(random, true);
    blurred.S.Near = blurred.S.Far = 1.0f;
    add(blurred);
  }
  const PixelTile old = *tile;
  PlacedGaussian sharp = RandomGaussian(random, true);
  sharp.S.Weight = 0.5f;
  sharp.S.Near = sharp.S.Far = 2.0f;
  sharp.X = sharp.Y = 16.0f;
  sharp.Footprint.Quarter = 0.0f;
  add(sharp);
  double longest = 0.0, most = 0.0;
  for (int b = 0; b < BlocksPerTile; ++b)
  {
    for (int l = 0; l < PixelsPerBlock; ++l)
    {
      const FinishedLayers &was = old.Finished[b], &done = tile->Finished[b];
      const float left = done.Transmittance[l] / was.Transmittance[l];
      most = std::max<double>(most, 1.0 - left);
      longest = std::max<double>(longest, std::hypot(was.ThroughX[l], was.ThroughY[l]));
      CHECK_NEAR(done.ThroughX[l], left * was.ThroughX[l], 2e-5); // shortened: RootError
      CHECK_NEAR(done.ThroughY[l], left * was.ThroughY[l], 2e-5);
      CHECK_NEAR(done.ThroughRim[l], left * was.ThroughRim[l], 2e-5);
      CHECK_NEAR(done.ThroughAcross[l], left * was.ThroughAcross[l], 2e-5);
      CHECK_NEAR(done.ThroughDiagonal[l], left * was.ThroughDiagonal[l], 2e-5);
    }
  }
  CHECK(longest > 0.05);
  CHECK(most > 0.1);
}

/// T' = T t, C' = C + T c, m' = T' (m / T + m_1 / T_1 - m_0 / T_0), interpolated bilinearly
/// (GaussianRun.h), and shortened to what T' may have.
void TestAddRun(const RasterTarget& target)
{
  Random random(23);
  for (const int intervals : RunIntervals)
  {
    const double cell = static_cast<double>(TileSize) / intervals;
    const auto tile = EmptyTile(), run = EmptyTile();
    auto start = std::make_unique<RunStart>();
    for (int b = 0; b < BlocksPerTile; ++b)
    {
      for (int l = 0; l < PixelsPerBlock; ++l)
      {
        const auto share = [&] { return static_cast<float>(random.Uniform(0.1, 1.0)); };
        FinishedLayers &done = tile->Finished[b], &after = run->Finished[b],
                       &before = start->Before[b];
        done.Transmittance[l] = share();
        before.Transmittance[l] = share();
        after.Transmittance[l] = before.Transmittance[l] * share();
        for (FinishedLayers* f : { &done, &after, &before })
        {
          const float moment = 0.3f * LargestMoment(static_cast<double>(f->Transmittance[l]));
          f->ThroughX[l] = moment * static_cast<float>(random.Uniform(-1.0, 1.0));
          f->ThroughY[l] = moment * static_cast<float>(random.Uniform(-1.0, 1.0));
          const float limit = f->Transmittance[l] * (1.0f - f->Transmittance[l]);
          for (float* second : { f->ThroughRim, f->ThroughAcross, f->ThroughDiagonal })
          {
            second[l] = limit * static_cast<float>(random.Uniform(-1.0, 1.0));
          }
          f->Red[l] = share();
        }
      }
    }
    const PixelTile old = *tile;
    target.AddRun(*tile, *run, *start, { intervals, TileSize, TileSize, false });
    for (int k = 0; k < Pixels; ++k)
    {
      const double x = (k % TileSize + 0.5) / cell, y = (k / TileSize + 0.5) / cell;
      const int i = static_cast<int>(x), j = static_cast<int>(y);
      double t = 0.0, red = 0.0, mx = 0.0, my = 0.0;
      double second[3] = {};
      using Field = float(FinishedLayers::*)[PixelsPerBlock];
      constexpr Field fields[] = { &FinishedLayers::ThroughRim, &FinishedLayers::ThroughAcross,
        &FinishedLayers::ThroughDiagonal };
      for (int corner = 0; corner < 4; ++corner)
      {
        const int ci = i + corner % 2, cj = j + corner / 2;
        const double share = (1.0 - std::abs(x - ci)) * (1.0 - std::abs(y - cj));
        const int block = cj / BlockSize * BlocksPerRow + ci / BlockSize;
        const int l = cj % BlockSize * BlockSize + ci % BlockSize;
        const FinishedLayers &a = run->Finished[block], &b = start->Before[block];
        const double t0 = b.Transmittance[l], t1 = a.Transmittance[l];
        t += share * t1 / t0;
        red += share * a.Red[l] / t0;
        mx += share * (a.ThroughX[l] / t1 - b.ThroughX[l] / t0);
        my += share * (a.ThroughY[l] / t1 - b.ThroughY[l] / t0);
        for (int m = 0; m < 3; ++m)
        {
          second[m] += share * ((a.*fields[m])[l] / t1 - (b.*fields[m])[l] / t0);
        }
      }
      const FinishedLayers &done = tile->Finished[BlockOf(k)], &was = old.Finished[BlockOf(k)];
      const int l = LaneOf(k);
      const double before = was.Transmittance[l], after = before * t;
      mx = after * (was.ThroughX[l] / before + mx);
      my = after * (was.ThroughY[l] / before + my);
      const double shorten = std::min(1.0, LargestMoment(after) / std::hypot(mx, my));
      // A dozen float operations on values up to 10.
      CHECK_NEAR(done.Transmittance[l], after, 1e-6);
      CHECK_NEAR(done.Red[l], was.Red[l] + before * red, 1e-5);
      const double most = after * (1.0 - after) + 1e-7;
      for (int m = 0; m < 3; ++m)
      {
        const double moment = after * ((was.*fields[m])[l] / before + second[m]);
        CHECK_NEAR((done.*fields[m])[l], std::clamp(moment, -most, most), 2e-6);
      }
      // Of no more than 0.22.
      const double tolerance = 2e-6 + (shorten < 1.0 ? 0.22 * RootError : 0.0);
      CHECK_NEAR(done.ThroughX[l], mx * shorten, tolerance);
      CHECK_NEAR(done.ThroughY[l], my * shorten, tolerance);
    }
  }
}

/// A cell's range of pixels along an axis, of the picture's part of the tile; its last pixel
/// beyond.
struct CellSpan
{
  double Low, High;

  CellSpan(double center, double reach, int size)
    : Low(std::clamp(center - reach, 0.0, size - 1.0))
    , High(std::max(std::min(center + reach, static_cast<double>(size)), this->Low))
  {
  }

  double ShareOf(int pixel) const
  {
    return std::max(0.0, std::min(this->High, pixel + 1.0) - std::max(this->Low, 1.0 * pixel));
  }
};

/// T and its moments over the pixels of a cell, weighted with T.
Pixel MeanOfCell(const PixelTile& tile, const CellSpan& columns, const CellSpan& rows)
{
  Pixel mean;
  double weights = 0.0;
  mean.Through = 0.0;
  for (int k = 0; k < Pixels; ++k)
  {
    const FinishedLayers& done = tile.Finished[BlockOf(k)];
    const int l = LaneOf(k);
    const double weight = columns.ShareOf(k % TileSize) * rows.ShareOf(k / TileSize) *
      static_cast<double>(done.Transmittance[l]);
    weights += weight;
    mean.Through += weight * static_cast<double>(done.Transmittance[l]);
    mean.X += weight * static_cast<double>(done.ThroughX[l]);
    mean.Rim += weight * static_cast<double>(done.ThroughRim[l]);
  }
  mean.X /= mean.Through;
  mean.Rim /= mean.Through;
  mean.Through /= weights;
  return mean;
}

/// A tile with bright and dark pixels, some of them closed.
void FillTile(Random& random, PixelTile& tile)
{
  for (int k = 0; k < Pixels; ++k)
  {
    FinishedLayers& done = tile.Finished[BlockOf(k)];
    const int l = LaneOf(k);
    const bool dark = k % TileSize < TileSize / 2;
    const double through = dark ? 0.3 * random() * random() : random.Uniform(0.5, 1.0);
    done.Transmittance[l] = k % 7 == 0 ? 0.0f : static_cast<float>(through);
    done.ThroughX[l] = 0.1f * done.Transmittance[l] * static_cast<float>(random());
    done.ThroughRim[l] = 0.1f * done.Transmittance[l] * static_cast<float>(random());
  }
}

/// Cells begin with the means of their own pixels; where these are dark, of all that take something
/// over from the cell.
void TestBeginRun(const RasterTarget& target)
{
  Random random(25);
  int dark = 0, bright = 0;
  for (const int intervals : RunIntervals)
  {
    const RunGrid grid{ intervals, TileSize, TileSize - 5, false };
    const auto tile = EmptyTile(), run = EmptyTile();
    const auto start = std::make_unique<RunStart>();
    FillTile(random, *tile);
    target.BeginRun(*tile, grid, *run, *start);
    const double cell = static_cast<double>(TileSize) / intervals;
    const auto mean = [&](int i, int j, double reach) {
      return MeanOfCell(
        *tile, { i * cell, reach * cell, grid.Width }, { j * cell, reach * cell, grid.Height });
    };
    for (int j = 0; j <= intervals; ++j)
    {
      for (int i = 0; i <= intervals; ++i)
      {
        Pixel expected = mean(i, j, 0.5);
        if (!(expected.Through >= 0.25)) // also if all of its own pixels are closed
        {
          expected = mean(i, j, 1.0);
          ++dark;
        }
        bright += expected.Through >= 0.5 ? 1 : 0;
        const double through = std::max(expected.Through, 1.0 / 64.0);
        const FinishedLayers& done = run->Finished[BlockOfPixel(i, j)];
        const int l = LaneOfPixel(i, j);
        CHECK_NEAR(done.Transmittance[l], through, 2e-6);
        CHECK_NEAR(done.ThroughX[l], through * expected.X, 2e-6);
        CHECK_NEAR(done.ThroughRim[l], through * expected.Rim, 2e-6);
        CHECK(done.Red[l] == 0.0f);
        CHECK(start->Before[BlockOfPixel(i, j)].Transmittance[l] == done.Transmittance[l]);
      }
    }
    CHECK((run->Opaque & 1) == 0);
  }
  CHECK(dark > 100);
  CHECK(bright > 100);
}

/// Blocks by their largest T, and by its root mean square, which is known of each.
void TestFindBright(const RasterTarget& target)
{
  Random random(26);
  const auto tile = EmptyTile();
  float behind[BlocksPerTile];
  double squares[BlocksPerTile] = {};
  std::uint64_t byLargest = 0, byMean = 0;
  const BrightLimits limits{ 0.5f, 0.2f };
  for (int b = 0; b < BlocksPerTile; ++b)
  {
    const double most = random();
    behind[b] = static_cast<float>(random.Uniform(0.5, 1.0));
    double largest = 0.0;
    double& squared = squares[b];
    for (float& through : tile->Finished[b].Transmittance)
    {
      through = static_cast<float>(most * random());
      const double t = static_cast<double>(through) * static_cast<double>(behind[b]);
      largest = std::max(largest, t);
      squared += t * t / PixelsPerBlock;
    }
    byLargest |= static_cast<std::uint64_t>(largest >= 0.5 ? 1 : 0) << b;
    byMean |= static_cast<std::uint64_t>(squared >= 0.04 ? 1 : 0) << b;
  }
  const BrightBlocks bright = target.FindBright(*tile, behind, limits);
  CHECK(bright.ByLargest == byLargest);
  CHECK(bright.ByMean == byMean);
  for (int b = 0; b < BlocksPerTile; ++b)
  {
    CHECK_NEAR(bright.MeanSquare[b], squares[b], 1e-6);
  }
  CHECK(byLargest != 0);
  CHECK(byLargest != byMean);
}

const RasterTarget* const Targets[] = { &RasterTargetBaseline,
#ifdef SURFELSPLATTING_X86_TARGETS
  &RasterTargetAVX2, &RasterTargetAVX512
#endif
};
}

/// The program's argument is baseline, avx2 or avx512.
TEST_CASE("Gaussians in space")
{
  if (const RasterTarget* target = TargetUnderTest(Targets))
  {
    TestAddGaussian(*target, false, false);
    TestAddGaussian(*target, true, false);
    TestAddGaussian(*target, true, true);
    TestInFocus(*target);
    TestBeginRun(*target);
    TestAddRun(*target);
    TestFindBright(*target);
  }
}
