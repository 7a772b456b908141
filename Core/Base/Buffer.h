// SPDX-License-Identifier: BSD-3-Clause
/**
 * An array that keeps its memory from frame to frame and does not initialise new elements.
 */
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <new>
#include <type_traits>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace SurfelSplatting
{
template <typename T>
class Buffer
{
  static_assert(std::is_trivial<T>::value, "elements are neither constructed nor destroyed");

public:
  std::size_t Size() const { return this->Count; }

  /// Keeps the elements; new ones are undefined. The first allocation has exactly this size, later
  /// ones have room to grow by half.
  void Resize(std::size_t count)
  {
    if (count > this->Capacity)
    {
      const std::size_t capacity =
        this->Capacity == 0 ? count : std::max(count, this->Capacity + this->Capacity / 2);
      Memory elements = Allocate(capacity * sizeof(T));
      std::copy_n(this->Elements.get(), this->Count, elements.get());
      this->Elements.swap(elements);
      this->Capacity = capacity;
    }
    this->Count = count;
  }

  void Clear() { this->Count = 0; }

  T& operator[](std::size_t i) { return this->Elements[i]; }
  const T& operator[](std::size_t i) const { return this->Elements[i]; }
  T* Data() { return this->Elements.get(); }
  const T* Data() const { return this->Elements.get(); }

private:
  static constexpr std::size_t CacheLine = 64, LargePage = std::size_t{ 1 } << 21;
  struct Deleter
  {
    std::align_val_t Alignment;
    void operator()(T* elements) const { ::operator delete[](elements, this->Alignment); }
  };
  using Memory = std::unique_ptr<T[], Deleter>;

  /// Large pages where the system has them: splats are read in the order of depth, and a frame of a
  /// million waits 2 % of its time for the addresses of small ones.
  static Memory Allocate(std::size_t bytes)
  {
    const std::align_val_t alignment{ bytes < LargePage ? CacheLine : LargePage };
    Memory elements(static_cast<T*>(::operator new[](bytes, alignment)), Deleter{ alignment });
#if defined(MADV_HUGEPAGE)
    if (bytes >= LargePage)
    {
      madvise(elements.get(), bytes / LargePage * LargePage, MADV_HUGEPAGE); // only advice
    }
#endif
    return elements;
  }

  Memory Elements{ nullptr, Deleter{ std::align_val_t{ CacheLine } } };
  std::size_t Count = 0;
  std::size_t Capacity = 0;
};
}
