// SPDX-License-Identifier: BSD-3-Clause
/**
 * A rank that lacks memory for a message, or for anything: all ranks throw, and none waits for it.
 * The program's own operator new refuses what is too large for a thread.
 */
#include "Core/Picture/SplatExchange.h"
#include "Filters/Neighbors/NeighborGraph.h"
#include "Filters/Partition/PartitionedCloud.h"
#include "Filters/Partition/SharedOrientation.h"
#include "Parallel/ControllerRanks.h"
#include "SurfelTesting.h"
#include "ThreadController.h"

#include "vtkPointCloudCleaning.h"
#include "vtkSurfelEstimation.h"
#include "vtkSurfelNormalization.h"

#include <doctest/doctest.h>

#include <atomic>
#include <cstdlib>
#include <limits>
#include <new>

namespace
{
constexpr std::size_t Unlimited = std::numeric_limits<std::size_t>::max();
thread_local std::size_t Largest = Unlimited; // bytes that this thread gets at once
}

void* operator new(std::size_t size)
{
  void* memory = size <= Largest ? std::malloc(size > 0 ? size : 1) : nullptr;
  if (!memory)
  {
    throw std::bad_alloc();
  }
  return memory;
}
void operator delete(void* memory) noexcept
{
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept
{
  std::free(memory);
}

using namespace SurfelSplatting;

namespace
{
constexpr std::size_t Long = 100'000;

/// How many of three ranks throw RanksLackMemory if one gets not more than so much at once.
template <typename Function>
int CountThrows(std::size_t largest, const Function& function, int limited = 1)
{
  std::atomic<int> thrown{ 0 };
  SurfelTesting::ThreadController::Run(3, [&](vtkMultiProcessController* controller) {
    ControllerRanks ranks(controller);
    try
    {
      function(ranks, ranks.Rank() == limited ? largest : Unlimited);
    }
    catch (const RanksLackMemory&)
    {
      ++thrown;
    }
    Largest = Unlimited;
    CHECK(ranks.All(true)); // they are at the same place
  });
  return thrown;
}

/// Each rank gets a long message from each.
void Exchange(Ranks& ranks, std::size_t largest)
{
  std::vector<Message> messages(3, Message(Long, static_cast<unsigned char>(ranks.Rank())));
  Largest = largest;
  const std::vector<Message> received = ranks.Exchange(std::move(messages));
  for (std::size_t sender = 0; sender < 3; ++sender)
  {
    CHECK(received[sender] == Message(Long, static_cast<unsigned char>(sender)));
  }
}

TEST_CASE("No memory for a message")
{
  CHECK(CountThrows(Unlimited, Exchange) == 0);
  CHECK(CountThrows(Long / 2, Exchange) == 3);
}

/// The root has memory for a message, but not for one to each rank.
TEST_CASE("No memory for copies of a message")
{
  const auto share = [](Ranks& ranks, std::size_t largest) {
    const Message own(Long, 1);
    Largest = largest;
    ranks.Share([&] { return own; });
  };
  CHECK(CountThrows(Unlimited, share) == 0);
  CHECK(CountThrows(Long / 2, share) == 3);
}

/// A rank has no memory for the message that it is to make.
TEST_CASE("No memory to make a message")
{
  const auto make = [] { return Message(Long, 1); };
  const auto toRoot = [&](Ranks& ranks, std::size_t largest) {
    Largest = largest;
    const std::vector<Message> received = ranks.ToRoot(make);
    CHECK(received.size() == (ranks.IsRoot() ? 3 : 0));
  };
  CHECK(CountThrows(Unlimited, toRoot) == 0);
  CHECK(CountThrows(Long / 2, toRoot) == 3);
  const auto shareLargest = [](Ranks& ranks, std::size_t largest) {
    std::vector<float> values(Long, static_cast<float>(ranks.Rank()));
    Largest = largest;
    SplatExchange(ranks).ShareLargest(values);
    CHECK(values == std::vector<float>(Long, 2.0f));
  };
  CHECK(CountThrows(Unlimited, shareLargest) == 0);
  CHECK(CountThrows(Long, shareLargest) == 3);
}

/// A cloud of three ranks, and what each has fetched of it.
struct Fetched
{
  explicit Fetched(Ranks& ranks)
    : Whole(ranks,
        SurfelTesting::ToPolyData(
          SurfelTesting::MakeSphere(1.0, 2000, SurfelTesting::Random(1 + ranks.Rank())).Points))
  {
    const double origin[3] = { 0.0, 0.0, 0.0 };
    SurfelGeometry::GatherCloud(this->Fetch()->GetPoints(), origin, this->Cloud);
    const auto count = static_cast<std::size_t>(this->Cloud.Size());
    this->Graph.Ids.assign(SurfelGeometry::KeptNeighbors * count, -1);
    this->Fits.assign(count, SurfelGeometry::PlaneFit());
    this->Results.Components = 3;
    for (std::size_t i = 0; i < count; ++i)
    {
      if (this->Whole.IsInRegion(this->Cloud.InputIds[i]))
      {
        this->Results.Points.push_back(this->Cloud.InputIds[i]);
      }
    }
    this->Results.Values.resize(3 * this->Results.Points.size());
  }

  vtkSmartPointer<vtkPolyData> Fetch() { return this->Whole.Fetch(0.1, {}); }

  SurfelGeometry::PartitionedCloud Whole;
  SurfelGeometry::LocalCloud Cloud;
  SurfelGeometry::NeighborGraph Graph;
  SurfelGeometry::PlaneFits Fits;
  SurfelGeometry::PartitionedCloud::Results Results;
};

/// Whatever the rank does not get, all ranks throw or none.
template <typename Function>
void CheckAllThrow(int limited, const Function& function)
{
  const auto run = [&](Ranks& ranks, std::size_t largest) {
    Fetched fetched(ranks);
    Largest = largest;
    function(ranks, fetched);
  };
  CHECK(CountThrows(4096, run, limited) == 3);
  for (std::size_t largest = 5000; largest < 5'000'000; largest += largest / 4)
  {
    const int thrown = CountThrows(largest, run, limited);
    CHECK((thrown == 3 || thrown == 0));
  }
  CHECK(CountThrows(Unlimited, run, limited) == 0);
}

TEST_CASE("No memory for a part of a cloud")
{
  CheckAllThrow(1, [](Ranks&, Fetched& fetched) { fetched.Fetch(); });
  CheckAllThrow(1, [](Ranks&, Fetched& fetched) { fetched.Whole.Return(fetched.Results); });
}

/// The root does.
TEST_CASE("No memory to orient a cloud")
{
  CheckAllThrow(0, [](Ranks& ranks, Fetched& fetched) {
    SurfelGeometry::OrientationResult result;
    SurfelGeometry::SharedOrientation(ranks, fetched.Whole)
      .Orient(fetched.Cloud, fetched.Graph, {}, { nullptr, 0.0, 1.0 }, fetched.Fits, result);
  });
}

/// How many of three ranks report an error of a filter if the second one gets not more than so much
/// at once. Those have no output, and the others have theirs.
template <typename Filter, typename Change>
int CountErrors(std::size_t largest, vtkPolyData* const inputs[3], const Change& change)
{
  std::atomic<int> errors{ 0 }, without{ 0 };
  SurfelTesting::ThreadController::Run(3, [&](vtkMultiProcessController* controller) {
    const int rank = controller->GetLocalProcessId();
    vtkNew<Filter> filter;
    const SurfelTesting::Messages messages(filter);
    filter->SetController(controller);
    change(filter.Get());
    vtkNew<vtkPolyData> input;
    input->ShallowCopy(inputs[rank]);
    filter->SetInputData(input);
    Largest = rank == 1 ? largest : Unlimited;
    filter->Update();
    Largest = Unlimited;
    errors += messages.Errors.empty() ? 0 : 1;
    without += filter->GetOutput()->GetNumberOfPoints() == 0 ? 1 : 0;
  });
  CHECK(errors == without);
  return errors;
}

/// Whatever the rank does not get, in whatever step, all report an error or none.
template <typename Filter, typename Change>
void CheckAllReport(vtkPolyData* const inputs[3], const Change& change)
{
  CHECK(CountErrors<Filter>(4096, inputs, change) == 3);
  for (std::size_t largest = 5000; largest < 1'000'000; largest += largest / 4)
  {
    const int errors = CountErrors<Filter>(largest, inputs, change);
    CHECK((errors == 3 || errors == 0));
  }
  CHECK(CountErrors<Filter>(Unlimited, inputs, change) == 0);
}

/// Parts of a noisy sphere with colours, one for each rank, or surfels of these.
struct Parts
{
  explicit Parts(bool areSurfels)
  {
    for (int rank = 0; rank < 3; ++rank)
    {
      SurfelTesting::Random random(1 + rank);
      std::vector<SurfelTesting::Vec> points =
        SurfelTesting::MakeSphere(1.0, 2000, SurfelTesting::Random(7 + rank)).Points;
      for (auto& p : points)
      {
        p[0] += 0.02 * random();
      }
      vtkSmartPointer<vtkPolyData> data = SurfelTesting::ToPolyData(points);
      if (areSurfels)
      {
        vtkNew<vtkSurfelEstimation> estimation;
        estimation->SetController(nullptr);
        estimation->SetInputData(data);
        estimation->Update();
        data = estimation->GetOutput();
      }
      this->Data.push_back(data);
      this->Inputs[rank] = data;
    }
  }

  std::vector<vtkSmartPointer<vtkPolyData>> Data;
  vtkPolyData* Inputs[3];
};

TEST_CASE("No memory to estimate surfels")
{
  const Parts parts(false);
  for (const int mode : { vtkSurfelEstimation::CONSISTENT, vtkSurfelEstimation::TWO_SIDED })
  {
    CheckAllReport<vtkSurfelEstimation>(
      parts.Inputs, [mode](vtkSurfelEstimation* f) { f->SetOrientationMode(mode); });
  }
}

TEST_CASE("No memory to clean points")
{
  CheckAllReport<vtkPointCloudCleaning>(Parts(false).Inputs, [](vtkPointCloudCleaning*) {});
}

TEST_CASE("No memory to weight surfels")
{
  CheckAllReport<vtkSurfelNormalization>(Parts(true).Inputs, [](vtkSurfelNormalization*) {});
}

template <typename Filter>
void CheckReportsAlone(vtkPolyData* input)
{
  vtkNew<Filter> filter;
  const SurfelTesting::Messages messages(filter);
  filter->SetInputData(input);
  Largest = 4096;
  filter->Update();
  Largest = Unlimited;
  REQUIRE(!messages.Errors.empty());
  CHECK(messages.Errors[0].find("too little memory for 2000 points") != std::string::npos);
  CHECK(filter->GetOutput()->GetNumberOfPoints() == 0);
}

TEST_CASE("No memory alone")
{
  CheckReportsAlone<vtkSurfelEstimation>(Parts(false).Inputs[0]);
  CheckReportsAlone<vtkPointCloudCleaning>(Parts(false).Inputs[0]);
  CheckReportsAlone<vtkSurfelNormalization>(Parts(true).Inputs[0]);
}
}
