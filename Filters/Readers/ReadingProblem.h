// SPDX-License-Identifier: BSD-3-Clause
/**
 * Messages that may quote a damaged file.
 */
#pragma once

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
}
