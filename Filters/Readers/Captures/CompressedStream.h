// SPDX-License-Identifier: BSD-3-Clause
/**
 * A compressed stream in a file, unpacked piece by piece: nothing is allocated for what it claims
 * to hold.
 */
#pragma once

#include <cstddef>
#include <cstdint>
#include <istream>

namespace PointCloud
{
class CompressedStream
{
public:
  virtual ~CompressedStream() = default;

  /**
   * Unpacks the next bytes of the stream that the file holds. The file is read ahead: nothing else
   * may move its position.
   * @return how many: fewer than asked for only at the end of the stream
   * @throw std::runtime_error that says how the stream is damaged or cut short
   */
  virtual std::size_t Read(std::istream& file, std::uint8_t* to, std::size_t count) = 0;
};
}
