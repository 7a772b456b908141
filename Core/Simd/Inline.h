// SPDX-License-Identifier: BSD-3-Clause
/**
 * Functions that are compiled once per instruction set must not be shared between them: the linker
 * would keep one copy, perhaps one that the processor cannot run. They are always inlined.
 */
#pragma once

#if defined(__GNUC__)
#define SURFELSPLATTING_INLINE __attribute__((always_inline)) inline
#else
#error "Set-up and raster use vector types of GCC and Clang."
#endif
