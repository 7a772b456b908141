// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Readers/Captures/PackedGaussians.h"

#include "Filters/Readers/Captures/UnpackedGaussians.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

namespace PointCloud
{
namespace
{
using Bytes = SurfelGeometry::RawVector<std::uint8_t>;

constexpr std::uint64_t ChunkSize = 256;               // Gaussians
constexpr double HarmonicOfColor = 3.5449077018110318; // 1 / Y_00 = 2 sqrt(pi)

/// Offset of a field that must be there, and of one type.
std::size_t OffsetOf(const PLYElement& element, const std::string& name, Field::Types type)
{
  const Field* field = FindField(element.Fields, name);
  if (!field || field->Type != type)
  {
    throw std::runtime_error("its element " + element.Name + " has no property " + name +
      (type == Field::FLOAT32    ? " of type float"
          : type == Field::UINT8 ? " of type uchar"
                                 : " of type uint") +
      "; compressed captures have it.");
  }
  return field->Offset;
}

double LoadFloat(const std::uint8_t* at)
{
  const std::uint32_t bits = LoadUnsigned(at);
  float value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

Bytes ReadBytes(std::istream& file, std::uint64_t at, std::uint64_t count)
{
  Bytes bytes(count);
  file.seekg(static_cast<std::streamoff>(at));
  if (!file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(count)))
  {
    throw std::runtime_error("the file cannot be read to its end.");
  }
  return bytes;
}

/// Some bits as a number from 0 to 1.
double Share(std::uint32_t packed, int shift, int bits)
{
  const std::uint32_t most = (1u << bits) - 1;
  return static_cast<double>((packed >> shift) & most) / most;
}

void UnpackQuaternion(std::uint32_t packed, double (&q)[4])
{
  const std::uint32_t largest = packed >> 30;
  double rest = 1.0;
  for (std::uint32_t i = 0, shift = 20; i < 4; ++i)
  {
    if (i != largest)
    {
      q[i] = (Share(packed, static_cast<int>(shift), 10) - 0.5) * std::sqrt(2.0);
      rest -= q[i] * q[i];
      shift -= 10;
    }
  }
  q[largest] = std::sqrt(std::fmax(0.0, rest));
}
}

bool PackedGaussians::Has(const PLYHeader& header)
{
  const PLYElement* vertices = header.Find("vertex");
  return vertices && header.Find("chunk") && FindField(vertices->Fields, "packed_position");
}

PackedGaussians::Block PackedGaussians::FindBlock(
  const PLYHeader& header, const char* name, std::uint64_t begin)
{
  for (const PLYElement& element : header.Elements)
  {
    if (element.HasLists)
    {
      throw std::runtime_error("its element " + element.Name +
        " has a list among its properties; compressed captures have numbers only.");
    }
    if (element.Name == name)
    {
      return { begin, element.Count, element.Step };
    }
    begin += element.Count * element.Step;
  }
  return {};
}

PackedGaussians::PackedGaussians(const PLYHeader& header, std::istream& file, std::uint64_t bytes)
{
  if (header.Format != "binary_little_endian")
  {
    throw std::runtime_error("its format is not binary_little_endian, as that of compressed "
                             "captures is.");
  }
  const auto begin = static_cast<std::uint64_t>(file.tellg());
  std::uint64_t left = bytes - begin;
  for (const PLYElement& element : header.Elements)
  {
    CheckSize(element.Count, element.Step, left);
    left -= element.Count * element.Step;
  }
  const PLYElement& vertices = *header.Find("vertex");
  this->Vertices = FindBlock(header, "vertex", begin);
  const char* const packed[4] = { "packed_position", "packed_rotation", "packed_scale",
    "packed_color" };
  std::transform(packed, packed + 4, this->Packed,
    [&](const char* name) { return OffsetOf(vertices, name, Field::UINT32); });
  if (const PLYElement* harmonics = header.Find("sh"))
  {
    this->Harmonics = FindBlock(header, "sh", begin);
    this->Rest = 3 * (CountHarmonics(harmonics->Fields) - 1);
    for (int i = 0; i < this->Rest; ++i)
    {
      this->RestOffsets.push_back(
        OffsetOf(*harmonics, "f_rest_" + std::to_string(i), Field::UINT8));
    }
  }
  const Block chunks = FindBlock(header, "chunk", begin);
  if (chunks.Count != (this->Count() + ChunkSize - 1) / ChunkSize ||
    (this->Rest > 0 && this->Harmonics.Count != this->Count()))
  {
    throw std::runtime_error("its " + std::to_string(this->Count()) +
      " vertices need an element chunk for each 256, and an element sh for each or none; its "
      "header "
      "is damaged.");
  }
  this->ReadChunks(*header.Find("chunk"), file, chunks);
}

void PackedGaussians::ReadChunks(const PLYElement& element, std::istream& file, const Block& block)
{
  const char* const names[9] = { "x", "y", "z", "scale_x", "scale_y", "scale_z", "r", "g", "b" };
  std::size_t offsets[2][9];
  const int values = FindField(element.Fields, "min_r") ? 9 : 6; // older files: colours 0 to 1
  for (int i = 0; i < values; ++i)
  {
    offsets[0][i] = OffsetOf(element, std::string("min_") + names[i], Field::FLOAT32);
    offsets[1][i] = OffsetOf(element, std::string("max_") + names[i], Field::FLOAT32);
  }
  const Bytes bytes = ReadBytes(file, block.Begin, block.Count * block.Step);
  this->Chunks.resize(block.Count);
  for (std::uint64_t c = 0; c < block.Count; ++c)
  {
    const std::uint8_t* chunk = bytes.data() + c * block.Step;
    for (int i = 0; i < 9; ++i)
    {
      this->Chunks[c].Least[i] = i < values ? LoadFloat(chunk + offsets[0][i]) : 0.0;
      this->Chunks[c].Most[i] = i < values ? LoadFloat(chunk + offsets[1][i]) : 1.0;
    }
  }
}

template <typename Store>
void PackedGaussians::Unpack(
  std::uint64_t i, const std::uint8_t* packed, const std::uint8_t* rest, const Store& store) const
{
  const Chunk& chunk = this->Chunks[i / ChunkSize];
  const auto between = [&chunk](int value, double share) {
    return (1.0 - share) * chunk.Least[value] + share * chunk.Most[value];
  };
  for (const int value : { 0, 3 }) // position, then scale
  {
    const std::uint32_t bits = LoadUnsigned(packed + this->Packed[value == 0 ? 0 : 2]);
    store(between(value, Share(bits, 21, 11)));
    store(between(value + 1, Share(bits, 11, 10)));
    store(between(value + 2, Share(bits, 0, 11)));
  }
  double rotation[4];
  UnpackQuaternion(LoadUnsigned(packed + this->Packed[1]), rotation);
  std::for_each(rotation, rotation + 4, store);
  const std::uint32_t color = LoadUnsigned(packed + this->Packed[3]);
  store(Share(color, 0, 8));
  for (int c = 0; c < 3; ++c)
  {
    store(HarmonicOfColor * (between(6 + c, Share(color, 24 - 8 * c, 8)) - 0.5));
  }
  const int each = this->Rest / 3;
  for (int k = 0; k < each; ++k)
  {
    for (int c = 0; c < 3; ++c)
    {
      store(rest[this->RestOffsets[c * each + k]] * (8.0 / 255.0) - 4.0);
    }
  }
}

FieldCloud PackedGaussians::Read(std::istream& file, std::uint64_t first, std::uint64_t count) const
{
  const auto read = [&](const Block& block) {
    return ReadBytes(file, block.Begin + first * block.Step, count * block.Step);
  };
  const Bytes packed = read(this->Vertices),
              rest = this->Rest > 0 ? read(this->Harmonics) : Bytes();
  return UnpackGaussians(this->Layout(), count, [&](std::uint64_t i, const auto& store) {
    this->Unpack(first + i, packed.data() + i * this->Vertices.Step,
      rest.data() + i * this->Harmonics.Step, store);
  });
}
}
