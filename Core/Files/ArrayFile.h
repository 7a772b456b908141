// SPDX-License-Identifier: BSD-3-Clause
/**
 * Files of arrays that open at once, however large they are: the arrays stay in the file and are
 * mapped into memory (MappedFile.h). ArrayFileWriter.h writes them; Documentation/DataContract.md
 * tells which arrays a hierarchy has.
 *
 *   | FileHeader | ArrayRecord per array | arrays, each from a page on | checksum per page |
 *
 * Opening checks header and records by their checksum, and the places and sizes of all arrays.
 * Arrays of small files are checked as well; those of large ones page by page before they are used
 * (Need), or all together (CheckAll).
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Base/MemoryGuard.h"
#include "Core/Files/MappedFile.h"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace SurfelSplatting
{
enum class ArrayType : std::uint32_t
{
  Float32 = 1,
  Float64,
  Int8,
  UInt8,
  Int16,
  UInt16,
  Int32,
  UInt32,
  Int64,
  UInt64
};

enum class ArrayRole : std::uint32_t
{
  Points = 1, ///< positions
  PointData,  ///< other values of each point
  Scalars,    ///< point data that colours the points
  Normals,    ///< point data
  FieldData   ///< of the whole
};

struct FileHeader
{
  static constexpr char TheMagic[8] = { '\x89', 'S', 'u', 'r', 'f', 'e', 'l', '\n' };
  static constexpr std::uint32_t TheByteOrder = 0x01020304;
  /// To be raised when bytes or the meaning of values change: pictures of a file that is misread
  /// are wrong without an error. In 1 the extents of several nodes were the largest
  /// (ClusterBounds.h).
  static constexpr std::uint32_t TheVersion = 2;

  char Magic[8];
  std::uint32_t ByteOrder;
  std::uint32_t Version;
  std::uint64_t FileBytes;
  std::uint64_t ArraysBegin; ///< these are places in the file, bytes
  std::uint64_t ChecksumsBegin;
  std::uint32_t NumberOfArrays;
  std::uint32_t HeaderChecksum; ///< of header, this member 0, and records
  std::uint64_t Reserved[2];    ///< 0
};
static_assert(sizeof(FileHeader) == 64, "as it is in files");

struct ArrayRecord
{
  char Name[96]; ///< ends with 0
  std::uint32_t Type, Components, Role;
  std::uint32_t Reserved; ///< 0
  std::uint64_t Tuples;
  std::uint64_t Begin; ///< place in the file, bytes, a multiple of the page
};
static_assert(sizeof(ArrayRecord) == 128, "as it is in files");

constexpr std::uint64_t FilePage = 4096; ///< bytes that have a checksum

struct StoredArray
{
  std::string Name;
  ArrayType Type = ArrayType::Float32;
  ArrayRole Role = ArrayRole::FieldData;
  std::uint32_t Components = 1;
  std::uint64_t Tuples = 0;
  std::uint64_t Begin = 0; ///< place in the file, bytes

  std::uint64_t Bytes() const;
};

/// Bytes of a value; 0 for an unknown type.
std::size_t SizeOf(ArrayType type);

/// Can be used by several threads.
class ArrayFile : public MemoryGuard
{
public:
  /// @throw std::runtime_error that says what is wrong with the file
  explicit ArrayFile(const std::string& path, const Executor& executor);

  const std::vector<StoredArray>& Arrays() const { return this->Directory; }
  /// The values of an array. What is written there stays in this process.
  unsigned char* Data(const StoredArray& array) const { return this->File.Data() + array.Begin; }

  /// @throw DamagedMemory if a page of any array is damaged
  void CheckAll(const Executor& executor) const;

  bool Contains(const void* memory) const;

  /// Tells that an array will be read here and there, so that the operating system does not read
  /// 128 kB for each page that is missing. Announce then has it read several pages at a time.
  void ReadAtRandom(const StoredArray& array) const;

  void Announce(const void* begin, std::size_t bytes) const override;
  void Need(const void* begin, std::size_t bytes) const override;

private:
  void ReadHeader();
  void ReadRecord(const ArrayRecord& record);
  /// The pages of the arrays that some bytes are in; false if they are elsewhere.
  bool FindPages(
    const void* begin, std::size_t bytes, std::uint64_t& first, std::uint64_t& last) const;
  bool IsChecked(std::uint64_t page) const;
  void CheckPages(std::uint64_t first, std::uint64_t last) const;
  [[noreturn]] void ReportPage(std::uint64_t page) const;

  MappedFile File;
  FileHeader Header;
  std::vector<StoredArray> Directory;
  const std::uint32_t* Checksums = nullptr;
  std::uint64_t Pages = 0; ///< of the arrays
  /// A bit of each page: whether it has been checked.
  std::unique_ptr<std::atomic<std::uint64_t>[]> Checked;
};
}
