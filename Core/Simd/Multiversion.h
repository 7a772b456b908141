// SPDX-License-Identifier: BSD-3-Clause
/**
 * Compiles functions several times: with AVX-512, with AVX2, and without. The loader picks the one
 * for the processor.
 */
#pragma once

/// Goes before a function with loops over arrays of floats. Off for sanitizers, which are not ready
/// when the loader decides.
#if defined(__x86_64__) && defined(__ELF__) && defined(__GNUC__) && !defined(__clang__) && \
  !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define SURFEL_MULTIVERSION \
  __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define SURFEL_MULTIVERSION
#endif

/// Also goes before it if the loops are in functions that it calls: these become part of it.
#if defined(__GNUC__)
#define SURFEL_FLATTEN __attribute__((flatten))
#else
#define SURFEL_FLATTEN
#endif
