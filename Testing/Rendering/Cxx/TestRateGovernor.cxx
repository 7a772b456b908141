// SPDX-License-Identifier: BSD-3-Clause
/**
 * The coarsening that holds a frame rate, from loads of made-up frames: no window is needed.
 */
#include "Rendering/Scene/RateGovernor.h"
#include "Testing/Shared/Check.h"

using SurfelSplatting::RateGovernor;

TEST_SUITE_BEGIN("RateGovernor");

namespace
{
/// Draws frames whose load is `fixed` plus `splats` at coarsening 1, until the load is steady.
double Settle(RateGovernor& governor, double fixed, double splats, bool hasProps = false)
{
  double load = 0.0;
  for (int frame = 0; frame < 40; ++frame)
  {
    const double c = governor.Coarsening();
    load = fixed + splats / (c * c);
    governor.AddInteractiveFrame(load, c, hasProps);
  }
  return load;
}
}

TEST_CASE("Fast frames are not coarsened")
{
  RateGovernor governor;
  CHECK(governor.Coarsening() == 1.0);
  CHECK(Settle(governor, 0.1, 0.8) == 0.9);
  CHECK(governor.Coarsening() == 1.0);
}

TEST_CASE("Slow frames reach the rate")
{
  RateGovernor governor;
  const double load = Settle(governor, 0.2, 8.0);
  CHECK(load <= 1.0);
  CHECK(load >= 0.7);
  CHECK(governor.Coarsening() > 3.0);
}

TEST_CASE("One step doubles at most")
{
  RateGovernor governor;
  governor.AddInteractiveFrame(1000.0, 1.0, false);
  CHECK(governor.Coarsening() == 2.0);
  governor.AddInteractiveFrame(1000.0, 2.0, false);
  CHECK(governor.Coarsening() == 4.0);
}

TEST_CASE("Coarsening ends at its largest")
{
  RateGovernor governor;
  Settle(governor, 2.0, 1.0);
  CHECK(governor.Coarsening() == RateGovernor::MaxCoarsening);
}

TEST_CASE("Useless coarsening is taken back")
{
  // The pixels of props take all of the time: twice as coarse is as slow.
  RateGovernor governor;
  governor.AddInteractiveFrame(4.0, 1.0, true);
  const double first = governor.Coarsening();
  CHECK(first == 2.0);
  governor.AddInteractiveFrame(4.0, first, true);
  CHECK(governor.Coarsening() == 1.0);
  Settle(governor, 4.0, 0.0, true);
  CHECK(governor.Coarsening() == 1.0);
  // A still frame may show another scene: coarsening is tried again.
  governor.AddStillFrame();
  governor.AddInteractiveFrame(4.0, 1.0, true);
  CHECK(governor.Coarsening() == 2.0);
}

TEST_CASE("Detail comes back")
{
  RateGovernor governor;
  Settle(governor, 0.1, 20.0);
  const double coarse = governor.Coarsening();
  governor.AddStillFrame();
  CHECK(governor.Coarsening() == coarse);
  Settle(governor, 0.01, 0.1);
  CHECK(governor.Coarsening() == 1.0);
}

TEST_SUITE_END();
