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
#include <functional>

namespace SurfelSplatting
{
class Executor
{
public:
  /// Called with disjoint [begin, end) that together cover the range.
  using RangeFunction = std::function<void(std::size_t begin, std::size_t end)>;

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
