// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Readers/Points/PCDDecoder.h"

#include "Filters/Readers/Points/PointCloudHeader.h"
#include "Filters/Readers/Points/TextPoints.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <vector>

namespace PointCloud
{
namespace
{
[[noreturn]] void FailCompressed()
{
  throw std::runtime_error("the compressed data is cut short or damaged.");
}

/**
 * LZF, the format of M. Lehmann's liblzf. A control byte c < 32 precedes c + 1 literal bytes. Any
 * other starts a copy of earlier output: its three high bits are the length minus 2 (7: the next
 * byte is added), its five low bits and the byte after that the distance back minus 1.
 */
void Unpack(const std::vector<std::uint8_t>& packed, std::vector<std::uint8_t>& data)
{
  std::size_t from = 0, to = 0;
  const auto next = [&]() -> std::size_t {
    if (from == packed.size())
    {
      FailCompressed();
    }
    return packed[from++];
  };
  while (from < packed.size())
  {
    const std::size_t control = next();
    if (control < 32)
    {
      const std::size_t count = control + 1;
      if (count > packed.size() - from || count > data.size() - to)
      {
        FailCompressed();
      }
      std::memcpy(data.data() + to, packed.data() + from, count);
      from += count;
      to += count;
      continue;
    }
    std::size_t count = (control >> 5) + 2;
    count += count == 9 ? next() : 0;
    const std::size_t back = ((control & 31) << 8 | next()) + 1;
    if (back > to || count > data.size() - to)
    {
      FailCompressed();
    }
    for (std::size_t i = 0; i < count; ++i, ++to) // source and target may overlap
    {
      data[to] = data[to - back];
    }
  }
  if (to != data.size())
  {
    FailCompressed();
  }
}

/// Drops the padding between the fields, for which the file need not have a byte.
void DropPadding(FieldCloud& cloud)
{
  std::vector<Field>& fields = cloud.Fields;
  fields.erase(std::remove_if(fields.begin(), fields.end(),
                 [](const Field& field) { return field.Name == "_"; }),
    fields.end());
  cloud.PointStep = 0;
  for (Field& field : fields)
  {
    field.Offset = cloud.PointStep;
    cloud.PointStep += field.Count * SizeOf(field.Type);
  }
}

/// Two sizes, packed and unpacked, then the fields one after the other; padding may be missing.
void ReadCompressed(std::istream& file, const PCDHeader& header, FieldCloud& cloud)
{
  std::uint32_t sizes[2] = { 0, 0 };
  file.read(reinterpret_cast<char*>(sizes), sizeof(sizes));
  std::vector<std::uint8_t> packed(sizes[0]), fields(sizes[1]);
  file.read(reinterpret_cast<char*>(packed.data()), static_cast<std::streamsize>(packed.size()));
  if (!file)
  {
    FailCompressed();
  }
  Unpack(packed, fields);
  const std::size_t points = std::size_t(cloud.Width) * cloud.Height;
  const bool isPadded = fields.size() == points * header.PointStep;
  const std::uint8_t* from = fields.data();
  auto kept = cloud.Fields.begin();
  for (const Field& field : header.Fields)
  {
    const std::size_t bytes = field.Count * SizeOf(field.Type);
    if (field.Name == "_")
    {
      from += isPadded ? points * bytes : 0;
      continue;
    }
    std::uint8_t* to = cloud.Data.data() + kept++->Offset;
    for (std::size_t i = 0; i < points; ++i, from += bytes)
    {
      std::memcpy(to + i * cloud.PointStep, from, bytes);
    }
  }
}

void ReadBinary(std::istream& file, FieldCloud& cloud)
{
  file.read(
    reinterpret_cast<char*>(cloud.Data.data()), static_cast<std::streamsize>(cloud.Data.size()));
  if (!file)
  {
    throw std::runtime_error("the data is cut short.");
  }
}
}

FieldCloud DecodePCD(std::istream& file, const PCDHeader& header)
{
  FieldCloud cloud;
  cloud.Width = header.Width;
  cloud.Height = header.Height;
  cloud.Fields = header.Fields;
  cloud.PointStep = header.PointStep;
  const bool isCompressed = header.Data == "binary_compressed";
  if (isCompressed)
  {
    DropPadding(cloud);
  }
  cloud.Data.assign(std::size_t(cloud.Width) * cloud.Height * cloud.PointStep, 0);
  if (header.Data == "ascii")
  {
    ReadTextPoints(file, header.Lines, cloud);
  }
  else if (isCompressed)
  {
    ReadCompressed(file, header, cloud);
  }
  else
  {
    ReadBinary(file, cloud);
  }
  return cloud;
}
}
