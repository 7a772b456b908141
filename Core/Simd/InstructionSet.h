// SPDX-License-Identifier: BSD-3-Clause
/**
 * What the processor can do, for the kernels that are compiled once per instruction set.
 */
#pragma once

namespace SurfelSplatting
{
enum class InstructionSet
{
  Baseline,
  AVX2,
  AVX512
};

inline InstructionSet DetectInstructionSet()
{
#ifdef SURFELSPLATTING_X86_TARGETS
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
    __builtin_cpu_supports("avx512dq"))
  {
    return InstructionSet::AVX512;
  }
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
  {
    return InstructionSet::AVX2;
  }
#endif
  return InstructionSet::Baseline;
}
}
