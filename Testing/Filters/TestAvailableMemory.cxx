// SPDX-License-Identifier: BSD-3-Clause
// A cloud that does not fit is refused with what it needs and what would fit.
#include "Filters/Common/AvailableMemory.h"
#include "Filters/Common/StageProgress.h"
#include "SurfelTesting.h"
#include "vtkSurfelEstimation.h"

#include <atomic>
#include <chrono>
#include <cstddef>
#include <fstream>
#include <limits>
#include <memory>
#include <new>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#ifdef __GLIBC__
#include <sys/resource.h>
#include <unistd.h>
#endif

using namespace SurfelTesting;

TEST_CASE("Memory that points need")
{
  constexpr double gibibyte = 1024.0 * 1024.0 * 1024.0;
  CHECK(SurfelGeometry::AvailableMemory() > 0.0);
  CHECK(SurfelGeometry::CheckMemory(0, 400.0, 0.0).empty());
  CHECK(SurfelGeometry::CheckMemory(10000000, 400.0, 4.0 * gibibyte).empty());
  CHECK(SurfelGeometry::CheckMemory(1000000000, 400.0, std::numeric_limits<double>::infinity())
          .empty());
  const std::string said = SurfelGeometry::CheckMemory(100000000, 400.0, 24.0 * gibibyte);
  CHECK(said.find("100000000 points need about 37.3 GiB") == 0);
  CHECK(said.find("24 GiB are free") != std::string::npos);
  CHECK(said.find("to 64424509 points") != std::string::npos);
}

/// Out of a thread of VTK's it would end the process.
TEST_CASE("Memory that a thread lacks")
{
  const std::thread::id caller = std::this_thread::get_id();
  const auto fail = [caller](vtkIdType, vtkIdType) {
    // The threads take pieces faster than the caller, which waits for one of them to fail.
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    if (std::this_thread::get_id() != caller)
    {
      throw std::bad_alloc();
    }
  };
  for (const char* backend : { "STDThread", "TBB", "Sequential" })
  {
    if (!vtkSMPTools::SetBackend(backend))
    {
      continue;
    }
    vtkSMPTools::Initialize(4);
    const bool isAlone = vtkSMPTools::GetEstimatedNumberOfThreads() == 1;
    if (!isAlone && backend != std::string("Sequential"))
    {
      CHECK_THROWS_AS(SurfelGeometry::ParallelFor(0, 64, 1, fail), std::bad_alloc);
      const SurfelGeometry::StageProgress silent(nullptr, 0.0, 1.0);
      CHECK_THROWS_AS(SurfelGeometry::ParallelFor(1 << 18, silent, fail), std::bad_alloc);
    }
    std::atomic<vtkIdType> sum{ 0 };
    SurfelGeometry::ParallelFor(
      3, 1000, [&sum](vtkIdType begin, vtkIdType end) { sum += end - begin; });
    CHECK(sum == 997);
  }
}

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
/// A filter under ulimit -v says what is missing before it begins, instead of ending the process.
TEST_CASE("Limit of the process")
{
  rlimit before;
  getrlimit(RLIMIT_AS, &before);
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  constexpr rlim_t left = 64 << 20; // a quarter of what the points need
  rlimit limit = before;
  limit.rlim_cur = pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + left;
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(ToPolyData(std::vector<Vec>(1000000, Vec{ 0, 0, 0 })));
  const Messages said(estimation);
  setrlimit(RLIMIT_AS, &limit);
  const double available = SurfelGeometry::AvailableMemory();
  estimation->Update();
  setrlimit(RLIMIT_AS, &before);
  CHECK(available <= left);
  REQUIRE(!said.Errors.empty());
  CHECK(said.Errors[0].find("1000000 points need about") != std::string::npos);
}
#endif

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
double ResidentBytes()
{
  std::ifstream file("/proc/self/statm");
  double all = 0.0, resident = 0.0;
  file >> all >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

/// What is freed below a block in use stays the process's until it is given back.
TEST_CASE("Memory that is given back")
{
  constexpr std::size_t size = 1 << 16, count = 1 << 9;
  std::vector<std::unique_ptr<std::vector<char>>> blocks;
  for (std::size_t i = 0; i < count; ++i)
  {
    blocks.push_back(std::make_unique<std::vector<char>>(size, 1));
  }
  const std::unique_ptr<std::vector<char>> last = std::move(blocks.back());
  blocks.clear();
  const double before = ResidentBytes();
  SurfelGeometry::ReturnFreeMemory();
  CHECK(before - ResidentBytes() > 0.75 * size * count);
}
#endif
