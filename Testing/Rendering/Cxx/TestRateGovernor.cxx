// SPDX-License-Identifier: BSD-3-Clause
/**
 * The coarsening that holds a frame rate, from loads of made-up frames: no window is needed.
 */
#include "Rendering/Scene/RateGovernor.h"
#include "Testing/Shared/Check.h"

#include <initializer_list>

using SurfelSplatting::RateGovernor;

TEST_SUITE_BEGIN("RateGovernor");

namespace
{
/// A scene: load of a frame at a coarsening.
struct Cost
{
  double Fixed, Splats; ///< at coarsening 1
  double Least = 1.0;   ///< coarsening up to which nothing is saved
  double At(double c) const
  {
    const double useful = c > this->Least ? c / this->Least : 1.0;
    return this->Fixed + this->Splats / (useful * useful);
  }
};

struct Run
{
  double Load = 0.0;
  int Changes = 0; ///< of the coarsening
};

/// Draws frames of a scene; each takes up to `noise` longer.
Run Draw(RateGovernor& governor, const Cost& cost, int frames = 80, double noise = 0.0)
{
  Run run;
  unsigned int seed = 1;
  for (int frame = 0; frame < frames; ++frame)
  {
    const double c = governor.Coarsening();
    run.Load = cost.At(c);
    seed = seed * 1664525u + 1013904223u;
    governor.AddInteractiveFrame(run.Load * (1.0 + noise * (seed >> 8) / 16777216.0), c);
    run.Changes += governor.Coarsening() != c ? 1 : 0;
  }
  return run;
}
}

TEST_CASE("Fast frames are not coarsened")
{
  RateGovernor governor;
  CHECK(governor.Coarsening() == 1.0);
  CHECK(Draw(governor, { 0.1, 0.8 }).Changes == 0);
  CHECK(governor.Coarsening() == 1.0);
}

TEST_CASE("Slow frames reach the rate")
{
  RateGovernor governor;
  const double load = Draw(governor, { 0.2, 8.0 }).Load;
  CHECK(load <= 1.0);
  CHECK(load >= 0.7);
  CHECK(governor.Coarsening() > 3.0);
}

TEST_CASE("A resting camera does not flicker")
{
  for (const Cost& cost : { Cost{ 0.2, 8.0 }, Cost{ 0.9, 0.5 }, Cost{ 0.99, 0.12 },
         Cost{ 3.0, 20.0 }, Cost{ 4.0, 0.0 }, Cost{ 0.0, 300.0 } })
  {
    RateGovernor governor;
    Draw(governor, cost, 80, 0.1);
    CHECK(Draw(governor, cost, 1000, 0.1).Changes == 0);
  }
}

TEST_CASE("One step doubles at most")
{
  RateGovernor governor;
  for (const double expected : { 1.0, 2.0, 2.0, 4.0 })
  {
    governor.AddInteractiveFrame(1000.0 / governor.Coarsening(), governor.Coarsening());
    CHECK(governor.Coarsening() == expected);
  }
}

TEST_CASE("Coarsening ends at its largest")
{
  RateGovernor governor;
  Draw(governor, { 0.0, 1e6 });
  CHECK(governor.Coarsening() == RateGovernor::MaxCoarsening);
}

TEST_CASE("Useless coarsening is taken back")
{
  // Other work takes all of the time: coarser frames are as slow.
  RateGovernor governor;
  CHECK(Draw(governor, { 4.0, 0.0 }).Changes == 2); // one trial
  CHECK(governor.Coarsening() == 1.0);
  CHECK(Draw(governor, { 4.0, 0.0 }, 1000).Changes == 0);
  // A still frame may show another scene: coarsening is tried again.
  governor.AddStillFrame();
  governor.AddInteractiveFrame(4.0, 1.0);
  governor.AddInteractiveFrame(4.0, 1.0);
  CHECK(governor.Coarsening() == 2.0);
}

TEST_CASE("Coarsening ends where it saves little")
{
  // The rate is out of reach: a frame of 2 is the fastest, and 2.2 is nearly as fast.
  RateGovernor governor;
  Draw(governor, { 2.0, 3.0 });
  CHECK(governor.Coarsening() < 5.0);
  CHECK(Cost{ 2.0, 3.0 }.At(governor.Coarsening()) < 2.5);
}

TEST_CASE("The finest of equally slow frames is drawn")
{
  // Coarse because of a slow scene; then another one comes, whose time does not depend on it.
  RateGovernor governor;
  Draw(governor, { 0.0, 200.0 });
  CHECK(governor.Coarsening() > 8.0);
  for (const Cost& cost : { Cost{ 3.0, 0.0 }, Cost{ 0.5, 0.0 } })
  {
    RateGovernor copy = governor;
    Draw(copy, cost);
    CHECK(copy.Coarsening() == 1.0);
  }
  // Only up to 4 it is free to be finer.
  Draw(governor, { 2.0, 1.0, 4.0 });
  Draw(governor, { 0.95, 0.04, 4.0 });
  CHECK(governor.Coarsening() == 1.0);
}

TEST_CASE("A change of the scene is noticed")
{
  RateGovernor governor;
  Draw(governor, { 4.0, 0.0 });
  CHECK(governor.Coarsening() == 1.0);
  CHECK(Draw(governor, { 0.1, 10.0 }).Load <= 1.0);
  CHECK(governor.Coarsening() > 3.0);
}

TEST_CASE("Frames of another coarsening say nothing")
{
  RateGovernor governor;
  for (int i = 0; i < 10; ++i)
  {
    governor.AddInteractiveFrame(100.0, 4.0);
  }
  CHECK(governor.Coarsening() == 1.0);
}

TEST_CASE("Detail comes back")
{
  RateGovernor governor;
  Draw(governor, { 0.1, 20.0 });
  const double coarse = governor.Coarsening();
  CHECK(coarse > 4.0);
  governor.AddStillFrame();
  CHECK(governor.Coarsening() == coarse);
  Draw(governor, { 0.01, 0.1 });
  CHECK(governor.Coarsening() == 1.0);
}

TEST_SUITE_END();
