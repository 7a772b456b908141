// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Files/MappedFile.h"

#include <cerrno>
#include <limits>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace SurfelSplatting
{
namespace
{
[[noreturn]] void Fail(int code)
{
  throw std::system_error(code, std::generic_category());
}

/// A file descriptor that is closed at the end. The mapping stays.
class Descriptor
{
public:
  Descriptor(const std::string& path, int flags)
    : Number(open(path.c_str(), flags | O_CLOEXEC, 0666))
  {
    if (this->Number < 0)
    {
      Fail(errno);
    }
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close(this->Number); }

  const int Number;
};

unsigned char* Map(const Descriptor& file, std::size_t bytes, int flags)
{
  void* memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, flags, file.Number, 0);
  if (memory == MAP_FAILED)
  {
    Fail(errno);
  }
  return static_cast<unsigned char*>(memory);
}
}

MappedFile::MappedFile(unsigned char* begin, std::size_t bytes)
  : Begin(begin)
  , Bytes(bytes)
{
}

MappedFile::MappedFile(MappedFile&& other) noexcept
  : Begin(std::exchange(other.Begin, nullptr))
  , Bytes(std::exchange(other.Bytes, 0))
{
}

MappedFile::~MappedFile()
{
  if (this->Begin)
  {
    munmap(this->Begin, this->Bytes);
  }
}

MappedFile MappedFile::Open(const std::string& path)
{
  const Descriptor file(path, O_RDONLY);
  struct stat status;
  if (fstat(file.Number, &status) != 0)
  {
    Fail(errno);
  }
  if (!S_ISREG(status.st_mode) || status.st_size <= 0)
  {
    throw std::runtime_error("it is empty, or no regular file");
  }
  const auto bytes = static_cast<std::size_t>(status.st_size);
  // Private, so that whoever writes into the memory changes neither the file nor crashes; without
  // reserving memory for that, which a file larger than the memory could not get.
  return MappedFile(Map(file, bytes, MAP_PRIVATE | MAP_NORESERVE), bytes);
}

MappedFile MappedFile::Create(const std::string& path, std::uint64_t bytes)
{
  const Descriptor file(path, O_RDWR | O_CREAT | O_TRUNC);
  if (bytes == 0 || bytes > static_cast<std::uint64_t>(std::numeric_limits<off_t>::max()))
  {
    Fail(EFBIG);
  }
  // A write into a mapped page for which the disk has no space would end the process.
  const int problem = posix_fallocate(file.Number, 0, static_cast<off_t>(bytes));
  if (problem != 0)
  {
    Fail(problem);
  }
  return MappedFile(Map(file, bytes, MAP_SHARED), bytes);
}

void MappedFile::Advise(std::size_t begin, std::size_t bytes, int advice) const
{
  static const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const std::size_t first = begin / page * page;
  if (bytes > 0)
  {
    madvise(this->Begin + first, begin + bytes - first, advice); // may fail: it is only advice
  }
}

void MappedFile::Announce(std::size_t begin, std::size_t bytes) const
{
  this->Advise(begin, bytes, MADV_WILLNEED);
}

void MappedFile::ReadAtRandom(std::size_t begin, std::size_t bytes) const
{
  this->Advise(begin, bytes, MADV_RANDOM);
}

void MappedFile::Flush() const
{
  if (msync(this->Begin, this->Bytes, MS_SYNC) != 0)
  {
    Fail(errno);
  }
}
}
