// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Readers/Points/PCDDecoder.h"

#include "Filters/Readers/Points/PointCloudHeader.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>

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

/// Parses a whole word as a number, in any locale. Returns false if it is none.
template <typename T>
bool Parse(std::string_view word, T& value)
{
  const char* begin = word.data() + (word[0] == '+' ? 1 : 0);
  const char* end = word.data() + word.size();
  const std::from_chars_result result = std::from_chars(begin, end, value);
  return result.ec == std::errc() && result.ptr == end;
}

/// Returns false if the word is not a number of this type.
template <typename T>
bool StoreAs(std::string_view word, std::uint8_t* to)
{
  T value = 0;
  bool isValid = Parse(word, value);
  if constexpr (std::is_unsigned<T>::value)
  {
    std::make_signed_t<T> negative = 0;
    if (!isValid && Parse(word, negative))
    {
      isValid = true;
      value = static_cast<T>(negative); // modulo 2^bits, as pcl_io stores it
    }
  }
  double real = 0.0;
  if (!isValid && Parse(word, real))
  {
    // Accepts "1.0" as an integer, and 1e-60 as a float: 0.
    isValid = !std::is_integral<T>::value ||
      (real >= static_cast<double>(std::numeric_limits<T>::lowest()) &&
        real < static_cast<double>(std::numeric_limits<T>::max()) + 1.0);
    value = isValid ? static_cast<T>(real) : T{};
  }
  std::memcpy(to, &value, sizeof(T));
  return isValid;
}

bool StoreWord(std::string_view word, Field::Types type, std::uint8_t* to)
{
  switch (type)
  {
    case Field::BOOL:
    case Field::UINT8:
      return StoreAs<std::uint8_t>(word, to);
    case Field::INT8:
      return StoreAs<std::int8_t>(word, to);
    case Field::INT16:
      return StoreAs<std::int16_t>(word, to);
    case Field::UINT16:
      return StoreAs<std::uint16_t>(word, to);
    case Field::INT32:
      return StoreAs<std::int32_t>(word, to);
    case Field::UINT32:
      return StoreAs<std::uint32_t>(word, to);
    case Field::INT64:
      return StoreAs<std::int64_t>(word, to);
    case Field::UINT64:
      return StoreAs<std::uint64_t>(word, to);
    case Field::FLOAT32:
      return StoreAs<float>(word, to);
    default:
      return StoreAs<double>(word, to);
  }
}

/// Splits a line at its white space, which includes the \r of \r\n.
void Split(std::string_view line, std::vector<std::string_view>& words)
{
  const auto isBlank = [](char c) { return c == ' ' || (c >= '\t' && c <= '\r'); };
  words.clear();
  for (auto end = line.begin();;)
  {
    const auto begin = std::find_if_not(end, line.end(), isBlank);
    if (begin == line.end())
    {
      return;
    }
    end = std::find_if(begin, line.end(), isBlank);
    words.push_back(line.substr(begin - line.begin(), end - begin));
  }
}

/// Stores the values of a line; there are as many as the fields need.
void StorePoint(const std::vector<std::string_view>& words, std::size_t line,
  const std::vector<Field>& fields, std::uint8_t* point)
{
  auto word = words.begin();
  for (const Field& field : fields)
  {
    if (field.Name == "_") // padding: its words may be anything
    {
      word += static_cast<std::ptrdiff_t>(field.Count);
      continue;
    }
    std::uint8_t* to = point + field.Offset;
    for (std::size_t k = 0; k < field.Count; ++k, ++word, to += SizeOf(field.Type))
    {
      if (!StoreWord(*word, field.Type, to))
      {
        throw std::runtime_error("line " + std::to_string(line) + ", field " + field.Name + ": \"" +
          std::string(word->substr(0, 40)) + "\" is not a number of this field's type.");
      }
    }
  }
}

/// A point is a line. Empty lines are skipped.
void ReadAscii(std::istream& file, std::size_t headerLines, FieldCloud& cloud)
{
  std::size_t needed = 0;
  for (const Field& field : cloud.Fields)
  {
    needed += field.Count;
  }
  const std::size_t points = std::size_t(cloud.Width) * cloud.Height;
  std::size_t line = headerLines;
  std::string text;
  std::vector<std::string_view> words;
  for (std::size_t i = 0; i < points; ++i)
  {
    do
    {
      if (!std::getline(file, text))
      {
        throw std::runtime_error("the data ends after " + std::to_string(i) + " points.");
      }
      ++line;
      Split(text, words);
    } while (words.empty());
    if (words.size() != needed)
    {
      const bool isCut = words.size() < needed && file.eof();
      throw std::runtime_error("line " + std::to_string(line) + " has " +
        std::to_string(words.size()) + " values, but a point has " + std::to_string(needed) +
        (isCut ? "; the data ends after " + std::to_string(i) + " points." : "."));
    }
    StorePoint(words, line, cloud.Fields, cloud.Data.data() + i * cloud.PointStep);
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
    ReadAscii(file, header.Lines, cloud);
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
