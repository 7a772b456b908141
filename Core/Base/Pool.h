// SPDX-License-Identifier: BSD-3-Clause
/**
 * Objects that threads borrow and that keep their memory from frame to frame.
 */
#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace SurfelSplatting
{
template <typename T>
class Pool
{
public:
  /// Borrows an object of the pool until the end of this one's life.
  class Loan
  {
  public:
    explicit Loan(Pool& from)
      : From(from)
      , Object(from.Take())
    {
    }
    ~Loan() { this->From.PutBack(std::move(this->Object)); }
    Loan(const Loan&) = delete;
    Loan& operator=(const Loan&) = delete;
    T* operator->() const { return this->Object.get(); }
    T& operator*() const { return *this->Object; }

  private:
    Pool& From;
    std::unique_ptr<T> Object;
  };

private:
  std::unique_ptr<T> Take()
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    if (this->Free.empty())
    {
      return std::make_unique<T>();
    }
    std::unique_ptr<T> object = std::move(this->Free.back());
    this->Free.pop_back();
    return object;
  }

  void PutBack(std::unique_ptr<T> object)
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Free.push_back(std::move(object));
  }

  std::mutex Mutex;
  std::vector<std::unique_ptr<T>> Free;
};
}
