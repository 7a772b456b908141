// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace SurfelTesting
{
/// What a test program is run for, and whether it can be.
struct TestRun
{
  std::string Variant;    ///< kernel or instruction set: the first argument if it is no option
  std::string SkipReason; ///< if not empty, the run counts as skipped unless a check fails
};
inline TestRun ThisRun;
}
