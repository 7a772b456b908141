// SPDX-License-Identifier: BSD-3-Clause
/**
 * doctest, and checks within a tolerance. Test programs link SurfelSplattingTesting, which has
 * their main().
 */
#pragma once

#define DOCTEST_CONFIG_SUPER_FAST_ASSERTS // a check is one call: compiles faster
#include <doctest/doctest.h>

#include <iosfwd>

namespace SurfelTesting
{
/// Is true if |actual - expected| <= tolerance; NaN is never near.
class Near
{
public:
  Near(double actual, double expected, double tolerance)
    : Actual(actual)
    , Expected(expected)
    , Tolerance(tolerance)
  {
  }
  explicit operator bool() const;
  friend std::ostream& operator<<(std::ostream& stream, const Near& near);

private:
  double Actual, Expected, Tolerance;
};
}

#define CHECK_NEAR(actual, expected, tolerance) \
  CHECK_UNARY(SurfelTesting::Near((actual), (expected), (tolerance)))
