// SPDX-License-Identifier: BSD-3-Clause
/**
 * Compiles functions twice, with and without AVX2; the loader picks the one for the processor. And
 * what else depends on compiler and processor.
 */
#pragma once

/// Goes before a function with loops over arrays of floats. Off for sanitizers, which are not ready
/// when the loader decides.
#if defined(__x86_64__) && defined(__ELF__) && defined(__GNUC__) && !defined(__clang__) && \
  !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define SURFEL_MULTIVERSION __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define SURFEL_MULTIVERSION
#endif

/// Starts loading the data at an address that will be read soon.
#if defined(__GNUC__)
#define SURFEL_PREFETCH(address) __builtin_prefetch(address)
#else
#define SURFEL_PREFETCH(address) static_cast<void>(address)
#endif
