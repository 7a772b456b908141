// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenEXR/EXRInput.h"

#include "vtkErrorCode.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/ImfVersion.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace SurfelSplatting
{
namespace
{
constexpr int HeaderBegin = 8; // after the magic number and the version

[[noreturn]] void Fail(const std::string& what)
{
  throw EXRProblem(vtkErrorCode::FileFormatError, what);
}

/// Reads a little-endian integer; 0 at the end of the file.
std::int32_t ReadInteger(std::istream& file)
{
  std::array<unsigned char, 4> bytes{};
  file.read(reinterpret_cast<char*>(bytes.data()), bytes.size());
  return static_cast<std::int32_t>(
    bytes[0] | bytes[1] << 8 | bytes[2] << 16 | std::uint32_t(bytes[3]) << 24);
}

int RowsPerChunk(Imf::Compression compression)
{
  switch (compression)
  {
    case Imf::ZIP_COMPRESSION:
    case Imf::PXR24_COMPRESSION:
      return 16;
    case Imf::PIZ_COMPRESSION:
    case Imf::B44_COMPRESSION:
    case Imf::B44A_COMPRESSION:
    case Imf::DWAA_COMPRESSION:
      return 32;
    case Imf::DWAB_COMPRESSION:
      return 256;
    default:
      return 1;
  }
}

/// Largest number of uncompressed bytes per byte of a file.
double LargestRatio(Imf::Compression compression)
{
  constexpr double deflated = 4.0 / 3.0 * 1032.0; // zlib; PXR24 keeps 3 of 4 bytes
  constexpr double blocks = 128.0;                // DWA: 64 pixels can become one value
  switch (compression)
  {
    case Imf::NO_COMPRESSION:
      return 1.0;
    case Imf::DWAA_COMPRESSION:
    case Imf::DWAB_COMPRESSION:
      return blocks * deflated;
    default:
      return deflated;
  }
}
}

EXRInput::EXRInput(const std::string& path)
  : File(path, std::ios::binary | std::ios::ate)
  , FileBytes(static_cast<double>(File.tellg()))
  , Stream(File, path.c_str())
{
  if (!this->File)
  {
    throw EXRProblem(vtkErrorCode::CannotOpenFileError,
      "the file cannot be opened; check its name and permissions.");
  }
  this->File.seekg(0);
  const std::int32_t magic = ReadInteger(this->File);
  this->Version = ReadInteger(this->File);
  if (magic != Imf::MAGIC || !this->File)
  {
    throw EXRProblem(
      vtkErrorCode::UnrecognizedFileTypeError, "not an OpenEXR file: its first bytes are wrong.");
  }
  if (Imf::getVersion(this->Version) != Imf::EXR_VERSION ||
    !Imf::supportsFlags(Imf::getFlags(this->Version)))
  {
    Fail("the version of the file is not supported; convert it to version 2.");
  }
  if (Imf::isMultiPart(this->Version))
  {
    Fail("files with several parts are not supported; extract one first: exrmultipart -separate.");
  }
  this->CheckAttributes();
  this->File.seekg(HeaderBegin);
  this->Header.readFrom(this->Stream, this->Version);
  this->Header.sanityCheck(Imf::isTiled(this->Version));
  this->Deep = Imf::isNonImage(this->Version) ||
    (this->Header.hasType() && Imf::isDeepData(this->Header.type()));
  this->CheckKind();
  this->CheckSize();
}

// Checks that no attribute extends beyond the end of the file: OpenEXR would allocate it.
void EXRInput::CheckAttributes()
{
  this->File.seekg(HeaderBegin);
  std::string name, type;
  while (std::getline(this->File, name, '\0') && !name.empty())
  {
    std::getline(this->File, type, '\0');
    const std::int32_t size = ReadInteger(this->File);
    if (!this->File || size < 0 || static_cast<double>(this->File.tellg()) + size > this->FileBytes)
    {
      break;
    }
    this->File.seekg(size, std::ios::cur);
    name.clear();
  }
  if (!this->File || !name.empty())
  {
    Fail("the header is damaged or cut short.");
  }
}

void EXRInput::CheckKind() const
{
  if (this->Header.hasType() && this->Header.type() == Imf::DEEPTILE)
  {
    Fail("deep tiles are not supported; write deep scan lines.");
  }
  const Imf::ChannelList& channels = this->Header.channels();
  if (channels.begin() == channels.end())
  {
    Fail("the file has no channels.");
  }
  for (auto channel = channels.begin(); channel != channels.end(); ++channel)
  {
    if (channel.channel().xSampling != 1 || channel.channel().ySampling != 1)
    {
      Fail(std::string("channel ") + channel.name() +
        " does not have a value for each pixel, which is not supported; write R, G and B instead "
        "of luminance and chroma.");
    }
  }
}

void EXRInput::CheckSize() const
{
  const double width = this->Width(), height = this->Height();
  double chunks = height / RowsPerChunk(this->Header.compression());
  if (Imf::isTiled(this->Version))
  {
    const Imf::TileDescription& tiles = this->Header.tileDescription();
    chunks = std::ceil(width / tiles.xSize) * std::ceil(height / tiles.ySize);
    constexpr double largest = 4096.0;
    if (tiles.xSize > std::max(width, largest) || tiles.ySize > std::max(height, largest))
    {
      Fail("the file announces tiles larger than its picture; it is damaged.");
    }
  }
  const std::string size =
    std::to_string(this->Width()) + " x " + std::to_string(this->Height()) + " pixels";
  if (chunks * sizeof(std::uint64_t) > this->FileBytes) // the offset table
  {
    this->FailAsTooLarge(size);
  }
  this->CheckUnpacked(
    width * height * (this->Deep ? sizeof(std::uint32_t) : this->BytesPerPixel()), size);
}

void EXRInput::CheckUnpacked(double bytes, const std::string& what) const
{
  if (bytes > LargestRatio(this->Header.compression()) * this->FileBytes)
  {
    this->FailAsTooLarge(what);
  }
}

void EXRInput::FailAsTooLarge(const std::string& what) const
{
  Fail("the file announces " + what + ", more than its " +
    std::to_string(static_cast<std::int64_t>(this->FileBytes)) +
    " bytes can hold; it is cut short or damaged.");
}

int EXRInput::BytesPerPixel() const
{
  int bytes = 0;
  const Imf::ChannelList& channels = this->Header.channels();
  for (auto channel = channels.begin(); channel != channels.end(); ++channel)
  {
    bytes += channel.channel().type == Imf::HALF ? 2 : 4;
  }
  return bytes;
}

int EXRInput::Width() const
{
  return this->Header.dataWindow().max.x - this->Header.dataWindow().min.x + 1;
}

int EXRInput::Height() const
{
  return this->Header.dataWindow().max.y - this->Header.dataWindow().min.y + 1;
}

Imf::IStream& EXRInput::Rewind()
{
  this->File.clear();
  this->File.seekg(0);
  return this->Stream;
}
}
