// SPDX-License-Identifier: BSD-3-Clause
/**
 * Small files of every format that the readers read, as bytes: captures and scans of made-up
 * numbers.
 */
#pragma once

#include "Testing/Shared/Random.h"

#include "vtk_zlib.h"

#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <string>
#include <vector>

namespace ReaderFiles
{
using Strings = std::vector<std::string>;

/// Adds the bytes of numbers, on a little-endian machine.
template <typename T>
void Put(std::string& bytes, std::initializer_list<T> numbers)
{
  for (const T number : numbers)
  {
    bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
  }
}

inline std::string RandomBytes(std::size_t count, SurfelTesting::Random& random)
{
  std::string bytes(count, '\0');
  for (char& byte : bytes)
  {
    byte = static_cast<char>(random.Integer(0, 255));
  }
  return bytes;
}

inline std::string PLYElement(
  const std::string& name, int count, const std::string& type, const Strings& properties)
{
  std::string lines = "element " + name + " " + std::to_string(count) + "\n";
  for (const std::string& property : properties)
  {
    lines += "property " + type + " " + property + "\n";
  }
  return lines;
}

inline Strings Numbered(const std::string& name, int count)
{
  Strings names;
  for (int i = 0; i < count; ++i)
  {
    names.push_back(name + std::to_string(i));
  }
  return names;
}

inline void Append(Strings& names, const Strings& others)
{
  names.insert(names.end(), others.begin(), others.end());
}

/// A capture of degree 1.
inline std::string CapturePLY(int count, bool isAscii)
{
  Strings names = { "x", "y", "z", "opacity" };
  Append(names, Numbered("f_dc_", 3));
  Append(names, Numbered("f_rest_", 9));
  Append(names, Numbered("scale_", 3));
  Append(names, Numbered("rot_", 4));
  std::string file = std::string("ply\nformat ") + (isAscii ? "ascii" : "binary_little_endian") +
    " 1.0\n" + PLYElement("vertex", count, "float", names) + "end_header\n";
  SurfelTesting::Random random(1);
  for (int i = 0; i < count; ++i)
  {
    for (std::size_t k = 0; k < names.size(); ++k)
    {
      const auto value = static_cast<float>(random.Uniform(-2.0, 2.0));
      isAscii ? void(file += std::to_string(value) + (k + 1 == names.size() ? "\n" : " "))
              : Put(file, { value });
    }
  }
  return file;
}

/// A capture in 16 bytes each and chunks of 256.
/// @param harmonics bytes of each beside these; of degree 1, f_rest_0 to f_rest_8
inline std::string CompressedPLY(int count, const Strings& harmonics)
{
  const int chunks = (count + 255) / 256;
  Strings ranges;
  for (const char* const end : { "min_", "max_" })
  {
    for (const char* const of : { "x", "y", "z", "scale_x", "scale_y", "scale_z", "r", "g", "b" })
    {
      ranges.push_back(std::string(end) + of);
    }
  }
  std::string file = "ply\nformat binary_little_endian 1.0\n" +
    PLYElement("chunk", chunks, "float", ranges) +
    PLYElement("vertex", count, "uint",
      { "packed_position", "packed_rotation", "packed_scale", "packed_color" }) +
    PLYElement("sh", count, "uchar", harmonics) + "end_header\n";
  for (int chunk = 0; chunk < chunks; ++chunk)
  {
    Put(file, { -1.0f, -1.0f, -1.0f, -4.0f, -4.0f, -4.0f, 0.0f, 0.0f, 0.0f });
    Put(file, { 1.0f, 1.0f, 1.0f, -2.0f, -2.0f, -2.0f, 1.0f, 1.0f, 1.0f });
  }
  SurfelTesting::Random random(2);
  return file + RandomBytes(count * (16 + harmonics.size()), random);
}

inline std::string Splat(int count)
{
  SurfelTesting::Random random(3);
  std::string file;
  for (int i = 0; i < count; ++i)
  {
    for (int k = 0; k < 6; ++k)
    {
      Put(file, { static_cast<float>(random()) });
    }
    file += RandomBytes(8, random);
  }
  return file;
}

/// What versions 2 and 3 of .spz compress: degree 1, antialiased, an extension that names the axes.
inline std::string SPZContent(int version, int count)
{
  SurfelTesting::Random random(4);
  std::string content = "NGSP";
  Put(content, { std::uint32_t(version), std::uint32_t(count) });
  Put(content, { std::uint8_t(1), std::uint8_t(12), std::uint8_t(3), std::uint8_t(0) });
  content += RandomBytes(count * (9 + 1 + 3 + 3 + (version == 2 ? 3 : 4) + 9), random);
  Put(content, { std::uint32_t(0xADBE0003), std::uint32_t(4), std::uint32_t(4) });
  return content;
}

/// A gzip stream.
inline std::string Gzip(const std::string& content)
{
  z_stream stream = {};
  deflateInit2(&stream, 1, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
  std::string packed(deflateBound(&stream, static_cast<uLong>(content.size())), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
  stream.avail_in = static_cast<uInt>(content.size());
  stream.next_out = reinterpret_cast<Bytef*>(&packed[0]);
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

/// A zstd frame that compresses nothing.
inline std::string ZstdFrame(const std::string& content)
{
  std::string frame("\x28\xb5\x2f\xfd\x00\x38", 6); // no sizes in the header; blocks of 128 KiB
  const auto block = static_cast<std::uint32_t>(content.size() << 3 | 1);
  Put(frame,
    { std::uint8_t(block & 255), std::uint8_t(block >> 8 & 255), std::uint8_t(block >> 16 & 255) });
  return frame + content;
}

/// A .spz file of version 4: a column for each kind of number, and a table of their sizes.
inline std::string SPZ4(int count)
{
  SurfelTesting::Random random(5);
  std::string file = "NGSP", table, frames;
  for (const int bytes : { 9, 1, 3, 3, 4, 9 })
  {
    const std::string column = RandomBytes(count * bytes, random), frame = ZstdFrame(column);
    Put(table, { std::uint64_t(frame.size()), std::uint64_t(column.size()) });
    frames += frame;
  }
  Put(file, { std::uint32_t(4), std::uint32_t(count) });
  Put(file, { std::uint8_t(1), std::uint8_t(12), std::uint8_t(3), std::uint8_t(6) });
  Put(file, { std::uint32_t(32 + 12), std::uint32_t(0), std::uint32_t(0), std::uint32_t(0) });
  Put(file, { std::uint32_t(0xADBE0003), std::uint32_t(4), std::uint32_t(4) });
  return file + table + frames;
}

/// A range image of two rows.
inline std::string PCD(int columns, bool isAscii)
{
  const std::string width = std::to_string(columns), points = std::to_string(2 * columns);
  std::string file =
    "VERSION 0.7\nFIELDS x y z rgb label normal\nSIZE 4 4 4 4 2 8\nTYPE F F F U U F\n"
    "COUNT 1 1 1 1 1 3\nWIDTH " +
    width + "\nHEIGHT 2\nVIEWPOINT 0 0 1 1 0 0 0\nPOINTS " + points + "\nDATA " +
    (isAscii ? "ascii\n" : "binary\n");
  SurfelTesting::Random random(6);
  for (int i = 0; i < 2 * columns; ++i)
  {
    for (int k = 0; isAscii && k < 8; ++k)
    {
      file +=
        std::to_string(k < 3 || k > 4 ? random() : random.Integer(0, 9)) + (k < 7 ? " " : "\n");
    }
    if (!isAscii)
    {
      file += RandomBytes(4 * 4 + 2 + 3 * 8, random);
    }
  }
  return file;
}

/// A mesh: vertices with bytes for colours, and triangles of them.
inline std::string MeshPLY(int count, const std::string& form)
{
  const bool isAscii = form == "ascii";
  std::string file = "ply\nformat " + form + " 1.0\ncomment made up\nobj_info num_cols 4\n" +
    PLYElement("vertex", count, "float", { "x", "y", "z" }) +
    "property uchar red\nproperty uchar green\nproperty uchar blue\n" +
    PLYElement("face", count, "list uchar int", { "vertex_indices" }) + "end_header\n";
  SurfelTesting::Random random(7);
  for (int i = 0; i < count; ++i)
  {
    file += isAscii ? std::to_string(random()) + " 0.5 1e3 10 20 30\n" : RandomBytes(15, random);
  }
  const bool isBig = form == "binary_big_endian";
  for (int i = 0; i < count; ++i)
  {
    const int corners[] = { i, (i + 1) % count, (i + 2) % count };
    if (isAscii)
    {
      file += "3 " + std::to_string(corners[0]) + " " + std::to_string(corners[1]) + " " +
        std::to_string(corners[2]) + "\n";
      continue;
    }
    file += '\3';
    for (const int corner : corners)
    {
      Put(file, { isBig ? std::uint32_t(corner) << 24 : std::uint32_t(corner) }); // below 256
    }
  }
  return file;
}
}
