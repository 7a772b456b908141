// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Files/ArrayFile.h"

#include "Core/Files/Checksum.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>

namespace SurfelSplatting
{
namespace
{
/// Files with at most this many bytes of arrays are checked when they are opened, which takes a
/// few hundredths of a second; of larger ones the field arrays up to this size.
constexpr std::uint64_t Small = std::uint64_t{ 1 } << 25;

constexpr std::uint32_t MostArrays = 1000, MostComponents = 65536;
constexpr int PagesPerWord = 64;

[[noreturn]] void Refuse(const std::string& problem)
{
  throw std::runtime_error(problem);
}

bool IsMultipleOfPage(std::uint64_t bytes)
{
  return bytes % FilePage == 0;
}
}

std::size_t SizeOf(ArrayType type)
{
  switch (type)
  {
    case ArrayType::Int8:
    case ArrayType::UInt8:
      return 1;
    case ArrayType::Int16:
    case ArrayType::UInt16:
      return 2;
    case ArrayType::Float32:
    case ArrayType::Int32:
    case ArrayType::UInt32:
      return 4;
    case ArrayType::Float64:
    case ArrayType::Int64:
    case ArrayType::UInt64:
      return 8;
  }
  return 0;
}

std::uint64_t StoredArray::Bytes() const
{
  return SizeOf(this->Type) * this->Components * this->Tuples;
}

ArrayFile::ArrayFile(const std::string& path, const Executor& executor)
  : File(MappedFile::Open(path))
{
  this->ReadHeader();
  this->Pages = (this->Header.ChecksumsBegin - this->Header.ArraysBegin) / FilePage;
  this->Checksums =
    reinterpret_cast<const std::uint32_t*>(this->File.Data() + this->Header.ChecksumsBegin);
  this->Checked.reset(new std::atomic<std::uint64_t>[this->Pages / PagesPerWord + 1]());
  if (FilePage * this->Pages <= Small)
  {
    this->CheckAll(executor);
  }
  for (const StoredArray& array : this->Directory)
  {
    if (array.Role == ArrayRole::FieldData && array.Bytes() <= Small)
    {
      this->Announce(this->Data(array), array.Bytes());
      this->Need(this->Data(array), array.Bytes());
    }
  }
}

void ArrayFile::ReadHeader()
{
  FileHeader& h = this->Header;
  const std::uint64_t size = this->File.Size();
  if (size < sizeof(h))
  {
    Refuse("it has " + std::to_string(size) + " bytes, fewer than a header");
  }
  std::memcpy(&h, this->File.Data(), sizeof(h));
  if (std::memcmp(h.Magic, FileHeader::TheMagic, sizeof(h.Magic)) != 0)
  {
    Refuse("it does not begin as a file of surfels does");
  }
  if (h.ByteOrder != FileHeader::TheByteOrder)
  {
    Refuse("it is damaged, or was written on a machine with another order of bytes");
  }
  if (h.Version != FileHeader::TheVersion)
  {
    Refuse("its format is version " + std::to_string(h.Version) + ", and this program reads " +
      std::to_string(FileHeader::TheVersion) +
      " only; make it again from its points, or read it with the program that wrote it");
  }
  if (h.FileBytes != size)
  {
    Refuse("it has " + std::to_string(size) + " bytes instead of " + std::to_string(h.FileBytes) +
      ": it is not whole");
  }
  const std::uint64_t records = sizeof(h) + sizeof(ArrayRecord) * std::uint64_t{ h.NumberOfArrays };
  const bool inOrder = h.NumberOfArrays <= MostArrays && records <= h.ArraysBegin &&
    h.ArraysBegin <= h.ChecksumsBegin && h.ChecksumsBegin <= size;
  if (!inOrder || !IsMultipleOfPage(h.ArraysBegin) || !IsMultipleOfPage(h.ChecksumsBegin) ||
    (size - h.ChecksumsBegin) / sizeof(std::uint32_t) !=
      (h.ChecksumsBegin - h.ArraysBegin) / FilePage)
  {
    Refuse("its header is damaged: the parts of the file do not follow each other");
  }
  FileHeader plain = h;
  plain.HeaderChecksum = 0;
  const std::uint32_t sum =
    Checksum(this->File.Data() + sizeof(h), records - sizeof(h), Checksum(&plain, sizeof(plain)));
  if (sum != h.HeaderChecksum)
  {
    Refuse("its header is damaged: the checksum differs");
  }
  for (std::uint32_t i = 0; i < h.NumberOfArrays; ++i)
  {
    ArrayRecord record;
    std::memcpy(&record, this->File.Data() + sizeof(h) + i * sizeof(record), sizeof(record));
    this->ReadRecord(record);
  }
}

void ArrayFile::ReadRecord(const ArrayRecord& record)
{
  StoredArray array;
  const char* end = std::find(record.Name, std::end(record.Name), '\0');
  array.Name.assign(record.Name, end);
  array.Type = static_cast<ArrayType>(record.Type);
  array.Role = static_cast<ArrayRole>(record.Role);
  array.Components = record.Components;
  array.Tuples = record.Tuples;
  array.Begin = record.Begin;
  const std::uint64_t tuple = SizeOf(array.Type) * std::uint64_t{ array.Components };
  const bool isKnown = end != std::end(record.Name) && tuple > 0 &&
    array.Components <= MostComponents && array.Role >= ArrayRole::Points &&
    array.Role <= ArrayRole::FieldData;
  const FileHeader& h = this->Header;
  const std::uint64_t free = this->Directory.empty()
    ? h.ArraysBegin
    : this->Directory.back().Begin + this->Directory.back().Bytes();
  if (!isKnown || !IsMultipleOfPage(array.Begin) || array.Begin < free ||
    array.Begin > h.ChecksumsBegin || array.Tuples > (h.ChecksumsBegin - array.Begin) / tuple)
  {
    Refuse("its header is damaged: the array '" + array.Name +
      "' is unknown, not in the file, or where another one is");
  }
  this->Directory.push_back(array);
}

bool ArrayFile::Contains(const void* memory) const
{
  const auto at = reinterpret_cast<std::uintptr_t>(memory);
  const auto begin = reinterpret_cast<std::uintptr_t>(this->File.Data());
  return begin + this->Header.ArraysBegin <= at && at < begin + this->Header.ChecksumsBegin;
}

void ArrayFile::ReadAtRandom(const StoredArray& array) const
{
  this->File.ReadAtRandom(array.Begin, array.Bytes());
}

bool ArrayFile::FindPages(
  const void* begin, std::size_t bytes, std::uint64_t& first, std::uint64_t& last) const
{
  if (!this->Contains(begin) || bytes == 0)
  {
    return false;
  }
  const std::uint64_t at = static_cast<const unsigned char*>(begin) - this->File.Data() -
    static_cast<std::size_t>(this->Header.ArraysBegin);
  first = at / FilePage;
  last = std::min(this->Pages, (at + bytes - 1) / FilePage + 1);
  return true;
}

bool ArrayFile::IsChecked(std::uint64_t page) const
{
  const std::uint64_t word = this->Checked[page / PagesPerWord].load(std::memory_order_relaxed);
  return (word >> page % PagesPerWord & 1) != 0;
}

void ArrayFile::Announce(const void* begin, std::size_t bytes) const
{
  std::uint64_t first, last;
  if (!this->FindPages(begin, bytes, first, last))
  {
    return;
  }
  while (first < last && this->IsChecked(first))
  {
    ++first; // it is probably still in memory
  }
  if (first < last)
  {
    this->File.Announce(this->Header.ArraysBegin + FilePage * first, FilePage * (last - first));
  }
}

void ArrayFile::Need(const void* begin, std::size_t bytes) const
{
  std::uint64_t first, last;
  if (this->FindPages(begin, bytes, first, last))
  {
    this->CheckPages(first, last);
  }
}

void ArrayFile::CheckPages(std::uint64_t first, std::uint64_t last) const
{
  for (std::uint64_t page = first; page < last; ++page)
  {
    if (this->IsChecked(page))
    {
      continue;
    }
    const unsigned char* content = this->File.Data() + this->Header.ArraysBegin + FilePage * page;
    if (Checksum(content, FilePage) != this->Checksums[page])
    {
      this->ReportPage(page);
    }
    this->Checked[page / PagesPerWord].fetch_or(
      std::uint64_t{ 1 } << page % PagesPerWord, std::memory_order_relaxed);
  }
}

void ArrayFile::ReportPage(std::uint64_t page) const
{
  const std::uint64_t at = this->Header.ArraysBegin + FilePage * page;
  std::string name = "what lies between its arrays";
  for (const StoredArray& array : this->Directory)
  {
    if (array.Begin <= at && at < array.Begin + array.Bytes())
    {
      name = "its array " + array.Name;
    }
  }
  throw DamagedMemory("the file is damaged: " + name + " is not what was written, at byte " +
    std::to_string(at) + " or up to " + std::to_string(FilePage) + " bytes behind; write it again");
}

void ArrayFile::CheckAll(const Executor& executor) const
{
  constexpr std::size_t grain = 256;
  executor.For(this->Pages, grain, [this](std::size_t begin, std::size_t end) {
    this->File.Announce(this->Header.ArraysBegin + FilePage * begin, FilePage * (end - begin));
    this->CheckPages(begin, end);
  });
}
}
