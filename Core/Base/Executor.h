// SPDX-License-Identifier: BSD-3-Clause
/**
 * The threads that the core runs on are lent by its caller: vtkSMPTools in VTK, std::thread in
 * tests, none in the reference. Every stage writes results by index, so that pixels do not depend
 * on the number of threads.
 */
#pragma once

#include <atomic>
#include <cstddef>
#include <exception>

namespace SurfelSplatting
{
/// A function of [begin, end) that somebody else owns and that lives as long as the call that it is
/// handed to: nothing is copied or allocated.
class RangeFunction
{
public:
  template <typename Function>
  RangeFunction(const Function& function) // lambdas are handed over as they are
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

  /// Runs function over [0, size) in pieces of about grain (>= 1) elements and returns when all is
  /// done. Where a piece throws, one of the exceptions is thrown to the caller, when all threads
  /// have come back.
  virtual void For(std::size_t size, std::size_t grain, const RangeFunction& function) const = 0;
};

/// Keeps the first exception of several threads, to be thrown by the one that waits for them.
class ExceptionCarrier
{
public:
  /// Runs function unless another one has failed already.
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

  /// After all threads have come back.
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

/// Runs everything on the calling thread.
class SerialExecutor : public Executor
{
public:
  void For(std::size_t size, std::size_t grain, const RangeFunction& function) const override;
};

/// Runs on threads of the standard library, started for each call.
class ThreadExecutor : public Executor
{
public:
  explicit ThreadExecutor(unsigned int numberOfThreads);
  void For(std::size_t size, std::size_t grain, const RangeFunction& function) const override;

private:
  unsigned int NumberOfThreads;
};
}
