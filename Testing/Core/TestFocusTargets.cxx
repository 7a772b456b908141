// SPDX-License-Identifier: BSD-3-Clause
/**
 * Captures in focus have loops of their own (GaussiansInFocus.h). Of every instruction set that
 * this machine has, they must do what those do that tiles with open layers need.
 */
#include "Core/Lens/GaussianFootprint.h"
#include "TargetUnderTest.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"
#include "TileUnderTest.h"

#include <cmath>

using namespace SurfelSplatting;

namespace
{
/// @param absorbs its weight is an optical depth
Splat RandomInFocus(Random& random, bool absorbs)
{
  Splat s{};
  const double wide = std::pow(10.0, random.Uniform(0.0, 1.0));
  s.A = static_cast<float>(random.Uniform(1.0, 8.0) / (wide * wide));
  s.B = static_cast<float>(1.0 / (wide * wide));
  s.K = static_cast<float>(random.Uniform(-1.0, 1.0));
  s.Weight = static_cast<float>(random.Uniform(0.05, absorbs ? 5.0 : 1.3));
  s.Opacity = absorbs ? 1.0f : 0.0f;
  s.Shape = -1.0f;
  s.DepthX = static_cast<float>(random.Uniform(LeastGaussianReach, LargestGaussianReach));
  s.Red = static_cast<float>(random());
  s.Green = static_cast<float>(random());
  s.Blue = static_cast<float>(random());
  s.Gradient = InSpace;
  return s;
}

/// A tile of which a prop hides a part, from the depth 200 on.
std::unique_ptr<PixelTile> TileBehindProp()
{
  auto tile = EmptyTile();
  for (int b = 0; b < BlocksPerTile; b += 3)
  {
    std::fill_n(tile->Finished[b].OccluderDepth, PixelsPerBlock / 2, 200.0f);
  }
  return tile;
}

void CompareTiles(const PixelTile& a, const PixelTile& b)
{
  constexpr double rounding = 1e-6; // of about a hundred sums of values up to 1
  for (int i = 0; i < BlocksPerTile; ++i)
  {
    const FinishedLayers &x = a.Finished[i], &y = b.Finished[i];
    for (int l = 0; l < PixelsPerBlock; ++l)
    {
      CHECK_NEAR(x.Transmittance[l], y.Transmittance[l], rounding);
      CHECK_NEAR(x.Red[l], y.Red[l], rounding);
      CHECK_NEAR(x.Green[l], y.Green[l], rounding);
      CHECK_NEAR(x.Blue[l], y.Blue[l], rounding);
      CHECK(x.Depth[l] == y.Depth[l]);
    }
  }
}

void TestLoops(const RasterTarget& target)
{
  Random random(31);
  RasterSettings settings{ 5.0f, 1e30f };
  settings.ShortCuts = true;
  const auto own = TileBehindProp(), general = TileBehindProp();
  for (int i = 0; i < 400; ++i)
  {
    Splat s = RandomInFocus(random, random() < 0.3);
    s.Near = s.Far = 1.0f + static_cast<float>(i);
    const auto at = [&] { return static_cast<float>(random.Uniform(-8.0, 32.0)); };
    const TilePlace place{ { 0, 0, TileSize, TileSize }, at(), at() };
    settings.HasLayers = false;
    const std::uint64_t added = target.AddGaussian(*own, s, nullptr, place, settings, Nobody);
    settings.HasLayers = true;
    CHECK(added == target.AddGaussian(*general, s, nullptr, place, settings, Nobody));
  }
  CompareTiles(*own, *general);
  CHECK(own->Opaque == general->Opaque);
  CHECK(own->Opaque != 0);
  CHECK(~own->Opaque != 0);
}

const RasterTarget* const Targets[] = { &RasterTargetBaseline,
#ifdef SURFELSPLATTING_X86_TARGETS
  &RasterTargetAVX2, &RasterTargetAVX512
#endif
};
}

/// The program's argument is baseline, avx2 or avx512.
TEST_CASE("Gaussians in focus")
{
  if (const RasterTarget* target = TargetUnderTest(Targets))
  {
    TestLoops(*target);
  }
}
