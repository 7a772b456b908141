// SPDX-License-Identifier: BSD-3-Clause
/**
 * A vector whose new elements have no values: the threads that write them first share the time that
 * fresh memory takes. For numbers, and structures that are copied like them.
 */
#pragma once

#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace SurfelGeometry
{
template <typename T>
struct RawAllocator : std::allocator<T>
{
  template <typename U>
  struct rebind
  {
    using other = RawAllocator<U>;
  };

  template <typename U>
  void construct(U*)
  {
    static_assert(std::is_trivially_copyable<U>::value && std::is_trivially_destructible<U>::value,
      "an element that has no value yet is assigned to");
  }
  template <typename U, typename... Arguments>
  void construct(U* place, Arguments&&... arguments)
  {
    ::new (static_cast<void*>(place)) U(std::forward<Arguments>(arguments)...);
  }
};

template <typename T>
using RawVector = std::vector<T, RawAllocator<T>>;
}
