// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Files/ArrayFileWriter.h"

#include "Core/Files/Checksum.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>

#include <unistd.h>

namespace SurfelSplatting
{
namespace
{
std::uint64_t NextPage(std::uint64_t bytes)
{
  return (bytes + FilePage - 1) / FilePage * FilePage;
}
}

ArrayFileWriter::ArrayFileWriter(const std::string& path, std::vector<StoredArray> arrays)
  : Arrays(std::move(arrays))
{
  // The target of a link is written; the link stays.
  std::error_code problem;
  const std::filesystem::path target = std::filesystem::weakly_canonical(path, problem);
  this->Path = problem ? path : target.string();
  this->Temporary = this->Path + "." + std::to_string(getpid()) + ".part";
  FileHeader& h = this->Header;
  std::memcpy(h.Magic, FileHeader::TheMagic, sizeof(h.Magic));
  h.ByteOrder = FileHeader::TheByteOrder;
  h.Version = FileHeader::TheVersion;
  h.NumberOfArrays = static_cast<std::uint32_t>(this->Arrays.size());
  h.ArraysBegin = NextPage(sizeof(h) + sizeof(ArrayRecord) * this->Arrays.size());
  std::uint64_t end = h.ArraysBegin;
  for (StoredArray& array : this->Arrays)
  {
    array.Begin = end;
    end = NextPage(end + array.Bytes());
  }
  h.ChecksumsBegin = end;
  h.FileBytes = end + (end - h.ArraysBegin) / FilePage * sizeof(std::uint32_t);
  try
  {
    this->File = std::make_unique<MappedFile>(MappedFile::Create(this->Temporary, h.FileBytes));
  }
  catch (...)
  {
    std::remove(this->Temporary.c_str());
    throw;
  }
}

ArrayFileWriter::~ArrayFileWriter()
{
  if (this->File)
  {
    std::remove(this->Temporary.c_str());
  }
}

void ArrayFileWriter::Finish(const Executor& executor)
{
  unsigned char* begin = this->File->Data();
  FileHeader& h = this->Header;
  auto* checksums = reinterpret_cast<std::uint32_t*>(begin + h.ChecksumsBegin);
  constexpr std::size_t grain = 256;
  executor.For(
    (h.ChecksumsBegin - h.ArraysBegin) / FilePage, grain, [&](std::size_t first, std::size_t last) {
      for (std::size_t page = first; page < last; ++page)
      {
        checksums[page] = Checksum(begin + h.ArraysBegin + FilePage * page, FilePage);
      }
    });
  unsigned char* to = begin + sizeof(h);
  for (const StoredArray& array : this->Arrays)
  {
    ArrayRecord record{};
    std::copy_n(array.Name.data(), std::min(array.Name.size(), LongestName), record.Name);
    record.Type = static_cast<std::uint32_t>(array.Type);
    record.Components = array.Components;
    record.Role = static_cast<std::uint32_t>(array.Role);
    record.Tuples = array.Tuples;
    record.Begin = array.Begin;
    std::memcpy(to, &record, sizeof(record));
    to += sizeof(record);
  }
  h.HeaderChecksum = 0;
  h.HeaderChecksum = Checksum(begin + sizeof(h), to - begin - sizeof(h), Checksum(&h, sizeof(h)));
  std::memcpy(begin, &h, sizeof(h));
  this->File->Flush();
  std::filesystem::rename(this->Temporary, this->Path);
  this->File.reset();
}
}
