// SPDX-License-Identifier: BSD-3-Clause
/**
 * The caller provides the threads that the core runs on: vtkSMPTools in VTK, std::thread in tests.
 * Every stage writes its results by index, so pixels do not depend on the number of threads.
 */
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>

namespace SurfelSplatting
{
/// Refers to a function of [begin, end), which must outlive the call that gets it. Nothing is
/// copied or allocated.
class RangeFunction
{
public:
  template <typename Function>
  RangeFunction(const Function& function) // implicit, for lambdas
    : Object(&function)
    , Call([](const void* object, std::size_t begin, std::size_t end) {
      (*static_cast<const Function*>(object))(begin, end);
    })
  {
  }

  void operator()(std::size_t begin, std::size_t end) const
  {
    this->Call(this->Object, begin, end);
  }

private:
  const void* Object;
  void (*Call)(const void*, std::size_t, std::size_t);
};

class Executor
{
public:
  /// Called with disjoint [begin, end) that together cover the range.
  using RangeFunction = SurfelSplatting::RangeFunction;

  virtual ~Executor() = default;

  /// Runs function over [0, size) in pieces of about grain (>= 1) elements and returns when all are
  /// done. If pieces throw, one of the exceptions is thrown to the caller after all threads have
  /// finished.
  virtual void For(std::size_t size, std::size_t grain, const RangeFunction& function) const = 0;
};

/// Keeps the first exception of several threads for the one that waits for them.
class ExceptionCarrier
{
public:
  /// Runs function, unless one has failed before.
  template <typename Function>
  void Run(Function&& function)
  {
    if (this->Failed)
    {
      return;
    }
    try
    {
      function();
    }
    catch (...)
    {
      if (!this->Failed.exchange(true))
      {
        this->First = std::current_exception();
      }
    }
  }

  /// Call it after all threads have finished.
  void Rethrow() const
  {
    if (this->First)
    {
      std::rethrow_exception(this->First);
    }
  }

private:
  std::atomic<bool> Failed{ false };
  std::exception_ptr First;
};

/// A loop's pieces. Each of several threads takes the next one until none is left, so that none
/// waits while another has more than its piece to do, and pieces begin in their order.
class LoopPieces
{
public:
  /// @param grain >= 1, elements of a piece @param function must outlive the pieces
  LoopPieces(std::size_t size, std::size_t grain, const RangeFunction& function)
    : Size(size)
    , Grain(grain)
    , Function(function)
  {
  }

  std::size_t Count() const { return (this->Size + this->Grain - 1) / this->Grain; }

  /// Called by each thread: runs pieces until all have begun.
  void Run()
  {
    const auto take = [this] { return this->Next.fetch_add(this->Grain); };
    for (std::size_t begin = take(); begin < this->Size; begin = take())
    {
      this->Carrier.Run([&] { this->Function(begin, std::min(this->Size, begin + this->Grain)); });
    }
  }

  /// Call it after all threads have finished.
  void Rethrow() const { this->Carrier.Rethrow(); }

private:
  const std::size_t Size, Grain;
  const RangeFunction Function;
  std::atomic<std::size_t> Next{ 0 };
  ExceptionCarrier Carrier;
};

/// Runs everything on the calling thread.
class SerialExecutor : public Executor
{
public:
  void For(std::size_t size, std::size_t grain, const RangeFunction& function) const override;
};
}
