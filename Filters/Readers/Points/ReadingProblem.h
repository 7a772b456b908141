// SPDX-License-Identifier: BSD-3-Clause
/**
 * What the readers say of a file that they cannot read.
 */
#pragma once

#include "vtkErrorCode.h"

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

struct ReadingProblem
{
  unsigned long Code = vtkErrorCode::NoError;
  std::string Text;
};

/// Calls read(). Returns what is wrong: there is no name, or read() has thrown an exception.
/// @param contents what the file has, in the plural
template <typename Function>
ReadingProblem FindReadingProblem(
  const char* fileName, const std::string& contents, const Function& read)
{
  if (!fileName)
  {
    return { vtkErrorCode::NoFileNameError, "No file to read: call SetFileName first." };
  }
  std::string text;
  try
  {
    read();
    return {};
  }
  catch (const std::bad_alloc&)
  {
    text = "the " + contents + " do not fit into memory: reduce their number first.";
  }
  catch (const std::exception& found)
  {
    text = Printable(found.what());
  }
  return { vtkErrorCode::FileFormatError, fileName + (": " + text) };
}
}
