// SPDX-License-Identifier: BSD-3-Clause
/**
 * The loops of the raster for every instruction set that this machine has, against a scalar one in
 * double; the exponential; the choice of the target.
 */
#include "Core/Lens/ResamplingKernel.h"
#include "Core/Raster/RasterTarget.h"
#include "Core/Simd/Lanes.h"
#include "TargetUnderTest.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <string>

using namespace SurfelSplatting;

namespace
{
constexpr double Epsilon = 0x1p-24;
constexpr float Support = 5.0f;
constexpr RasterSettings Settings{ Support, 1e30f };
constexpr CloseCallback Nobody{ nullptr, nullptr };

std::unique_ptr<PixelTile> EmptyTile()
{
  auto tile = std::make_unique<PixelTile>();
  *tile = PixelTile{};
  constexpr float infinity = std::numeric_limits<float>::infinity();
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    std::fill_n(tile->Open[i].Far, PixelsPerBlock, -infinity);
    std::fill_n(tile->Finished[i].Near, PixelsPerBlock, infinity);
    std::fill_n(tile->Finished[i].OccluderDepth, PixelsPerBlock, infinity);
    std::fill_n(tile->Finished[i].Transmittance, PixelsPerBlock, 1.0f);
  }
  return tile;
}

/// A pixel of the scalar evaluation: one open layer, what is finished, and a bound on float's
/// error.
struct ScalarPixel
{
  double Far = 0, Weight = 0, Opacity = 0, Red = 0, Error = 0;
  double Transmittance = 1, OutRed = 0, OutError = 0;
  bool Undecided = false;

  void Close()
  {
    if (this->Weight > 0.0)
    {
      const double share = this->Transmittance / std::max(1.0, this->Weight);
      this->OutRed += share * std::max(0.0, this->Red);
      // Twice: sums are divided by a sum that is off too. Behind, the error is met again in the
      // transmittance.
      this->OutError += 2.0 * 2.0 * share * this->Error + 8.0 * Epsilon;
      this->Transmittance -= share * this->Opacity;
    }
    this->Weight = this->Opacity = this->Red = this->Error = 0.0;
  }
};

using ScalarTile = std::vector<ScalarPixel>;

/// A kernel's value at q, the slope that tilts colours, and how far rounding may move both.
struct ScalarKernel
{
  double Value, Slope, ValueError, SlopeError;
};

/// @param error of q
ScalarKernel EvaluateScalar(double shape, double q, double error)
{
  const double t = 1.0 - q / Support, errorT = error / Support + 2.0 * Epsilon;
  if (shape < 0.0)
  {
    // 2e-7 + 7.5e-8 q/2: the exponential, see the test Exponential.
    const double value = std::exp(-0.5 * q);
    const double bound = value * (0.5 * error + 2e-7 + 3.75e-8 * q);
    return { value, value, bound, bound };
  }
  if (shape >= SmoothShape)
  {
    const double steepness = shape - SmoothShape;
    const double u = std::min(1.0, steepness * t), errorU = steepness * errorT + Epsilon;
    return { u * u * (3.0 - 2.0 * u), u * (1.0 - u), 6.0 * u * (1.0 - u) * errorU + 8.0 * Epsilon,
      errorU + 4.0 * Epsilon };
  }
  // |k'| is at most 2 + 0.8 shape. The slope is that of x^2 for every shape.
  const double cube = (1.0 - BellEdge) * t * t * t;
  return { t * (t + shape * (BellEdge + cube - t)), t, 2.8 * errorT + 8.0 * Epsilon,
    errorT + 4.0 * Epsilon };
}

/// Share of a fragment in a sector of the lens; its relative error, and whether rounding decides
/// that it is there at all.
double ScalarShare(const LensSlope& slope, const LensSector& sector, double x, double y, int i,
  int j, double& error, bool& undecided)
{
  const double dx = i + 0.5 - x, dy = j + 0.5 - y,
               reach = 2.0 * TileSize + std::abs(x) + std::abs(y);
  const double terms[] = { 0.5 + static_cast<double>(sector.X) * slope.Point * dx,
    0.5 + static_cast<double>(sector.Y) * slope.Point * dy,
    1.0 + static_cast<double>(slope.TiltX) * dx + static_cast<double>(slope.TiltY) * dy };
  const double bounds[] = { 4.0 * Epsilon * (1.0 + std::abs(slope.Point) * reach),
    4.0 * Epsilon * (1.0 + std::abs(slope.Point) * reach),
    4.0 * Epsilon * (1.0 + (std::abs(slope.TiltX) + std::abs(slope.TiltY)) * reach) };
  double share = 4.0;
  error = 4.0 * Epsilon;
  for (int t = 0; t < 3; ++t)
  {
    const double value = std::max(0.0, t < 2 ? std::min(1.0, terms[t]) : terms[t]);
    undecided = undecided || std::abs(terms[t]) <= bounds[t];
    error += value > 0.0 ? bounds[t] / value : 0.0;
    share *= value;
  }
  return share;
}

std::uint64_t AddScalar(ScalarTile& tile, const Splat& s, const SplatGradient* gradient,
  const LensSlope* slope, const LensSector& sector, double x, double y)
{
  std::uint64_t fragments = 0;
  for (int j = 0; j < TileSize; ++j)
  {
    for (int i = 0; i < TileSize; ++i)
    {
      ScalarPixel& p = tile[static_cast<std::size_t>(j) * TileSize + i];
      const double dy = j + 0.5 - y, u = i + 0.5 - x + static_cast<double>(s.K) * dy;
      const double q = s.A * u * u + s.B * dy * dy;
      // u and dy are sums of at most three terms, each off by its own rounding; q by four relative
      // ones.
      const double errorU = 3.0 * Epsilon * (TileSize + std::abs(x) + std::abs(s.K * dy));
      const double errorY = 3.0 * Epsilon * (TileSize + std::abs(y));
      const double error = 2.0 * s.A * std::abs(u) * (errorU + std::abs(s.K) * errorY) +
        2.0 * s.B * std::abs(dy) * errorY + 4.0 * Epsilon * q;
      p.Undecided = p.Undecided || std::abs(q - Support) <= error;
      double shareError = 0.0;
      const double share = slope && q < Support
        ? ScalarShare(*slope, sector, x, y, i, j, shareError, p.Undecided)
        : 1.0;
      if (!(q < Support) || share <= 0.0)
      {
        continue;
      }
      ++fragments;
      if (p.Weight > 0.0 && p.Far < s.Near)
      {
        p.Close();
      }
      p.Far = p.Weight > 0.0 ? std::max(p.Far, static_cast<double>(s.Far)) : s.Far;
      ScalarKernel k = EvaluateScalar(s.Shape, q, error);
      k.ValueError = share * (k.ValueError + k.Value * shareError);
      k.SlopeError = share * (k.SlopeError + k.Slope * shareError);
      k.Value *= share;
      k.Slope *= share;
      const double w = s.Weight * k.Value;
      p.Weight += w;
      p.Opacity += w * s.Opacity;
      p.Red += w * s.Opacity * s.Red;
      // Then products and the growing sum.
      p.Error += s.Weight * k.ValueError + w * 4.0 * Epsilon + Epsilon * p.Weight;
      if (gradient)
      {
        const double dx = i + 0.5 - x;
        const double tilt = gradient->RedX * dx + gradient->RedY * dy;
        const double terms = std::abs(gradient->RedX) * (TileSize + std::abs(x)) +
          std::abs(gradient->RedY) * (TileSize + std::abs(y));
        p.Red += s.Weight * s.Opacity * k.Slope * tilt;
        p.Error += s.Weight * (k.SlopeError * std::abs(tilt) + k.Slope * 8.0 * Epsilon * terms);
      }
    }
  }
  return fragments;
}

struct PlacedSplat
{
  Splat S{};
  SplatGradient Gradient{};
  LensSlope Slope{};
  bool HasGradient = false, HasSlope = false;
  float X, Y;
  PixelBox Span;
};

/// Half of the support in a direction, in float's favour.
double Reach(double variance)
{
  return std::sqrt(Support * variance) * (1.0 + 1e-5) + 1e-3;
}

/// First pixel of the tile whose centre is not left of x.
int FirstPixel(double x)
{
  return static_cast<int>(std::clamp(std::ceil(x - 0.5), 0.0, static_cast<double>(TileSize)));
}

/// By ascending near depth, as the raster gets them; a few far outside of the tile, very long or
/// very small.
std::vector<PlacedSplat> RandomSplats(Random& random, int count)
{
  std::vector<PlacedSplat> splats;
  float near = 1.0f;
  for (int i = 0; i < count; ++i)
  {
    PlacedSplat p;
    const double major = std::pow(10.0, random.Uniform(-0.3, 2.5));
    const double minor = std::max(0.5, major * random.Uniform(0.0, 1.0));
    const double angle = random.Uniform(0.0, 3.14159), c = std::cos(angle), s = std::sin(angle);
    const double yy = major * major * s * s + minor * minor * c * c;
    const double xy = (major * major - minor * minor) * c * s;
    p.S.A = static_cast<float>(yy / (major * major * minor * minor));
    p.S.K = static_cast<float>(-xy / yy);
    p.S.B = static_cast<float>(1.0 / yy);
    p.X = static_cast<float>(random.Uniform(-major, TileSize + major));
    p.Y = static_cast<float>(random.Uniform(-major, TileSize + major));
    p.S.Weight = static_cast<float>(random.Uniform(0.05, 2.0));
    near += static_cast<float>(random.Integer(0, 3)) * 0.125f;
    p.S.Near = near;
    p.S.Far = near + static_cast<float>(random.Integer(0, 2)) * 0.25f;
    p.S.Red = static_cast<float>(random.Uniform(0.0, 1.0));
    p.S.Opacity = static_cast<float>(random.Uniform(0.2, 1.0));
    const float shapes[] = { -1.0f, 0.0f, 0.25f, 1.0f, 2.2f, 3.0f, 5.0f };
    p.HasGradient = random.Integer(0, 2) == 0;
    p.S.Shape = shapes[random.Integer(0, 6)];
    p.Gradient.RedX = static_cast<float>(random.Uniform(-0.1, 0.1));
    p.Gradient.RedY = static_cast<float>(random.Uniform(-0.1, 0.1));
    p.HasSlope = random.Integer(0, 1) == 0;
    p.Slope = { static_cast<float>(random.Uniform(-0.08, 0.08)),
      static_cast<float>(random.Uniform(-0.03, 0.03)),
      static_cast<float>(random.Uniform(-0.03, 0.03)) };
    const double xx = major * major + minor * minor - yy;
    p.Span = random.Integer(0, 3) == 0
      ? PixelBox{ 0, 0, TileSize, TileSize }
      : PixelBox{ FirstPixel(p.X - Reach(xx)), FirstPixel(p.Y - Reach(yy)),
          FirstPixel(p.X + Reach(xx)), FirstPixel(p.Y + Reach(yy)) };
    splats.push_back(p);
  }
  return splats;
}

struct CallbackCount
{
  long Lanes = 0;
  static void Count(void* self, const PixelTile& tile, int block, unsigned int lanes)
  {
    CHECK((lanes >> PixelsPerBlock) == 0);
    for (int l = 0; l < PixelsPerBlock; ++l)
    {
      const bool closed = (lanes >> l & 1) != 0;
      CHECK((!closed || tile.Open[block].Weight[l] > 0.0f));
      CHECK((!closed || tile.Finished[block].Near[l] <= tile.Open[block].Far[l]));
      static_cast<CallbackCount*>(self)->Lanes += closed ? 1 : 0;
    }
  }
};

void CompareTile(const PixelTile& tile, const ScalarTile& scalar, double& worst)
{
  for (int i = 0; i < TileSize * TileSize; ++i)
  {
    const ScalarPixel& p = scalar[i];
    const int x = i % TileSize, y = i / TileSize;
    const int block = y / BlockSize * BlocksPerRow + x / BlockSize;
    const int l = y % BlockSize * BlockSize + x % BlockSize;
    const OpenLayers& open = tile.Open[block];
    const FinishedLayers& done = tile.Finished[block];
    if (!p.Undecided)
    {
      CHECK_NEAR(done.Red[l], p.OutRed, p.OutError + 1e-7);
      CHECK_NEAR(done.Transmittance[l], p.Transmittance, p.OutError + 1e-7);
      worst = std::max(worst, std::abs(done.Red[l] - p.OutRed));
    }
    CHECK(open.Weight[l] == 0.0f);
    CHECK(done.Near[l] > open.Far[l]); // all layers closed and emptied
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
    settings.SkipHidden = skip;
    const auto tile = EmptyTile();
    std::uint64_t fragments[3];
    target.AddSplat(*tile, { wall, nullptr, nullptr }, { left, 16, 16 }, settings, Nobody);
    CHECK(tile->Opaque == 0); // still open
    for (int i = 0; i < 3; ++i)
    {
      behind.Near = behind.Far = 2.0f + static_cast<float>(i);
      fragments[i] =
        target.AddSplat(*tile, { behind, nullptr, nullptr }, { all, 16, 16 }, settings, Nobody);
    }
    CHECK(fragments[0] == TileSize * TileSize);
    CHECK(fragments[1] == (skip ? TileSize * TileSize / 2 : TileSize * TileSize));
    CHECK(fragments[2] == (skip ? 0u : TileSize * TileSize));
    CHECK(tile->Opaque == ~std::uint64_t{ 0 });
    target.CloseAll(*tile, settings);
    for (int i = 0; i < BlocksPerTile; ++i)
    {
      const bool covered = i % BlocksPerRow < BlocksPerRow / 2;
      CHECK_NEAR(tile->Finished[i].Red[5], covered ? 0.0 : 1.0, MinTransmittance);
      CHECK_NEAR(tile->Finished[i].Green[5], covered ? 1.0 : 0.0, MinTransmittance);
    }
  }
}

void TestSplats(const RasterTarget& target)
{
  Random random(8);
  double worst = 0.0;
  for (int repeat = 0; repeat < 60; ++repeat)
  {
    const auto tile = EmptyTile();
    ScalarTile scalar(TileSize * TileSize);
    CallbackCount callback;
    long difference = 0, undecided = 0;
    RasterSettings settings = Settings;
    settings.Sector = SectorOf(repeat % NumberOfSectors);
    for (const PlacedSplat& p : RandomSplats(random, repeat == 0 ? 0 : 1 + repeat % 40))
    {
      const SplatGradient* gradient = p.HasGradient ? &p.Gradient : nullptr;
      const LensSlope* slope = p.HasSlope ? &p.Slope : nullptr;
      const std::uint64_t fragments = target.AddSplat(*tile, { p.S, gradient, slope },
        { p.Span, p.X, p.Y }, settings, { &CallbackCount::Count, &callback });
      difference += std::abs(static_cast<long>(fragments) -
        static_cast<long>(AddScalar(scalar, p.S, gradient, slope, settings.Sector, p.X, p.Y)));
    }
    target.CloseAll(*tile, Settings);
    for (ScalarPixel& p : scalar)
    {
      p.Close();
      undecided += p.Undecided ? 1 : 0;
    }
    CHECK(difference <= undecided);
    CHECK(undecided <= 10); // of 1024
    CompareTile(*tile, scalar, worst);
  }
  std::printf("%s: colour off by %.1e at most\n", target.Name, worst);
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
  CHECK(target.AddTent(*tile, tent, place, Settings, Nobody) == 64u);
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
    CHECK(open.Far[l] == (weight > 0.0 ? 3.0f : -std::numeric_limits<float>::infinity()));
  }
}

/// Values that no set-up should send and that must not reach memory outside of the tile.
void TestExtremes(const RasterTarget& target)
{
  const float infinity = std::numeric_limits<float>::infinity();
  const float values[] = { 0.0f, 1e-45f, 1e-20f, 1.0f, 1e20f, 3e38f, infinity, -infinity, NAN };
  const auto tile = EmptyTile();
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
        s.Shape = a > 1.0f ? 0.25f : -1.0f;
        CHECK(
          target.AddSplat(*tile, { s, nullptr, nullptr }, { { 0, 0, TileSize, TileSize }, x, 1.0f },
            Settings, Nobody) <= static_cast<std::uint64_t>(TileSize * TileSize));
      }
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
  CHECK((SelectRasterTarget().AddSplat == best->AddSplat));
}

/// The program's argument is baseline, avx2 or avx512.
TEST_CASE("Raster targets")
{
  if (const RasterTarget* target = TargetUnderTest(Targets))
  {
    TestSplats(*target);
    TestOpaqueBlocks(*target);
    TestTent(*target);
    TestExtremes(*target);
  }
}
