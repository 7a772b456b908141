// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Readers/Points/TextPoints.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <vector>

namespace PointCloud
{
namespace
{
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
}

void ReadTextPoints(std::istream& file, std::size_t headerLines, FieldCloud& cloud)
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
