// SPDX-License-Identifier: BSD-3-Clause
/**
 * A gzip stream (RFC 1952).
 */
#pragma once

#include "Filters/Readers/Captures/CompressedStream.h"

#include <memory>

namespace PointCloud
{
class GzipStream : public CompressedStream
{
public:
  /// Throws std::bad_alloc.
  GzipStream();
  ~GzipStream() override;

  /// Whether these first two bytes of a file are those of a gzip stream.
  static bool Has(const char* bytes) { return bytes[0] == '\x1f' && bytes[1] == '\x8b'; }

  /// Ends where its checksum is right. What follows the stream in the file is not read.
  std::size_t Read(std::istream& file, std::uint8_t* to, std::size_t count) override;

private:
  struct State;
  std::unique_ptr<State> Inflating;
};
}
