// SPDX-License-Identifier: BSD-3-Clause
/**
 * The checksum CRC-32C (Castagnoli, Braeuer and Herrmann 1993; RFC 3720, appendix B.4).
 */
#pragma once

#include <cstddef>
#include <cstdint>

namespace SurfelSplatting
{
/// Checksum of bytes; or, with the checksum of those before, of all of them.
std::uint32_t Checksum(const void* data, std::size_t bytes, std::uint32_t before = 0);

/// The same without an instruction for it.
std::uint32_t ChecksumByTable(const void* data, std::size_t bytes, std::uint32_t before = 0);
}
