// SPDX-License-Identifier: BSD-3-Clause
/**
 * A gzip stream (RFC 1952), inflated piece by piece: nothing is allocated for what it claims to
 * hold.
 */
#pragma once

#include <cstddef>
#include <cstdint>
#include <istream>
#include <memory>

namespace PointCloud
{
class GzipStream
{
public:
  /// Throws std::bad_alloc.
  GzipStream();
  ~GzipStream();
  GzipStream(GzipStream&&) noexcept;

  /// Whether these first two bytes of a file are those of a gzip stream.
  static bool Has(const char* bytes) { return bytes[0] == '\x1f' && bytes[1] == '\x8b'; }

  /**
   * Inflates the next bytes of the stream that the file holds. The file is read ahead: nothing else
   * may move its position.
   * @return how many: fewer than asked for only at the end of the stream, if its checksum is right.
   *         What follows the stream in the file is not read.
   * @throw std::runtime_error that says how the stream is damaged or cut short
   */
  std::size_t Read(std::istream& file, std::uint8_t* to, std::size_t count);

private:
  struct State;
  std::unique_ptr<State> Inflating;
};
}
