// SPDX-License-Identifier: BSD-3-Clause
/**
 * Functions that are compiled twice; the loader takes what the processor has.
 */
#pragma once

/// Before a function whose loops are over floats in arrays. Not for sanitizers, which are not up
/// when the loader decides.
#if defined(__x86_64__) && defined(__ELF__) && defined(__GNUC__) && !defined(__clang__) && \
  !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define SURFEL_MULTIVERSION __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define SURFEL_MULTIVERSION
#endif
