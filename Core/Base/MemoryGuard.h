// SPDX-License-Identifier: BSD-3-Clause
/**
 * Checks memory that comes from a file before it is used. What is read there may be damaged, and is
 * too much to be checked at once.
 */
#pragma once

#include <cstddef>
#include <stdexcept>

namespace SurfelSplatting
{
/// What was read from a file is not what was written.
class DamagedMemory : public std::runtime_error
{
  using std::runtime_error::runtime_error;
};

class MemoryGuard
{
public:
  virtual ~MemoryGuard() = default;

  /// Tells that bytes will be needed soon. Ignores other memory than that which is guarded.
  virtual void Announce(const void* begin, std::size_t bytes) const = 0;

  /// Checks bytes before they are used for the first time. Ignores other memory than that which is
  /// guarded.
  /// @throw DamagedMemory that tells the file and what is damaged
  virtual void Need(const void* begin, std::size_t bytes) const = 0;
};
}
