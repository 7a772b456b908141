// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Readers/Captures/GzipStream.h"

#include "vtk_zlib.h"

#include <algorithm>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

namespace PointCloud
{
struct GzipStream::State
{
  z_stream Stream = {};
  std::vector<char> Input = std::vector<char>(1 << 16); // bytes that were read ahead
  std::uint64_t Inflated = 0;                           // bytes so far
  bool HasEnded = false;

  State()
  {
    constexpr int onlyGzip = 16;
    if (inflateInit2(&this->Stream, onlyGzip + MAX_WBITS) != Z_OK)
    {
      throw std::bad_alloc();
    }
  }
  ~State() { inflateEnd(&this->Stream); }
  State(const State&) = delete;
  void operator=(const State&) = delete;

  [[noreturn]] void Fail(const std::string& what) const
  {
    throw std::runtime_error("its gzip stream " + what + " after " +
      std::to_string(this->Inflated) + " inflated bytes; copy or download the file again.");
  }

  void ReadAhead(std::istream& file)
  {
    file.read(this->Input.data(), static_cast<std::streamsize>(this->Input.size()));
    this->Stream.next_in = reinterpret_cast<Bytef*>(this->Input.data());
    this->Stream.avail_in = static_cast<uInt>(file.gcount());
    if (this->Stream.avail_in == 0)
    {
      this->Fail("is cut short");
    }
  }

  /// Inflates some bytes, perhaps none.
  std::size_t Step(std::uint8_t* to, std::size_t count)
  {
    constexpr std::size_t most = 1 << 30; // zlib counts in 32 bits
    this->Stream.next_out = to;
    this->Stream.avail_out = static_cast<uInt>(std::min(count, most));
    const int result = inflate(&this->Stream, Z_NO_FLUSH);
    const auto inflated = static_cast<std::size_t>(this->Stream.next_out - to);
    this->Inflated += inflated;
    if (result == Z_MEM_ERROR)
    {
      throw std::bad_alloc();
    }
    // Z_BUF_ERROR: it needs more input.
    if (result != Z_OK && result != Z_STREAM_END && result != Z_BUF_ERROR)
    {
      this->Fail(std::string("is damaged (") +
        (this->Stream.msg ? this->Stream.msg : "it needs a dictionary") + ")");
    }
    this->HasEnded = result == Z_STREAM_END;
    return inflated;
  }
};

GzipStream::GzipStream()
  : Inflating(std::make_unique<State>())
{
}

GzipStream::~GzipStream() = default;

std::size_t GzipStream::Read(std::istream& file, std::uint8_t* to, std::size_t count)
{
  State& state = *this->Inflating;
  std::size_t done = 0;
  while (done < count && !state.HasEnded)
  {
    if (state.Stream.avail_in == 0)
    {
      state.ReadAhead(file);
    }
    done += state.Step(to + done, count - done);
  }
  return done;
}
}
