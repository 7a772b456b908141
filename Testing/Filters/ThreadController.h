// SPDX-License-Identifier: BSD-3-Clause
/**
 * Processes of a vtkMultiProcessController that are threads of the test: what filters and passes do
 * together, without MPI.
 */
#pragma once

#include "vtkCommunicator.h"
#include "vtkMultiProcessController.h"
#include "vtkObjectFactory.h"
#include "vtkSmartPointer.h"

#include <condition_variable>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <thread>
#include <tuple>
#include <vector>

namespace SurfelTesting
{
/// Letters on their way, by sender, receiver and tag.
class MailBox
{
public:
  using Key = std::tuple<int, int, int>;

  void Put(const Key& key, const void* data, std::size_t size)
  {
    const auto* bytes = static_cast<const char*>(data);
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Letters[key].emplace_back(bytes, bytes + size);
    this->Changed.notify_all();
  }

  std::vector<char> Take(const Key& key)
  {
    std::unique_lock<std::mutex> lock(this->Mutex);
    this->Changed.wait(lock, [&]() { return !this->Letters[key].empty(); });
    std::vector<char> letter = std::move(this->Letters[key].front());
    this->Letters[key].pop_front();
    return letter;
  }

private:
  std::map<Key, std::deque<std::vector<char>>> Letters;
  std::mutex Mutex;
  std::condition_variable Changed;
};

class ThreadCommunicator : public vtkCommunicator
{
public:
  static ThreadCommunicator* New();
  vtkTypeMacro(ThreadCommunicator, vtkCommunicator);

  void Join(MailBox* box, int size, int rank)
  {
    this->Box = box;
    this->MaximumNumberOfProcesses = this->NumberOfProcesses = size;
    this->LocalProcessId = rank;
  }

  int SendVoidArray(const void* data, vtkIdType length, int type, int to, int tag) override
  {
    const auto size = static_cast<std::size_t>(length) * vtkAbstractArraySize(type);
    this->Box->Put({ this->LocalProcessId, to, tag }, data, size);
    return 1;
  }

  int ReceiveVoidArray(void* data, vtkIdType length, int type, int from, int tag) override
  {
    const std::vector<char> letter = this->Box->Take({ from, this->LocalProcessId, tag });
    const std::size_t size = vtkAbstractArraySize(type);
    if (letter.size() > static_cast<std::size_t>(length) * size)
    {
      return 0;
    }
    if (!letter.empty())
    {
      std::memcpy(data, letter.data(), letter.size());
    }
    this->Count = static_cast<vtkIdType>(letter.size() / size);
    return 1;
  }

private:
  static std::size_t vtkAbstractArraySize(int type)
  {
    switch (type)
    {
      vtkTemplateMacro(return sizeof(VTK_TT));
      default:
        return 1;
    }
  }

  MailBox* Box = nullptr;
};
vtkStandardNewMacro(ThreadCommunicator);

class ThreadController : public vtkMultiProcessController
{
public:
  static ThreadController* New();
  vtkTypeMacro(ThreadController, vtkMultiProcessController);

  /// Runs function(controller) on so many threads, each as a process of its own.
  static void Run(int size, const std::function<void(vtkMultiProcessController*)>& function)
  {
    MailBox box;
    std::vector<std::thread> threads;
    for (int rank = 0; rank < size; ++rank)
    {
      threads.emplace_back([&box, &function, size, rank]() {
        vtkNew<ThreadCommunicator> communicator;
        communicator->Join(&box, size, rank);
        vtkNew<ThreadController> controller;
        controller->Communicator = communicator;
        function(controller);
        controller->Communicator = nullptr;
      });
    }
    for (std::thread& thread : threads)
    {
      thread.join();
    }
  }

  void Initialize(int*, char***) override {}
  void Initialize(int*, char***, int) override {}
  void Finalize() override {}
  void Finalize(int) override {}
  void SingleMethodExecute() override {}
  void MultipleMethodExecute() override {}
  void CreateOutputWindow() override {}
};
vtkStandardNewMacro(ThreadController);
}
