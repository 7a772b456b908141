// SPDX-License-Identifier: BSD-3-Clause
/**
 * The processes that work together on one cloud or one picture, independent of what carries their
 * messages (MPI in VTK, threads in tests).
 *
 * Every call is collective: all ranks make the same calls in the same order, and none returns
 * before its messages have arrived. A rank that has failed still takes part and reports it (All,
 * DoOwn), so that the other ranks do not wait for it.
 */
#pragma once

#include <cstddef>
#include <cstring>
#include <functional>
#include <new>
#include <type_traits>
#include <vector>

namespace SurfelSplatting
{
using Message = std::vector<unsigned char>;

/// Thrown on all ranks if one of them lacks memory.
class RanksLackMemory : public std::bad_alloc
{
};

class Ranks
{
public:
  virtual ~Ranks() = default;
  virtual int Size() const = 0;
  virtual int Rank() const = 0;

  /// Sends message r to rank r, and returns the messages received: [sender].
  /// @throw RanksLackMemory
  virtual std::vector<Message> Exchange(std::vector<Message> messages) = 0;

  /// Whether the value is true on all ranks. Needs no memory, so that a lack of it can be told.
  virtual bool All(bool value) = 0;

  bool IsRoot() const { return this->Rank() == 0; }

  /// Makes a message. A rank that lacks memory for its own tells all others.
  using Packing = std::function<Message()>;

  /// Sends the same message to all ranks, and returns the messages of all: [sender].
  /// @throw RanksLackMemory, DamagedMemory
  std::vector<Message> Share(const Packing& pack);

  /// Returns the message of rank 0 on all ranks; the others make none.
  /// @throw RanksLackMemory, DamagedMemory
  Message FromRoot(const Packing& pack);

  /// Returns the messages of all ranks on rank 0, and nothing on the others.
  /// @throw RanksLackMemory, DamagedMemory
  std::vector<Message> ToRoot(const Packing& pack);

  bool Any(bool value) { return !this->All(!value); }
  double Largest(double value);

  /// The value of rank 0.
  double RootValue(double value);

  /// Does what each rank does by itself. If memory lacks on one, or its file is damaged, all throw.
  /// @throw RanksLackMemory, DamagedMemory
  void DoOwn(const std::function<void()>& work);

  /// Does work in which the ranks call Share and DoOwn together, and All or Any directly behind
  /// these, and each works by itself in between. If memory lacks on one, wherever, all throw.
  /// @throw RanksLackMemory, DamagedMemory
  void DoTogether(const std::function<void()>& work);
};

/// Adds plain values to a message.
template <typename T>
void Put(const T* values, std::size_t count, Message& message)
{
  static_assert(std::is_trivially_copyable<T>::value, "values are copied byte by byte");
  const std::size_t end = message.size();
  message.resize(end + count * sizeof(T));
  if (count > 0)
  {
    std::memcpy(message.data() + end, values, count * sizeof(T));
  }
}

template <typename T>
void Put(const T& value, Message& message)
{
  Put(&value, 1, message);
}

/// A message of one value.
template <typename T>
Message MessageOf(const T& value)
{
  Message message;
  Put(value, message);
  return message;
}

/// Reads values from a message in the order in which they were put.
class MessageReader
{
public:
  explicit MessageReader(const Message& message)
    : Next(message.data())
    , End(message.data() + message.size())
  {
  }

  template <typename T>
  void Get(T* values, std::size_t count)
  {
    static_assert(std::is_trivially_copyable<T>::value, "values are copied byte by byte");
    if (count > 0)
    {
      std::memcpy(static_cast<void*>(values), this->Next, count * sizeof(T));
    }
    this->Next += count * sizeof(T);
  }

  template <typename T>
  T Get()
  {
    T value;
    this->Get(&value, 1);
    return value;
  }

  /// Bytes that are left.
  std::size_t Size() const { return static_cast<std::size_t>(this->End - this->Next); }

private:
  const unsigned char *Next, *End;
};
}
