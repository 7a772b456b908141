// SPDX-License-Identifier: BSD-3-Clause
/**
 * Ranks that are threads of the test, and pass messages through memory.
 */
#pragma once

#include "Core/Base/Ranks.h"

#include <algorithm>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace SurfelSplatting
{
class ThreadRanks
{
public:
  /// Runs function(ranks) on so many threads, each with a rank of its own.
  static void Run(int size, const std::function<void(Ranks&)>& function)
  {
    Board board(size);
    std::vector<std::thread> threads;
    for (int rank = 0; rank < size; ++rank)
    {
      threads.emplace_back([&board, &function, rank]() {
        One one(board, rank);
        function(one);
      });
    }
    for (std::thread& thread : threads)
    {
      thread.join();
    }
  }

private:
  /// Where messages lie until all have been fetched.
  struct Board
  {
    explicit Board(int size)
      : Messages(static_cast<std::size_t>(size))
      , Values(static_cast<std::size_t>(size))
    {
    }

    void Wait()
    {
      std::unique_lock<std::mutex> lock(this->Mutex);
      const std::size_t round = this->Round;
      if (++this->Arrived == this->Messages.size())
      {
        this->Arrived = 0;
        ++this->Round;
        this->Changed.notify_all();
        return;
      }
      this->Changed.wait(lock, [&]() { return this->Round != round; });
    }

    std::vector<std::vector<Message>> Messages; ///< [sender][receiver]
    std::vector<unsigned char> Values;          ///< [rank] of All
    std::mutex Mutex;
    std::condition_variable Changed;
    std::size_t Arrived = 0, Round = 0;
  };

  class One : public Ranks
  {
  public:
    One(Board& board, int rank)
      : Shared(board)
      , Number(rank)
    {
    }
    int Size() const override { return static_cast<int>(this->Shared.Messages.size()); }
    int Rank() const override { return this->Number; }
    std::vector<Message> Exchange(std::vector<Message> messages) override
    {
      const auto me = static_cast<std::size_t>(this->Number);
      this->Shared.Messages[me] = std::move(messages);
      this->Shared.Wait();
      std::vector<Message> received;
      for (std::vector<Message>& sent : this->Shared.Messages)
      {
        received.push_back(std::move(sent[me]));
      }
      this->Shared.Wait();
      return received;
    }

    bool All(bool value) override
    {
      std::vector<unsigned char>& values = this->Shared.Values;
      values[static_cast<std::size_t>(this->Number)] = value ? 1 : 0;
      this->Shared.Wait();
      const bool all = std::count(values.begin(), values.end(), 0) == 0;
      this->Shared.Wait();
      return all;
    }

  private:
    Board& Shared;
    int Number;
  };
};
}
