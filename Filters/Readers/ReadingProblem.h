// SPDX-License-Identifier: BSD-3-Clause
/**
 * What the readers say of a file that they cannot read.
 */
#pragma once

#include <exception>
#include <new>
#include <string>

namespace PointCloud
{
/// A message that may quote a damaged file: bytes other than printable ASCII as \xNN. VTK's Python
/// observers get no message at all if it is not UTF-8.
inline std::string Printable(const std::string& message)
{
  constexpr char digits[] = "0123456789abcdef";
  std::string text;
  for (const unsigned char c : message)
  {
    if (c >= 0x20 && c < 0x7f)
    {
      text += static_cast<char>(c);
    }
    else
    {
      text += { '\\', 'x', digits[c >> 4], digits[c & 15] };
    }
  }
  return text;
}

/// Calls read(). Returns an empty string, or what is wrong: the exception that it has thrown.
/// @param contents what the file has, in the plural
template <typename Function>
std::string ReadingProblem(const std::string& contents, const Function& read)
{
  try
  {
    read();
    return std::string();
  }
  catch (const std::bad_alloc&)
  {
    return "the " + contents + " do not fit into memory: reduce their number first.";
  }
  catch (const std::exception& found)
  {
    return Printable(found.what());
  }
}
}
