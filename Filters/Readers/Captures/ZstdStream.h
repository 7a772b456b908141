// SPDX-License-Identifier: BSD-3-Clause
/**
 * Frames of zstd (RFC 8878), one after the other up to the end of the file, as one stream. Frames
 * need not have checksums: most damage of values is not found.
 */
#pragma once

#include "Filters/Readers/Captures/CompressedStream.h"

#include <memory>

namespace PointCloud
{
class ZstdStream : public CompressedStream
{
public:
  /// Throws std::bad_alloc, and std::runtime_error if the module was built without libzstd.
  ZstdStream();
  ~ZstdStream() override;

  std::size_t Read(std::istream& file, std::uint8_t* to, std::size_t count) override;

private:
  struct State;
  std::unique_ptr<State> Unpacking;
};
}
