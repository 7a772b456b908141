// SPDX-License-Identifier: BSD-3-Clause
/**
 * A picture by several ranks is the picture by one, bit by bit: sharp and blurred, translucent, on
 * coarse grids, through cells and sectors of the lens, with ranks that have nothing. A rank that
 * fails stops all of them, and none waits for it.
 */
#include "Core/Base/MemoryGuard.h"
#include "Core/Base/Tiles.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"
#include "ThreadRanks.h"

#include <atomic>
#include <exception>
#include <limits>
#include <new>

using namespace SurfelSplatting;

namespace
{
constexpr int Width = 230, Height = 190;

/// A wall, a sheet that cuts through it, and translucent surfels before them.
TestCloud MakeCloud(std::uint64_t seed, int count)
{
  Random random(seed);
  TestCloud cloud;
  for (int i = 0; i < count; ++i)
  {
    TestSurfel s;
    const double z = i % 3 == 0 ? 3.0 : i % 3 == 1 ? random.Uniform(1.5, 6.0) : 1.2;
    s.Position = { random.Uniform(-1, 1) * z, random.Uniform(-1, 1) * z, z };
    s.Normal = i % 3 == 1 ? random.Direction() : Vector3{ 0, 0, -1 };
    s.SigmaU = s.SigmaV = random.Uniform(0.01, 0.03) * z;
    s.Area = 8.0 * s.SigmaU * s.SigmaV;
    s.Opacity = i % 3 == 2 ? 0.3f : 1.0f;
    s.Color = { { static_cast<float>(random.Uniform(0, 1)),
      static_cast<float>(random.Uniform(0, 1)), 0.1f, 1.0f } };
    s.TwoSided = true;
    s.Overlap = random.Integer(0, 255); // these come out of the order of their near depths
    cloud.Add(s);
  }
  return cloud;
}

/// Each rank has every so-and-so-many-th cloud; the picture is rank 0's.
Picture RenderOnRanks(const SplatContext& context, const std::vector<SurfelCloud>& clouds,
  int ranks, const float* limit = nullptr)
{
  Picture result(Width, Height);
  ThreadRanks::Run(ranks, [&](Ranks& group) {
    const std::size_t n = clouds.size(), size = static_cast<std::size_t>(ranks);
    const std::size_t rank = static_cast<std::size_t>(group.Rank());
    const std::vector<SurfelCloud> ownClouds(
      clouds.begin() + static_cast<std::ptrdiff_t>(rank * n / size),
      clouds.begin() + static_cast<std::ptrdiff_t>((rank + 1) * n / size));
    SplatExchange exchange(group);
    Splatter splatter;
    Picture other(Width, Height);
    const Frame frame = group.IsRoot() ? result.Get() : other.Get();
    RenderTarget target = frame;
    target.OccluderDepth = limit;
    target.Exchange = &exchange;
    splatter.Render(context, ownClouds, SerialExecutor(), target);
  });
  return result;
}

SplatContext MakeContext(double confusion)
{
  SplatContext context = TestContext();
  context.Camera = PinholeView(Width, Height, 200.0);
  context.Optics = { confusion * 2.0 / 200.0, 2.0 };
  context.SkipHidden = false; // what is skipped depends on what comes first
  return context;
}

TEST_CASE("Same picture")
{
  const TestCloud first = MakeCloud(1, 3000), second = MakeCloud(2, 5000), none;
  const TestHierarchy third(MakeCloud(3, 4000));
  const std::vector<SurfelCloud> clouds = { first.Get(), second.Get(), none.Get(), third.Get() };
  std::vector<float> limit(static_cast<std::size_t>(Width) * Height);
  for (std::size_t i = 0; i < limit.size(); ++i)
  {
    limit[i] = i % Width < 100 ? 2.0f : std::numeric_limits<float>::infinity();
  }
  for (const double confusion : { 0.0, 4.0, 12.0, 60.0 })
  {
    for (const int cells : { 1, 7 })
    {
      SplatContext context = MakeContext(confusion);
      context.Sampling.Count = cells;
      const Picture serial = RenderPicture(context, clouds, SerialExecutor(), limit.data());
      for (const int ranks : { 1, 2, 3, 4 })
      {
        CHECK(Same(RenderOnRanks(context, clouds, ranks, limit.data()), serial));
      }
    }
  }
}

/// More ranks than rows of tiles, and a picture without any surfels.
TEST_CASE("Idle ranks")
{
  const TestCloud cloud = MakeCloud(1, 3000), none;
  const SplatContext context = MakeContext(4.0);
  CHECK(Same(RenderOnRanks(context, { cloud.Get() }, 9), RenderPicture(context, { cloud.Get() })));
  CHECK(Same(RenderOnRanks(context, { none.Get() }, 3), RenderPicture(context, { none.Get() })));
}

/// Skipping hidden splats moves pictures by at most 1/512 of what is behind.
TEST_CASE("Hidden surfels")
{
  const TestHierarchy near(MakeCloud(3, 20000)), far(MakeCloud(4, 20000));
  SplatContext context = MakeContext(4.0);
  context.SkipHidden = true;
  const std::vector<SurfelCloud> clouds = { near.Get(), far.Get() };
  const Picture serial = RenderPicture(context, clouds), ranks = RenderOnRanks(context, clouds, 2);
  float largest = 0.0f;
  for (std::size_t i = 0; i < serial.Color.size(); ++i)
  {
    largest = std::max(largest, std::fabs(serial.Color[i] - ranks.Color[i]));
  }
  CHECK(largest <= 1.0f / 512.0f);
}

/// Counts its calls, and fails in one of them.
template <typename Problem>
class FailingExecutor : public SerialExecutor
{
public:
  FailingExecutor(const Problem& problem, int failing)
    : What(problem)
    , Failing(failing)
  {
  }
  void For(std::size_t size, std::size_t grain, const RangeFunction& function) const override
  {
    if (this->Calls++ == this->Failing)
    {
      throw this->What;
    }
    SerialExecutor::For(size, grain, function);
  }
  mutable int Calls = 0;

private:
  Problem What;
  int Failing;
};

struct Failures
{
  int Ranks = 0; ///< of the three ranks, how many threw the problem that one of them has
  int Calls = 0; ///< of the executor of that rank
};

/// A small picture, of a row of tiles for each rank, through cells of the lens, in part, and with
/// coarse grids.
template <typename Problem>
Failures CountFailures(const Problem& problem, int failing)
{
  constexpr int size = 3 * TileSize;
  const TestCloud cloud = MakeCloud(1, 500);
  SplatContext context = MakeContext(30.0);
  context.Camera = PinholeView(size, size, 200.0);
  context.Sampling.Count = 7;
  std::atomic<int> failed{ 0 }, calls{ 0 };
  ThreadRanks::Run(3, [&](Ranks& group) {
    SplatExchange exchange(group);
    Splatter splatter;
    Picture picture(size, size);
    const FailingExecutor<Problem> executor(problem, group.Rank() == 1 ? failing : -1);
    try
    {
      RenderTarget target = picture.Get();
      target.Exchange = &exchange;
      splatter.Render(context, { cloud.Get() }, executor, target);
    }
    catch (const Problem&)
    {
      ++failed;
    }
    catch (const std::exception&)
    {
    }
    calls += group.Rank() == 1 ? executor.Calls : 0;
  });
  return { failed, calls };
}

/// Memory may lack at each step of a picture; a file is read only where splats are made.
TEST_CASE("Failure")
{
  const Failures none = CountFailures(std::bad_alloc(), -1);
  CHECK(none.Ranks == 0);
  CHECK(none.Calls > 7 * 8); // of each cell: splats, messages, raster
  for (int call = 0; call < none.Calls; ++call)
  {
    CAPTURE(call);
    CHECK(CountFailures(std::bad_alloc(), call).Ranks == 3);
  }
  CHECK(CountFailures(DamagedMemory("a file is damaged"), 0).Ranks == 3);
}

TEST_CASE("Agreement")
{
  bool all[2] = { true, true }, any[2] = { false, false };
  double largest[3] = {}, root[3] = {};
  ThreadRanks::Run(3, [&](Ranks& group) {
    const bool isLast = group.Rank() == 2;
    const bool none = group.Any(false), one = group.Any(isLast);
    const bool most = group.All(!isLast), every = group.All(true);
    const double value = group.Largest(group.Rank() == 1 ? 7.5 : -1.0);
    const double first = group.RootValue(group.Rank() + 3.0);
    if (isLast)
    {
      all[0] = most;
      all[1] = every;
      any[0] = none;
      any[1] = one;
    }
    largest[group.Rank()] = value;
    root[group.Rank()] = first;
  });
  CHECK(!all[0]);
  CHECK(all[1]);
  CHECK(!any[0]);
  CHECK(any[1]);
  for (int rank = 0; rank < 3; ++rank)
  {
    CHECK(largest[rank] == 7.5);
    CHECK(root[rank] == 3.0);
  }
}
}
