// SPDX-License-Identifier: BSD-3-Clause
/**
 * Function multiversioning by the compiler: one source, the instruction set chosen when the library is loaded.
 * Off under sanitizers, whose runtimes are not up yet when the choice is made, and where the compiler has none.
 */
#pragma once

#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) &&                             \
  !defined(SURFELSPLATTING_NO_MULTIVERSIONING)
#define SURFELSPLATTING_MULTIVERSION                                                               \
  __attribute__((target_clones("arch=skylake-avx512", "arch=haswell", "default")))
#else
#define SURFELSPLATTING_MULTIVERSION
#endif

#if defined(__GNUC__)
#define SURFELSPLATTING_INLINE __attribute__((always_inline)) inline
#else
#define SURFELSPLATTING_INLINE inline
#endif
