// SPDX-License-Identifier: BSD-3-Clause
/**
 * Which of a routine's implementations to test: one for each instruction set.
 */
#pragma once

#include "Core/Simd/InstructionSet.h"
#include "Testing/Shared/TestRun.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <string>

namespace SurfelSplatting
{
/// The implementation for the named instruction set, or null if it is not built in or this
/// processor cannot run it. @param targets in the order of InstructionSet
template <class Target, std::size_t N>
const Target* FindTarget(const std::string& name, const Target* const (&targets)[N])
{
  const char* const names[] = { "baseline", "avx2", "avx512" };
  const auto set = std::find(std::begin(names), std::end(names), name) - std::begin(names);
  const bool runs = set <= static_cast<std::ptrdiff_t>(DetectInstructionSet());
  return runs && set < static_cast<std::ptrdiff_t>(N) ? targets[set] : nullptr;
}

/// The implementation that the program's argument names. Null skips the run.
template <class Target, std::size_t N>
const Target* TargetUnderTest(const Target* const (&targets)[N])
{
  const std::string& variant = SurfelTesting::ThisRun.Variant;
  const std::string name = variant.empty() ? "baseline" : variant;
  const Target* target = FindTarget(name, targets);
  if (!target)
  {
    SurfelTesting::ThisRun.SkipReason = "this machine has no " + name;
  }
  return target;
}
}
