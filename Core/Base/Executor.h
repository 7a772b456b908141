// SPDX-License-Identifier: BSD-3-Clause
/**
 * The caller provides the threads that the core runs on: vtkSMPTools in VTK, std::thread in tests.
 * Every stage writes its results by index, so pixels do not depend on the number of threads.
 */
#pragma once

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

/// Runs everything on the calling thread.
class SerialExecutor : public Executor
{
public:
  void For(std::size_t size, std::size_t grain, const RangeFunction& function) const override;
};
}
