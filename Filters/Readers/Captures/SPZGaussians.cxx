// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Readers/Captures/SPZGaussians.h"

#include "Filters/Readers/Captures/GaussianArrays.h"
#include "Filters/Readers/Captures/GzipStream.h"
#include "Filters/Readers/Captures/UnpackedGaussians.h"
#include "Filters/Readers/Captures/ZstdStream.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace PointCloud
{
namespace
{
constexpr std::size_t HeaderSize = 16, PlainHeaderSize = 32;
constexpr std::uint64_t MostExtensions = 1 << 20; // bytes
constexpr char Magic[5] = "NGSP";
constexpr unsigned HasExtensions = 2; // of the flags
constexpr const char* SaveOtherwise =
  "; save it in another version, or as .ply, for example with SuperSplat.";

[[noreturn]] void Refuse(const std::string& what)
{
  throw std::runtime_error(what);
}

[[noreturn]] void RefuseCutHeader()
{
  Refuse("its header is cut short; copy or download the file again.");
}

/// Returns how many bytes there were.
std::size_t ReadPlainBytes(std::istream& file, std::uint8_t* to, std::size_t count)
{
  file.read(reinterpret_cast<char*>(to), static_cast<std::streamsize>(count));
  return static_cast<std::size_t>(file.gcount());
}

std::uint64_t LoadLong(const std::uint8_t* at)
{
  return LoadUnsigned(at) | static_cast<std::uint64_t>(LoadUnsigned(at + 4)) << 32;
}

/// Components x y z w of a quaternion of which all but the largest are stored.
std::array<double, 4> SmallestThree(std::uint32_t packed)
{
  const std::uint32_t largest = packed >> 30;
  std::array<double, 4> q = {};
  double rest = 1.0;
  for (std::uint32_t i = 0, shift = 20; i < 4; ++i)
  {
    if (i != largest)
    {
      const std::uint32_t bits = packed >> shift;
      q[i] = (bits & 0x1ff) / 511.0 * std::sqrt(0.5) * (bits & 0x200 ? -1.0 : 1.0);
      rest -= q[i] * q[i];
      shift -= 10;
    }
  }
  q[largest] = std::sqrt(std::fmax(0.0, rest));
  return q;
}

/// The same of version 2, where w is left out.
std::array<double, 4> WithoutW(const std::uint8_t* stored)
{
  std::array<double, 4> q = {};
  double rest = 1.0;
  for (int i = 0; i < 3; ++i)
  {
    q[i] = stored[i] / 127.5 - 1.0;
    rest -= q[i] * q[i];
  }
  q[3] = std::sqrt(std::fmax(0.0, rest));
  return q;
}

double Position(const std::uint8_t* at, int fractionalBits)
{
  const std::int32_t value = at[0] | at[1] << 8 | at[2] << 16;
  return std::ldexp(value - (value >= 1 << 23 ? 1 << 24 : 0), -fractionalBits);
}
}

bool SPZGaussians::Has(std::istream& file)
{
  char first[5] = {};
  const bool isPlain = file.read(first, 4) && std::string(first) == Magic;
  const bool isGzip = GzipStream::Has(first);
  file.clear();
  file.seekg(0);
  if (isPlain || !isGzip)
  {
    return isPlain;
  }
  std::uint8_t inflated[5] = {};
  try
  {
    GzipStream().Read(file, inflated, 4);
  }
  catch (const std::runtime_error&)
  {
    // Damaged: nothing tells that it is one.
  }
  file.clear();
  file.seekg(0);
  return reinterpret_cast<const char*>(inflated) == std::string(Magic);
}

SPZGaussians::SPZGaussians(std::istream& file, std::uint64_t bytes)
  : FileBytes(bytes)
{
  std::uint8_t header[HeaderSize] = {};
  const bool isPlain = file.peek() == Magic[0];
  if (!isPlain)
  {
    this->Stream = std::make_unique<GzipStream>();
  }
  const std::size_t read = isPlain ? ReadPlainBytes(file, header, HeaderSize)
                                   : this->Stream->Read(file, header, HeaderSize);
  if (!std::equal(Magic, Magic + 4, header))
  {
    Refuse(
      "neither it nor what it has compressed begins with NGSP, as .spz files do; it is of another "
      "format.");
  }
  if (read < HeaderSize)
  {
    RefuseCutHeader();
  }
  this->Version = LoadUnsigned(header + 4);
  this->Gaussians = LoadUnsigned(header + 8);
  this->Degree = header[12];
  this->Rest = (this->Degree + 1) * (this->Degree + 1) - 1;
  this->FractionalBits = header[13];
  this->Flags = header[14];
  this->CheckVersion(isPlain);
  this->CheckHeader();
  this->SetAxes(0);
  if (isPlain)
  {
    this->ReadPlain(file, header[15]);
  }
}

void SPZGaussians::CheckVersion(bool isPlain) const
{
  const std::uint32_t version = this->Version;
  if (isPlain ? version != 4 : version != 2 && version != 3)
  {
    Refuse("a .spz file of version " + std::to_string(version) +
      (isPlain ? " that is not compressed by gzip; of these, version 4 is read"
               : ", compressed by gzip; of these, versions 2 and 3 are read") +
      SaveOtherwise);
  }
}

/// What follows the first 16 bytes of version 4 and is not compressed.
void SPZGaussians::ReadPlain(std::istream& file, unsigned streams)
{
  this->Stream = std::make_unique<ZstdStream>();
  std::uint8_t rest[PlainHeaderSize - HeaderSize];
  if (ReadPlainBytes(file, rest, sizeof rest) < sizeof rest)
  {
    RefuseCutHeader();
  }
  const std::uint64_t table = LoadUnsigned(rest);
  if (table < PlainHeaderSize || table > this->FileBytes)
  {
    Refuse("its header has the table of its columns at byte " + std::to_string(table) +
      ", and the file has " + std::to_string(this->FileBytes) + " bytes; its header is wrong.");
  }
  if (this->Flags & HasExtensions)
  {
    std::vector<std::uint8_t> bytes(std::min(MostExtensions, table - PlainHeaderSize));
    ReadPlainBytes(file, bytes.data(), bytes.size());
    this->SetExtensions(bytes);
  }
  file.seekg(static_cast<std::streamoff>(table));
  this->CheckTable(file, table, streams);
}

/// The sizes of the columns, compressed and unpacked; the file is where they begin.
void SPZGaussians::CheckTable(std::istream& file, std::uint64_t at, unsigned streams) const
{
  std::vector<std::uint64_t> columns;
  for (const int bytes : { 9, 1, 3, 3, 4, 3 * this->Rest })
  {
    if (this->Gaussians * bytes > 0)
    {
      columns.push_back(this->Gaussians * bytes);
    }
  }
  if (streams != columns.size())
  {
    Refuse("its header promises " + std::to_string(streams) + " columns, and its Gaussians have " +
      std::to_string(columns.size()) + "; its header is wrong.");
  }
  std::uint64_t end = at + 16 * columns.size();
  for (const std::uint64_t column : columns)
  {
    std::uint8_t sizes[16];
    if (ReadPlainBytes(file, sizes, sizeof sizes) < sizeof sizes || end > this->FileBytes ||
      LoadLong(sizes) > this->FileBytes - end)
    {
      Refuse("its columns are cut short; copy or download the file again.");
    }
    if (LoadLong(sizes + 8) != column)
    {
      Refuse("the table of its columns has one of " + std::to_string(LoadLong(sizes + 8)) +
        " bytes, which for its " + std::to_string(this->Gaussians) + " Gaussians has " +
        std::to_string(column) + "; its header is wrong.");
    }
    end += LoadLong(sizes);
  }
  if (end != this->FileBytes)
  {
    Refuse("its columns end at byte " + std::to_string(end) + ", and the file has " +
      std::to_string(this->FileBytes) + "; its header is wrong.");
  }
}

void SPZGaussians::CheckHeader() const
{
  if (this->Degree > 3)
  {
    Refuse("its harmonics are of degree " + std::to_string(this->Degree) +
      "; those of degree 0 to 3 are read: save it with fewer.");
  }
  if (this->FractionalBits > 31)
  {
    Refuse("its header promises positions with " + std::to_string(this->FractionalBits) +
      " fractional bits, of 24; it is damaged.");
  }
  // No code of deflate stands for more: 258 bytes in 2 bits. No block of zstd does: 128 KiB in 4
  // bytes.
  const std::uint64_t mostInflated = this->Version == 4 ? 1 << 15 : 1032;
  if (this->Gaussians > static_cast<std::uint64_t>(std::numeric_limits<int>::max()) ||
    this->Size() > mostInflated * this->FileBytes)
  {
    Refuse("the header promises " + std::to_string(this->Gaussians) + " Gaussians, of " +
      std::to_string(this->Size()) + " bytes, but the file has only " +
      std::to_string(this->FileBytes) + " compressed bytes; its header is wrong.");
  }
}

/// All Gaussians may be alike: a small file then holds more than fits into memory.
void SPZGaussians::CheckMemory() const
{
  const auto count = static_cast<vtkIdType>(std::max<std::uint64_t>(1, this->Gaussians));
  const double columns = static_cast<double>(this->Size()) / static_cast<double>(count);
  const std::string problem = PointCloud::CheckMemory(count, 1 + this->Rest, columns);
  if (!problem.empty())
  {
    Refuse(problem);
  }
}

bool SPZGaussians::Inflate(std::istream& file, const std::function<bool(double)>& proceed)
{
  this->CheckMemory();
  if (!this->InflateColumns(file, proceed))
  {
    return false;
  }
  std::uint8_t next;
  if (this->Version < 4 && this->Flags & HasExtensions)
  {
    std::vector<std::uint8_t> bytes(MostExtensions);
    bytes.resize(this->Stream->Read(file, bytes.data(), bytes.size()));
    this->SetExtensions(bytes);
  }
  else if (this->Stream->Read(file, &next, 1) > 0)
  {
    Refuse("its columns go on after the " + std::to_string(this->Size()) + " bytes of the " +
      std::to_string(this->Gaussians) +
      " Gaussians that its header promises; its header is wrong.");
  }
  return true;
}

bool SPZGaussians::InflateColumns(std::istream& file, const std::function<bool(double)>& proceed)
{
  constexpr std::uint64_t part = 1 << 22, likelyRatio = 4;
  const std::uint64_t size = this->Size();
  for (std::uint64_t done = 0; done < size;)
  {
    if (done == this->Columns.size())
    {
      // The header may lie: memory grows with what is really there.
      this->Columns.resize(
        std::min(size, std::max({ part, likelyRatio * this->FileBytes, 2 * done })));
    }
    const std::uint64_t wanted = std::min(part, this->Columns.size() - done);
    const std::uint64_t inflated = this->Stream->Read(file, this->Columns.data() + done, wanted);
    done += inflated;
    if (inflated < wanted)
    {
      Refuse("the header promises " + std::to_string(this->Gaussians) + " Gaussians, of " +
        std::to_string(size) + " bytes, but its columns have only " + std::to_string(done) +
        "; its header is wrong.");
    }
    if (!proceed(static_cast<double>(done) / static_cast<double>(size)))
    {
      return false;
    }
  }
  return true;
}

void SPZGaussians::SetExtensions(const std::vector<std::uint8_t>& bytes)
{
  constexpr std::uint32_t ofAxes = 0xADBE0003;
  for (std::size_t at = 0; at < bytes.size();)
  {
    const std::size_t left = bytes.size() - at;
    const std::uint32_t length = left < 8 ? 0 : LoadUnsigned(bytes.data() + at + 4);
    if (left < 8 || length > left - 8 || bytes.size() == MostExtensions)
    {
      Refuse("its extensions are damaged, or longer than 1 MiB.");
    }
    if (LoadUnsigned(bytes.data() + at) == ofAxes && length >= 4)
    {
      this->SetAxes(LoadUnsigned(bytes.data() + at + 8));
    }
    at += 8 + length;
  }
}

/// Axes are numbered from 1 (left, down, back): 1 more for right, 2 for up, 4 for front. 0 is
/// unknown.
void SPZGaussians::SetAxes(std::uint32_t axes)
{
  if (axes > 8)
  {
    Refuse("its axes have the number " + std::to_string(axes) +
      " (extension ADBE0003); those of 1 to 8, whose second axis is up or down, are read: save it "
      "with other axes, or as .ply.");
  }
  const std::uint32_t bits = (axes == 0 ? 4 : axes) - 1;
  this->Signs[0] = bits & 1 ? 1.0 : -1.0;
  this->Signs[1] = bits & 2 ? -1.0 : 1.0;
  this->Signs[2] = bits & 4 ? 1.0 : -1.0;
  // Of which axes harmonics are odd functions: 1 x, 2 y, 4 z.
  constexpr unsigned odd[15] = { 2, 4, 1, 3, 6, 0, 5, 0, 2, 7, 2, 4, 1, 4, 1 };
  for (int k = 0; k < 15; ++k)
  {
    this->HarmonicSigns[k] = 1.0;
    for (int i = 0; i < 3; ++i)
    {
      this->HarmonicSigns[k] *= odd[k] >> i & 1 ? this->Signs[i] : 1.0;
    }
  }
}

template <typename Store>
void SPZGaussians::Unpack(std::uint64_t i, const Store& store) const
{
  const std::uint64_t n = this->Gaussians, rotationBytes = this->RotationBytes();
  const std::uint8_t* const columns = this->Columns.data();
  const auto of = [&](std::uint64_t begin, std::uint64_t bytes) {
    return columns + begin * n + bytes * i;
  };
  const std::uint8_t *position = of(0, 9), *opacity = of(9, 1), *color = of(10, 3),
                     *scale = of(13, 3), *rotation = of(16, rotationBytes),
                     *rest = of(16 + rotationBytes, 3 * this->Rest);
  for (int axis = 0; axis < 3; ++axis)
  {
    store(this->Signs[axis] * Position(position + 3 * axis, this->FractionalBits));
  }
  std::for_each(scale, scale + 3, [&store](std::uint8_t s) { store(s / 16.0 - 10.0); });
  const std::array<double, 4> q =
    this->Version == 2 ? WithoutW(rotation) : SmallestThree(LoadUnsigned(rotation));
  const double(&signs)[3] = this->Signs;
  store(q[3]);
  store(q[0] * signs[1] * signs[2]);
  store(q[1] * signs[0] * signs[2]);
  store(q[2] * signs[0] * signs[1]);
  store(*opacity / 255.0);
  std::for_each(color, color + 3, [&store](std::uint8_t c) { store((c / 255.0 - 0.5) / 0.15); });
  for (int k = 0; k < this->Rest; ++k)
  {
    for (int c = 0; c < 3; ++c)
    {
      store(this->HarmonicSigns[k] * (rest[3 * k + c] - 128.0) / 128.0);
    }
  }
}

FieldCloud SPZGaussians::Read(std::uint64_t first, std::uint64_t count) const
{
  return UnpackGaussians(this->Layout(), count,
    [&](std::uint64_t i, const auto& store) { this->Unpack(first + i, store); });
}
}
