// SPDX-License-Identifier: BSD-3-Clause
/**
 * Layers of coarse grids that hold two surfaces: which two, and which layers are one; and that
 * pictures hardly change when something light comes between two blurred surfaces.
 */
#include "Core/Raster/TwoSurfaces.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <cmath>
#include <cstdio>
#include <vector>

using namespace SurfelSplatting;

namespace
{
struct Sample
{
  double Weight, Depth;
};

constexpr double Half = 0.01;

LayerDepths DepthsOf(const std::vector<Sample>& samples, double half = Half)
{
  double near = samples.front().Depth, weight = 0.0, mean = 0.0;
  for (const Sample& s : samples)
  {
    near = std::min(near, s.Depth - half);
    weight += s.Weight;
    mean += s.Weight * s.Depth;
  }
  double powers[4] = {};
  for (const Sample& s : samples)
  {
    for (int k = 0; k < 4; ++k)
    {
      powers[k] += s.Weight * std::pow(s.Depth - near, 1 + k);
    }
  }
  return { static_cast<float>(weight), static_cast<float>(mean / weight),
    static_cast<float>(powers[0]), static_cast<float>(powers[1]), static_cast<float>(powers[2]),
    static_cast<float>(powers[3]), static_cast<float>(half) };
}

/// A normal distribution, cut off at four deviations.
void AddNormal(std::vector<Sample>& samples, double weight, double depth, double deviation)
{
  constexpr int count = 400;
  double sum = 0.0;
  const auto kernel = [](int i) { return std::exp(-0.5 * std::pow(8.0 * i / count - 4.0, 2)); };
  for (int i = 0; i <= count; ++i)
  {
    sum += kernel(i);
  }
  for (int i = 0; i <= count; ++i)
  {
    samples.push_back({ weight * kernel(i) / sum, depth + deviation * (8.0 * i / count - 4.0) });
  }
}

std::vector<Sample> FewSamples(Random& random, double leastWeight)
{
  std::vector<Sample> samples;
  for (int k = random.Integer(2, 6); k > 0; --k)
  {
    samples.push_back({ random.Uniform(leastWeight, 0.5), random.Uniform(3.0, 4.0) });
  }
  return samples;
}

bool Splits(const LayerDepths& layer, LayerPart (&parts)[2])
{
  TwoNormals fit{};
  return SplitLayer(layer, WholeLayer(layer), fit, parts);
}

bool Splits(const std::vector<Sample>& samples)
{
  LayerPart parts[2] = {};
  return Splits(DepthsOf(samples), parts);
}

TEST_CASE("Two points")
{
  for (const double front : { 0.25, 0.5, 0.7 })
  {
    LayerPart parts[2] = {};
    const LayerDepths layer = DepthsOf({ { 0.8 * front, 2.0 }, { 0.8 * (1.0 - front), 3.0 } });
    CHECK(Splits(layer, parts));
    CHECK_NEAR(parts[0].Weight, 0.8 * front, 1e-4);
    CHECK_NEAR(parts[1].Weight, 0.8 * (1.0 - front), 1e-4);
    CHECK_NEAR(parts[0].Depth, 2.0, 1e-3);
    CHECK_NEAR(parts[1].Depth, 3.0, 1e-3);
    CHECK_NEAR(parts[0].Near, 2.0 - Half, 3e-3);
    CHECK_NEAR(parts[0].Far, 2.0 + Half, 3e-3);
    CHECK_NEAR(parts[1].Near, 3.0 - Half, 3e-3);
    CHECK_NEAR(parts[1].Far, 3.0 + Half, 3e-3);
  }
}

TEST_CASE("Two normal distributions")
{
  for (const double front : { 0.3, 0.5, 0.65 })
  {
    for (const double deviation : { 0.05, 0.1, 0.15 })
    {
      std::vector<Sample> samples;
      AddNormal(samples, front, 5.0, deviation);
      AddNormal(samples, 1.0 - front, 6.0, deviation);
      const LayerDepths layer = DepthsOf(samples);
      TwoNormals fit{};
      CHECK(FitTwoNormals(layer, fit));
      const double between = front * (1.0 - front);
      CHECK_NEAR(fit.Apart, between / (between + deviation * deviation), 2e-3);
      CHECK_NEAR(fit.FrontWeight, front, 5e-3);
      CHECK_NEAR(layer.Mean + fit.Front, 5.0, 5e-3);
      CHECK_NEAR(layer.Mean + fit.Back, 6.0, 5e-3);
      CHECK_NEAR(fit.Deviation, deviation, 5e-3);
    }
  }
}

constexpr double Weights[] = { 0.3, 0.5 }; // of the surfaces of LayerOfTwo

/// Surfaces at 2 and 3, each with a deviation of 0.1.
LayerDepths LayerOfTwo()
{
  std::vector<Sample> samples;
  AddNormal(samples, Weights[0], 2.0, 0.1);
  AddNormal(samples, Weights[1], 3.0, 0.1);
  return DepthsOf(samples);
}

/// Means by depth: exact for surfaces of one value, never negative, together those of the layer.
TEST_CASE("Means of the two")
{
  const LayerDepths layer = LayerOfTwo();
  TwoNormals fit{};
  CHECK(FitTwoNormals(layer, fit));
  for (const double front : { 0.0, 0.2, 0.9 })
  {
    for (const double back : { 0.0, 0.5, 1.5 })
    {
      const double mean = (Weights[0] * front + Weights[1] * back) / 0.8;
      const double product = (Weights[0] * front * 2.0 + Weights[1] * back * 3.0) / 0.8;
      const PartMeans both =
        SplitMean(static_cast<float>(mean), static_cast<float>(product - mean * layer.Mean), fit);
      CHECK_NEAR(both.Front, front, 5e-3);
      CHECK_NEAR(both.Back, back, 5e-3);
    }
  }
  for (const float covariance : { -9.0f, -0.1f, 0.0f, 0.2f, 9.0f })
  {
    const PartMeans both = SplitMean(0.7f, covariance, fit);
    CHECK(both.Front >= 0.0f);
    CHECK(both.Back >= 0.0f);
    CHECK_NEAR(both.Front * fit.FrontWeight + both.Back * (1.0f - fit.FrontWeight), 0.7, 1e-5);
  }
  CHECK(SplitMean(0.0f, 1.0f, fit).Front == 0.0f);
  CHECK(SplitMean(-0.1f, 1.0f, fit).Back == -0.1f);
}

/// Lens points by depth: exact for surfaces of one point, together those of the layer, and, unless
/// they stay where the layer's is, no farther off the middle than a segment of the lens with their
/// weight.
TEST_CASE("Points of the two")
{
  const LayerDepths layer = LayerOfTwo();
  TwoNormals fit{};
  CHECK(FitTwoNormals(layer, fit));
  const float front = fit.FrontWeight, back = 1.0f - front;
  // Covariances of a layer whose surfaces are dx, dy apart on the lens.
  const auto split = [&](float x, float y, float dx, float dy) {
    const float perApart = front * back * (fit.Back - fit.Front);
    return SplitPoint(layer, x, y, perApart * dx, perApart * dy, fit);
  };
  const PartPoints exact = split(0.03f, -0.02f, -0.4f, 0.6f);
  CHECK_NEAR(exact.BackX - exact.FrontX, -0.4, 1e-5);
  CHECK_NEAR(exact.BackY - exact.FrontY, 0.6, 1e-5);
  for (const float far : { 0.5f, 1.5f, 9.0f })
  {
    const PartPoints p = split(0.1f, -0.2f, far, -2.0f * far);
    CHECK_NEAR(front * p.FrontX + back * p.BackX, 0.1, 1e-5);
    CHECK_NEAR(front * p.FrontY + back * p.BackY, -0.2, 1e-5);
    CHECK(std::hypot(p.FrontX, p.FrontY) <= LargestMoment(Weights[0]) / Weights[0] + 0.01);
    CHECK(std::hypot(p.BackX, p.BackY) <= LargestMoment(Weights[1]) / Weights[1] + 0.01);
    CHECK(p.BackX > p.FrontX + 0.1f);
  }
  const PartPoints outside = split(0.9f, 0.1f, -0.2f, 0.0f);
  CHECK(outside.FrontX == 0.9f);
  CHECK(outside.BackX == 0.9f);
}

double RightSide(double squaredSkewness, double r)
{
  return 2.0 * (1.0 - r * r) + squaredSkewness * (1.0 / r - 1.0);
}

/// Newton's two steps solve the equation of the header, whatever the depths are.
TEST_CASE("Share of the variance")
{
  Random random(3);
  int count = 0;
  for (int i = 0; i < 20000; ++i)
  {
    const std::vector<Sample> samples = FewSamples(random, 0.05);
    TwoNormals fit{};
    if (!FitTwoNormals(DepthsOf(samples), fit))
    {
      continue;
    }
    double weight = 0.0, mean = 0.0, moments[5] = {};
    for (const Sample& s : samples)
    {
      weight += s.Weight;
      mean += s.Weight * s.Depth;
    }
    mean /= weight;
    for (const Sample& s : samples)
    {
      for (int k = 2; k < 5; ++k)
      {
        moments[k] += s.Weight * std::pow(s.Depth - mean, k) / weight;
      }
    }
    const double squared = std::pow(moments[3], 2) / std::pow(moments[2], 3);
    const double left = moments[4] / std::pow(moments[2], 2) - 1.0 - squared;
    double low = 0.01, high = 1.0;
    for (int k = 0; k < 60; ++k)
    {
      const double middle = 0.5 * (low + high);
      (RightSide(squared, middle) > left ? low : high) = middle;
    }
    if (std::min(fit.FrontWeight, 1.0f - fit.FrontWeight) > LeastPart)
    {
      ++count;
      CHECK_NEAR(fit.Apart, low, 1e-3);
    }
  }
  CHECK(count > 3000);
}

TEST_CASE("One surface")
{
  std::vector<Sample> even, one, falling;
  for (int i = 0; i < 1000; ++i)
  {
    even.push_back({ 1e-3, 5.0 + 1e-3 * i });
    falling.push_back({ 1e-6 * (1000 - i), 5.0 + 1e-3 * i });
  }
  AddNormal(one, 1.0, 5.0, 0.2);
  CHECK(!Splits(even));
  CHECK(!Splits(falling));
  CHECK(!Splits(one));
  CHECK(!Splits({ { 1.0, 5.0 } }));
  // Two whose z-ranges touch.
  CHECK(!Splits({ { 0.5, 5.0 }, { 0.5, 5.0 + 1.99 * Half } }));
  CHECK(Splits({ { 0.5, 5.0 }, { 0.5, 5.0 + 2.1 * Half } }));
  // A surface and a tail.
  CHECK(!Splits({ { 0.95, 5.0 }, { 0.05, 6.0 } }));
  CHECK(!Splits({ { 0.05, 5.0 }, { 0.95, 6.0 } }));
}

/// Parts are together the layer.
TEST_CASE("Parts and whole")
{
  Random random(4);
  int count = 0;
  for (int i = 0; i < 20000; ++i)
  {
    const std::vector<Sample> samples = FewSamples(random, 1e-4);
    const LayerDepths layer = DepthsOf(samples, random.Uniform(1e-3, 0.2));
    const LayerPart whole = WholeLayer(layer);
    LayerPart p[2] = {};
    TwoNormals fit{};
    if (!SplitLayer(layer, whole, fit, p))
    {
      continue;
    }
    ++count;
    CHECK(std::min(p[0].Weight, p[1].Weight) > 0.0f);
    CHECK_NEAR(p[0].Weight + p[1].Weight, layer.Weight, 1e-6);
    CHECK_NEAR(p[0].Weight * p[0].Depth + p[1].Weight * p[1].Depth, layer.Weight * layer.Mean,
      1e-5 * layer.Weight * layer.Mean);
    CHECK(p[0].Near < p[0].Far);
    CHECK(p[0].Far <= p[1].Near + 1e-6f);
    CHECK(p[1].Near < p[1].Far);
  }
  std::printf("%d of 20000 layers of a few splats are two\n", count);
  CHECK(count > 2000);
}

/// The gap opens continuously: with the distance of the two, with the lighter one's weight, and
/// with what is between them.
TEST_CASE("Continuity")
{
  const auto gapOf = [](const std::vector<Sample>& samples) {
    LayerPart p[2] = {};
    return Splits(DepthsOf(samples), p) ? p[1].Near - p[0].Far : 0.0f;
  };
  float last[3] = {}, largest[3] = {};
  constexpr int steps = 4000;
  for (int i = 1; i <= steps; ++i)
  {
    const double t = static_cast<double>(i) / steps;
    std::vector<Sample> bridged;
    AddNormal(bridged, 0.4, 5.0, 0.02);
    AddNormal(bridged, 0.4, 5.5, 0.02);
    AddNormal(bridged, 0.4 * (1.0 - t), 5.25, 0.1);
    const float gaps[] = { gapOf({ { 0.3, 5.0 }, { 0.4, 5.0 + 0.5 * t } }),
      gapOf({ { 0.5, 5.0 }, { 0.5 * t, 5.5 } }), gapOf(bridged) };
    for (int k = 0; k < 3; ++k)
    {
      largest[k] = i > 1 ? std::max(largest[k], std::abs(gaps[k] - last[k])) : 0.0f;
      last[k] = gaps[k];
    }
  }
  std::printf("largest steps of the gap: %.5f %.5f %.5f\n", largest[0], largest[1], largest[2]);
  for (int k = 0; k < 3; ++k)
  {
    CHECK(last[k] > 0.3f);
    CHECK(largest[k] < 0.005f);
  }
}

/// Where the gap begins to count, the parts end where the layer ends, and touch.
TEST_CASE("Begin of a gap")
{
  const LayerDepths layer = DepthsOf({ { 0.1001, 5.0 }, { 0.8999, 6.0 } });
  const LayerPart whole = WholeLayer(layer);
  LayerPart p[2] = {};
  CHECK(Splits(layer, p));
  CHECK_NEAR(p[0].Near, whole.Near, 0.01);
  CHECK_NEAR(p[1].Far, whole.Far, 0.01);
  CHECK_NEAR(p[1].Near - p[0].Far, 0.0, 0.01);
  // Layers that are full are split as well.
  CHECK(Splits({ { 0.7, 5.0 }, { 0.56, 6.0 } }));
  CHECK(Splits({ { 0.7, 5.0 }, { 0.3, 6.0 } }));
}

/// Depths and sums as the raster has them, in float: a floor with a light splat far in front of it
/// is not two.
TEST_CASE("Rounding")
{
  Random random(8);
  int splits = 0;
  for (int i = 0; i < 2000; ++i)
  {
    const float away = std::exp(static_cast<float>(random.Uniform(0.0, 9.0)));
    const float near = away - static_cast<float>(random.Uniform(0.0, 3.0));
    float weight = 1e-5f, depth = weight * near, powers[4] = {};
    for (int k = 0; k < 400; ++k)
    {
      const float z = away + 0.0025f * static_cast<float>(k) + 1e-4f, d = z - near;
      const float w = 0.002f;
      weight += w;
      depth += w * z;
      powers[0] += w * d;
      powers[1] += w * d * d;
      powers[2] += w * d * d * d;
      powers[3] += w * d * d * d * d;
    }
    LayerPart p[2] = {};
    const LayerDepths floor{ weight, depth / weight, powers[0], powers[1], powers[2], powers[3],
      1e-3f };
    splits += Splits(floor, p) ? 1 : 0;
  }
  CHECK(splits == 0);
}

TEST_CASE("Numbers")
{
  const auto scaled = [](double scale, double away) {
    LayerPart p[2] = {};
    const bool splits =
      Splits(DepthsOf({ { 0.3, scale * away }, { 0.5, scale * (away + 1.0) } }, scale * Half), p);
    for (int k = 0; splits && k < 2; ++k)
    {
      CHECK(std::isfinite(p[k].Near));
      CHECK(std::isfinite(p[k].Far));
      CHECK(p[k].Weight > 0.0f);
    }
    return splits;
  };
  for (const double scale : { 1e-6, 1.0, 1e6 })
  {
    CHECK(scaled(scale, 2.0));
  }
  for (const double scale : { 1e-30, 1e-20, 1e-12, 1e-9, 1e9, 1e12, 1e20, 1e30 })
  {
    scaled(scale, 2.0);
  }
  // So far away that the distance of the two is rounding.
  CHECK(scaled(1.0, 1e3));
  CHECK(!scaled(1.0, 1e5));
}

/// Two blurred walls with holes, one behind the other, and, with a bridge, steep surfels of hardly
/// any weight between them.
Picture Walls(bool bridge)
{
  SplatContext context;
  context.Camera = PinholeView(128, 96, 120.0);
  context.Optics = { 0.5, 1.0 };
  TestCloud cloud;
  for (const double z : { 2.0, 2.4 })
  {
    const double side = 0.02 * z;
    for (int j = -60; j < 60; ++j)
    {
      for (int i = -75; i < 75; ++i)
      {
        cloud.Add(SquareSurfel({ (i + 0.5) * side, (j + 0.5) * side, z }, side, 0.35));
      }
    }
  }
  for (int k = 0; bridge && k < 8; ++k)
  {
    const double z = 2.0 + 0.05 * k, side = 0.04 * z;
    for (int j = -30; j < 30; ++j)
    {
      for (int i = -37; i < 37; ++i)
      {
        TestSurfel s = SquareSurfel({ (i + 0.5) * side, (j + 0.5) * side, z }, side, 0.01);
        s.Normal = { 0.96, 0.0, -0.28 };
        s.SigmaU = s.SigmaV = 0.04;
        cloud.Add(s);
      }
    }
  }
  return RenderPicture(context, cloud);
}

TEST_CASE("Bridge")
{
  const Picture with = Walls(true), without = Walls(false);
  std::printf("walls: alpha %.3f, with a bridge %.3f\n", without.At(64, 48, 3), with.At(64, 48, 3));
  CHECK(std::abs(with.At(64, 48, 3) - without.At(64, 48, 3)) < 0.04); // one layer: 0.083
}
}
