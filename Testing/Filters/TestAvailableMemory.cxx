// SPDX-License-Identifier: BSD-3-Clause
// A cloud that does not fit is refused with what it needs and what would fit.
#include "Filters/Common/AvailableMemory.h"
#include "SurfelTesting.h"

#include <limits>

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
