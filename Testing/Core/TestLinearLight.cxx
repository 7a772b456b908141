// SPDX-License-Identifier: BSD-3-Clause
// sRGB: values of the standard, both ways and above 1.
#include "Core/Base/LinearLight.h"
#include "Testing/Shared/Check.h"

using namespace SurfelSplatting;

TEST_CASE("sRGB")
{
  CHECK_NEAR(LightOfCode(0.0), 0.0, 0.0);
  CHECK_NEAR(LightOfCode(1.0), 1.0, 1e-12);
  CHECK_NEAR(LightOfCode(0.5), 0.21404114048, 1e-9);
  CHECK_NEAR(CodeOfLight(0.5), 0.73535698305, 1e-9);
  CHECK_NEAR(LightOfCode(-1.0), 0.0, 0.0);
  CHECK_NEAR(CodeOfLight(-1.0), 0.0, 0.0);
  for (int i = 0; i <= 1000; ++i)
  {
    const double v = 0.01 * i;
    CHECK_NEAR(CodeOfLight(LightOfCode(v)), v, 1e-7 * (1.0 + v)); // the two pieces meet to 1e-8
  }
}
