// SPDX-License-Identifier: BSD-3-Clause
// A cloud that does not fit is refused with what it needs and what would fit.
#include "Filters/Common/AvailableMemory.h"
#include "SurfelTesting.h"

#include <cstddef>
#include <fstream>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#ifdef __GLIBC__
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
