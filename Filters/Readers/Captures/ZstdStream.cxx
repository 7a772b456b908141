// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Readers/Captures/ZstdStream.h"

#include <new>
#include <stdexcept>
#include <string>
#include <vector>

#ifdef SURFELSPLATTING_HAS_ZSTD
#include <zstd.h>
#endif

namespace PointCloud
{
#ifdef SURFELSPLATTING_HAS_ZSTD
struct ZstdStream::State
{
  ZSTD_DStream* const Stream = ZSTD_createDStream();
  std::vector<char> Bytes = std::vector<char>(1 << 16); // that were read ahead
  ZSTD_inBuffer Input = { nullptr, 0, 0 };
  std::uint64_t Unpacked = 0; // bytes so far
  bool IsInFrame = false;

  State()
  {
    if (!this->Stream)
    {
      throw std::bad_alloc();
    }
  }
  ~State() { ZSTD_freeDStream(this->Stream); }
  State(const State&) = delete;
  void operator=(const State&) = delete;

  [[noreturn]] void Fail(const std::string& what) const
  {
    throw std::runtime_error("its zstd stream " + what + " after " +
      std::to_string(this->Unpacked) + " unpacked bytes; copy or download the file again.");
  }

  /// Returns false at the end of the file.
  bool ReadAhead(std::istream& file)
  {
    file.read(this->Bytes.data(), static_cast<std::streamsize>(this->Bytes.size()));
    this->Input = { this->Bytes.data(), static_cast<std::size_t>(file.gcount()), 0 };
    return this->Input.size > 0;
  }

  /// Unpacks some bytes, perhaps none.
  std::size_t Step(std::uint8_t* to, std::size_t count)
  {
    ZSTD_outBuffer output = { to, count, 0 };
    const std::size_t result = ZSTD_decompressStream(this->Stream, &output, &this->Input);
    this->Unpacked += output.pos;
    if (ZSTD_isError(result))
    {
      this->Fail(std::string("is damaged (") + ZSTD_getErrorName(result) + ")");
    }
    this->IsInFrame = result != 0;
    return output.pos;
  }
};

ZstdStream::ZstdStream()
  : Unpacking(std::make_unique<State>())
{
}

std::size_t ZstdStream::Read(std::istream& file, std::uint8_t* to, std::size_t count)
{
  State& state = *this->Unpacking;
  std::size_t done = 0;
  bool mayHold = state.IsInFrame; // the decoder, bytes for which there was no room before
  while (done < count)
  {
    if (state.Input.pos == state.Input.size && !mayHold && !state.ReadAhead(file))
    {
      if (state.IsInFrame)
      {
        state.Fail("is cut short");
      }
      break;
    }
    const std::size_t unpacked = state.Step(to + done, count - done);
    done += unpacked;
    mayHold = state.IsInFrame && unpacked > 0;
  }
  return done;
}
#else
struct ZstdStream::State
{
};

ZstdStream::ZstdStream()
{
  throw std::runtime_error(
    "it is compressed by zstd, which this module was built without: build it "
    "with libzstd-dev, or save the file in version 3, or as .ply, for example "
    "with SuperSplat.");
}

std::size_t ZstdStream::Read(std::istream&, std::uint8_t*, std::size_t)
{
  return 0;
}
#endif

ZstdStream::~ZstdStream() = default;
}
