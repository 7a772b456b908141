// SPDX-License-Identifier: BSD-3-Clause
/**
 * Checks that count their failures and print where and with what values they failed. A test's main
 * ends with `return Checks().Report("name");`.
 */
#pragma once

#include <cmath>
#include <cstdio>

class CheckCounter
{
public:
  void Count(bool passed, const char* file, int line, const char* what)
  {
    this->Total++;
    if (!passed && ++this->Failed <= MaximumPrinted)
    {
      std::printf("%s:%d: failed: %s\n", file, line, what);
    }
  }

  /// |actual - expected| <= tolerance; NaN fails.
  void CountNear(
    double actual, double expected, double tolerance, const char* file, int line, const char* what)
  {
    this->Total++;
    if (!(std::abs(actual - expected) <= tolerance) && ++this->Failed <= MaximumPrinted)
    {
      std::printf("%s:%d: failed: %s: %.9g, expected %.9g within %.3g (off by %.3g)\n", file, line,
        what, actual, expected, tolerance, actual - expected);
    }
  }

  /// Prints the outcome; the exit code of the test. A test that checked nothing has failed.
  int Report(const char* name) const
  {
    std::printf("%s: %ld checks, %ld failed\n", name, this->Total, this->Failed);
    return this->Failed == 0 && this->Total > 0 ? 0 : 1;
  }

private:
  static constexpr long MaximumPrinted = 40;
  long Total = 0;
  long Failed = 0;
};

inline CheckCounter& Checks()
{
  static CheckCounter counter;
  return counter;
}

#define CHECK(condition) Checks().Count((condition), __FILE__, __LINE__, #condition)
#define CHECK_NEAR(actual, expected, tolerance) \
  Checks().CountNear((actual), (expected), (tolerance), __FILE__, __LINE__, #actual)
