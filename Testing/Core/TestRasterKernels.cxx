// SPDX-License-Identifier: BSD-3-Clause
/**
 * The raster kernel of every instruction set that this machine has, against a scalar evaluation in
 * double; the exponential; the choice of the kernel.
 */
#include "Check.h"
#include "RasterKernel.h"
#include "ResamplingKernel.h"
#include "TestScene.h"

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

struct Tile
{
  PixelBlock Blocks[BlocksPerTile];

  Tile()
  {
    for (PixelBlock& b : this->Blocks)
    {
      b = PixelBlock{};
      Set(b.Near, std::numeric_limits<float>::infinity());
      Set(b.Far, -std::numeric_limits<float>::infinity());
      Set(b.Transmittance, 1.0f);
      Set(b.Limit, std::numeric_limits<float>::infinity());
    }
  }
};

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
    // 2e-7 + 7.5e-8 q/2: the exponential, see TestExponential.
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
  // A power has n times the relative error of 1 - q / Support.
  const double value = std::pow(t, shape), slope = std::pow(t, std::max(0.0, shape - 1.0));
  return { value, slope, value * (shape * errorT / t + 4.0 * Epsilon),
    slope * (shape * errorT / t + 4.0 * Epsilon) };
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
  const LensSlope* slope, const LensSector& sector, int rowBegin, int rowEnd, double x, double y)
{
  std::uint64_t fragments = 0;
  for (int j = rowBegin; j < rowEnd; ++j)
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
  int RowBegin, RowEnd;
};

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
    const float shapes[] = { -1.0f, 2.0f, 3.0f, 4.0f, 16.2f, 17.0f, 19.0f, 0.0f, 0.25f, 0.5f,
      1.0f };
    p.HasGradient = random.Integer(0, 2) == 0; // of these only the first seven shapes have one
    p.S.Shape = shapes[random.Integer(0, p.HasGradient ? 6 : 10)];
    p.Gradient.RedX = static_cast<float>(random.Uniform(-0.1, 0.1));
    p.Gradient.RedY = static_cast<float>(random.Uniform(-0.1, 0.1));
    p.HasSlope = random.Integer(0, 1) == 0;
    p.Slope = { static_cast<float>(random.Uniform(-0.08, 0.08)),
      static_cast<float>(random.Uniform(-0.03, 0.03)),
      static_cast<float>(random.Uniform(-0.03, 0.03)) };
    p.RowBegin = random.Integer(0, 3) == 0 ? random.Integer(0, 31) : 0;
    p.RowEnd = random.Integer(0, 3) == 0 ? random.Integer(p.RowBegin, 32) : 32;
    splats.push_back(p);
  }
  return splats;
}

struct CallbackCount
{
  long Lanes = 0;
  static void Count(void* self, const PixelBlock& block, int, const LaneMask& lanes)
  {
    for (int l = 0; l < LaneCount; ++l)
    {
      CHECK(lanes[l] == 0 || block.Weight[l] > 0.0f);
      static_cast<CallbackCount*>(self)->Lanes += lanes[l] ? 1 : 0;
    }
  }
};

void CompareTile(const Tile& tile, const ScalarTile& scalar, double& worst)
{
  for (int i = 0; i < TileSize * TileSize; ++i)
  {
    const ScalarPixel& p = scalar[i];
    const PixelBlock& b = tile.Blocks[i / LaneCount];
    const int l = i % LaneCount;
    if (!p.Undecided)
    {
      CHECK_NEAR(b.OutRed[l], p.OutRed, p.OutError + 1e-7);
      CHECK_NEAR(b.Transmittance[l], p.Transmittance, p.OutError + 1e-7);
      worst = std::max(worst, std::abs(b.OutRed[l] - p.OutRed));
    }
    CHECK(b.Weight[l] == 0.0f && b.Near[l] > b.Far[l]); // all layers closed and emptied
  }
}

void TestKernel(const RasterKernel& kernel)
{
  Random random(8);
  double worst = 0.0;
  for (int repeat = 0; repeat < 60; ++repeat)
  {
    const auto tile = std::make_unique<Tile>();
    ScalarTile scalar(TileSize * TileSize);
    CallbackCount callback;
    long difference = 0, undecided = 0;
    RasterSettings settings = Settings;
    settings.Sector = SectorOf(repeat % NumberOfSectors);
    for (const PlacedSplat& p : RandomSplats(random, repeat == 0 ? 0 : 1 + repeat % 40))
    {
      const SplatGradient* gradient = p.HasGradient ? &p.Gradient : nullptr;
      const LensSlope* slope = p.HasSlope ? &p.Slope : nullptr;
      const std::uint64_t fragments = kernel.AddSplat(tile->Blocks, p.S, gradient, slope,
        p.RowBegin, p.RowEnd, p.X, p.Y, settings, { &CallbackCount::Count, &callback });
      difference += std::abs(static_cast<long>(fragments) -
        static_cast<long>(AddScalar(
          scalar, p.S, gradient, slope, settings.Sector, p.RowBegin, p.RowEnd, p.X, p.Y)));
    }
    kernel.CloseAll(tile->Blocks, Settings);
    for (ScalarPixel& p : scalar)
    {
      p.Close();
      undecided += p.Undecided ? 1 : 0;
    }
    CHECK(difference <= undecided);
    CHECK(undecided <= 10); // of 1024
    CompareTile(*tile, scalar, worst);
  }
  std::printf("%s: colour off by %.1e at most\n", kernel.Name, worst);
}

/// Values that no set-up should send and that must not reach memory outside of the tile.
void TestExtremes(const RasterKernel& kernel)
{
  const float infinity = std::numeric_limits<float>::infinity();
  const float values[] = { 0.0f, 1e-45f, 1e-20f, 1.0f, 1e20f, 3e38f, infinity, -infinity, NAN };
  const auto tile = std::make_unique<Tile>();
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
        CHECK(kernel.AddSplat(tile->Blocks, s, nullptr, nullptr, 0, TileSize, x, 1.0f, Settings,
                { nullptr, nullptr }) <= static_cast<std::uint64_t>(TileSize * TileSize));
      }
    }
  }
}

/**
 * exp(-x) over [0, 80]. t = -x log2(e) is rounded to within Epsilon |t| and its constant by 1.3e-8:
 * that is 7.3e-8 x of the result; polynomial and its evaluation, 2e-7.
 */
void TestExponential()
{
  double worstNear = 0.0, worst = 0.0;
  constexpr int Steps = 400000;
  for (int i = 0; i <= Steps; ++i)
  {
    const float x = 80.0f * static_cast<float>(i) / Steps;
    Lanes lanes;
    Set(lanes, x);
    ExpOfMinus(lanes);
    const double expected = std::exp(-static_cast<double>(x));
    const double error = std::abs(lanes[i % LaneCount] / expected - 1.0);
    CHECK_NEAR(error, 0.0, 2e-7 + 7.5e-8 * x);
    worst = std::max(worst, error);
    worstNear = x <= 2.5f ? std::max(worstNear, error) : worstNear;
  }
  std::printf("exp(-x): relative error %.1e over [0, 2.5], %.1e over [0, 80]\n", worstNear, worst);
  Lanes zero{};
  ExpOfMinus(zero);
  CHECK(zero[0] == 1.0f); // a splat's centre has its full weight
}
}

/// The named kernel if it is built in and this processor runs it, else null.
const RasterKernel* FindKernel(const std::string& name)
{
  if (name == "baseline")
  {
    return &RasterKernelBaseline;
  }
#ifdef SURFELSPLATTING_X86_KERNELS
  __builtin_cpu_init();
  if (name == "avx2" && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
  {
    return &RasterKernelAVX2;
  }
  if (name == "avx512" && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
    __builtin_cpu_supports("avx512dq"))
  {
    return &RasterKernelAVX512;
  }
#endif
  return nullptr;
}

/// The best that this machine has is what the raster takes.
void TestSelection()
{
  const RasterKernel* best = nullptr;
  for (const char* name : { "baseline", "avx2", "avx512" })
  {
    const RasterKernel* kernel = FindKernel(name);
    best = kernel ? kernel : best;
  }
  CHECK(SelectRasterKernel().AddSplat == best->AddSplat);
}

/// @param argv[1] baseline, avx2 or avx512
int main(int argc, char* argv[])
{
  constexpr int skipped = 77;
  const std::string name = argc > 1 ? argv[1] : "baseline";
  const RasterKernel* kernel = FindKernel(name);
  if (!kernel)
  {
    std::printf("%s: skipped, not on this machine\n", name.c_str());
    return skipped;
  }
  TestExponential();
  TestSelection();
  TestKernel(*kernel);
  TestExtremes(*kernel);
  return Checks().Report(("raster kernel " + name).c_str());
}
