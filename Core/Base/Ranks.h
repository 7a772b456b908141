// SPDX-License-Identifier: BSD-3-Clause
/**
 * The processes that work on one cloud or one picture together, whatever carries their messages.
 *
 * Every call is collective: all ranks make the same ones, in the same order, and none returns
 * before its messages have come. A rank that has failed takes part all the same and says so (All),
 * so that nobody waits for it.
 */
#pragma once

#include <cstddef>
#include <cstring>
#include <new>
#include <type_traits>
#include <vector>

namespace SurfelSplatting
{
using Message = std::vector<unsigned char>;

/// Thrown on all ranks where one of them lacks memory.
class RanksLackMemory : public std::bad_alloc
{
};

class Ranks
{
public:
  virtual ~Ranks() = default;
  virtual int Size() const = 0;
  virtual int Rank() const = 0;

  /// Sends message r to rank r, and returns those that came: [sender].
  virtual std::vector<Message> Exchange(std::vector<Message> messages) = 0;

  bool IsRoot() const { return this->Rank() == 0; }

  /// Sends the same message to all, and returns all ranks' ones.
  std::vector<Message> Share(const Message& message);

  /// Rank 0's message.
  Message FromRoot(const Message& message);

  /// All ranks' messages on rank 0; none elsewhere.
  std::vector<Message> ToRoot(Message message);

  bool All(bool mine);
  bool Any(bool mine) { return !this->All(!mine); }
  double Largest(double mine);

  /// The value that rank 0 has.
  double RootValue(double mine);
};

/// Adds plain values to a message.
template <typename T>
void Put(const T* values, std::size_t count, Message& message)
{
  static_assert(std::is_trivially_copyable<T>::value, "values go as they are in memory");
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

/// Takes values from a message in the order they were put.
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
    static_assert(std::is_trivially_copyable<T>::value, "values go as they are in memory");
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

  /// What is left.
  std::size_t Size() const { return static_cast<std::size_t>(this->End - this->Next); }

private:
  const unsigned char *Next, *End;
};
}
