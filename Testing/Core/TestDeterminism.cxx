// SPDX-License-Identifier: BSD-3-Clause
/**
 * The same frame, bit for bit, at any number of threads, in any order of the pieces of work, and
 * every time.
 */
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <new>

#include <pthread.h>

using namespace SurfelSplatting;

namespace
{
/// Enough surfels for several chunks of every stage; equal near depths, where ties must be broken
/// alike.
TestCloud MakeCloud()
{
  Random random(4);
  TestCloud cloud;
  for (int i = 0; i < 30000; ++i)
  {
    TestSurfel s;
    const double z = i % 2 ? 2.0 : random.Uniform(1.0, 3.0);
    s.Position = { random.Uniform(-1, 1) * z, random.Uniform(-1, 1) * z, z };
    s.Normal = i % 2 ? Vector3{ 0, 0, -1 } : random.Direction();
    s.SigmaU = random.Uniform(0.002, 0.02);
    s.SigmaV = i % 2 ? s.SigmaU : 0.01;
    s.Area = 4.0 * s.SigmaU * s.SigmaV;
    s.Opacity = static_cast<float>(random.Uniform(0.2, 1.0));
    s.Color = { { static_cast<float>(random.Uniform(0, 1)), 0.5f, 0.1f, 1.0f } };
    s.TwoSided = true;
    cloud.Add(s);
  }
  return cloud;
}
}

/// An exception of any thread reaches the caller, after all of them have come back.
TEST_CASE("Exceptions")
{
  for (unsigned int threads : { 1u, 2u, 8u })
  {
    bool caught = false;
    try
    {
      ThreadExecutor(threads).For(1000, 1, [](std::size_t begin, std::size_t) {
        if (begin == 500)
        {
          throw std::bad_alloc();
        }
      });
    }
    catch (const std::bad_alloc&)
    {
      caught = true;
    }
    CHECK(caught);
  }
}

/// Where the system starts no more threads, those that there are do the work.
TEST_CASE("No more threads")
{
  pthread_attr_t before, huge;
  REQUIRE(pthread_getattr_default_np(&before) == 0);
  pthread_attr_init(&huge);
  REQUIRE(pthread_attr_setstacksize(&huge, std::size_t(1) << 50) == 0);
  REQUIRE(pthread_setattr_default_np(&huge) == 0);
  std::vector<int> done(1000, 0);
  ThreadExecutor(8).For(done.size(), 10, [&done](std::size_t begin, std::size_t end) {
    std::fill(done.begin() + begin, done.begin() + end, 1);
  });
  pthread_setattr_default_np(&before);
  pthread_attr_destroy(&huge);
  pthread_attr_destroy(&before);
  CHECK(std::count(done.begin(), done.end(), 1) == 1000);
}

TEST_CASE("Threads and order of work")
{
  const TestCloud cloud = MakeCloud();
  const std::vector<SurfelCloud> clouds(2, cloud.Get());
  SplatContext context = TestContext();
  context.Camera = PinholeView(193, 130, 100.0);
  context.Optics = { 0.03, 2.0 };
  const Picture expected = RenderPicture(context, clouds);
  CHECK(SumOfAlpha(expected) > 0.5 * 193 * 130); // a picture of something
  CHECK(Same(expected, RenderPicture(context, clouds)));
  CHECK(Same(expected, RenderPicture(context, clouds, BackwardExecutor())));
  for (unsigned int threads : { 1u, 2u, 3u, 8u })
  {
    for (int repeat = 0; repeat < 3; ++repeat)
    {
      CHECK(Same(expected, RenderPicture(context, clouds, ThreadExecutor(threads))));
    }
  }

  // A Splatter that has rendered something else before.
  Splatter splatter;
  Picture picture(193, 130);
  splatter.Render(context, { clouds[0] }, SerialExecutor(), picture.Get());
  splatter.Render(context, clouds, ThreadExecutor(3), picture.Get());
  CHECK(Same(expected, picture));
}
