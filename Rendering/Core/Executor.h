// SPDX-License-Identifier: BSD-3-Clause
/**
 * The threads that the core runs on are lent by its caller: vtkSMPTools in VTK, std::thread in tests, none in the
 * reference. Every stage writes results by index, so that pixels do not depend on the number of threads.
 */
#pragma once

#include <cstddef>
#include <functional>

namespace SurfelSplatting
{
class Executor
{
public:
  /// Called with disjoint [begin, end) that together cover the range.
  using RangeFunction = std::function<void(std::size_t begin, std::size_t end)>;

  virtual ~Executor() = default;

  /// Runs function over [0, size) in pieces of about grain (>= 1) elements and returns when all is done.
  virtual void For(std::size_t size, std::size_t grain, const RangeFunction& function) const = 0;
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
