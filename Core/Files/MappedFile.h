// SPDX-License-Identifier: BSD-3-Clause
/**
 * A file as memory: the operating system reads a page of it when the page is first touched, and may
 * drop the page again when memory is short.
 */
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace SurfelSplatting
{
class MappedFile
{
public:
  /// Maps a file for reading. What is written into its memory stays in this process.
  /// @throw std::runtime_error that says why it cannot be
  static MappedFile Open(const std::string& path);

  /// Makes a file of this size, all zero, and maps it for writing. An existing one is replaced. Its
  /// space on the disk is reserved.
  /// @throw std::runtime_error that says why it cannot be
  static MappedFile Create(const std::string& path, std::uint64_t bytes);

  MappedFile(MappedFile&& other) noexcept;
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  ~MappedFile();

  unsigned char* Data() const { return this->Begin; }
  std::size_t Size() const { return this->Bytes; }

  /// Tells the operating system that bytes will be needed soon: it reads them in the background.
  void Announce(std::size_t begin, std::size_t bytes) const;

  /// Tells the operating system that bytes will be read here and there: it then reads no more than
  /// the pages that are touched or announced.
  void ReadAtRandom(std::size_t begin, std::size_t bytes) const;

  /// Returns when all that was written is on the disk.
  /// @throw std::runtime_error if the disk fails
  void Flush() const;

private:
  void Advise(std::size_t begin, std::size_t bytes, int advice) const;
  MappedFile(unsigned char* begin, std::size_t bytes);

  unsigned char* Begin = nullptr;
  std::size_t Bytes = 0;
};
}
