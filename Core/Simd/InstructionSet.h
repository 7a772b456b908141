// SPDX-License-Identifier: BSD-3-Clause
/**
 * The instruction set of the processor, for code that is compiled once per instruction set (raster
 * and set-up).
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

/// The targets compiled for each instruction set; null if not compiled.
template <class Target>
struct TargetChoice
{
  const Target* Baseline;
  const Target* AVX2 = nullptr;
  const Target* AVX512 = nullptr;

  /// The best one that this processor runs.
  const Target& Best() const
  {
    const InstructionSet best = DetectInstructionSet();
    return best == InstructionSet::AVX512 && this->AVX512 ? *this->AVX512
      : best != InstructionSet::Baseline && this->AVX2    ? *this->AVX2
                                                          : *this->Baseline;
  }
};
}
