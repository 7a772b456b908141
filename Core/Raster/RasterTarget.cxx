// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Raster/RasterTarget.h"

#include "Core/Simd/InstructionSet.h"

#include <cstdlib>
#include <string>
namespace SurfelSplatting
{
float SP[16];
static const bool initialised = [] {
  const float def[16] = { 0.1f, 0.3f, 0.1f, 1.0f, 1.0f, 1.0f, 1.0f, 0.0f, 1,0,1,0.02f,0.5f,1,1,0.3f };
  for (int i = 0; i < 16; ++i)
  {
    const char* e = std::getenv(("SP" + std::to_string(i)).c_str());
    SP[i] = e ? (float)std::atof(e) : def[i];
  }
  return true;
}();
const RasterTarget& SelectRasterTarget()
{
#ifdef SURFELSPLATTING_X86_TARGETS
  return TargetChoice<RasterTarget>{ &RasterTargetBaseline, &RasterTargetAVX2, &RasterTargetAVX512 }
    .Best();
#else
  return RasterTargetBaseline;
#endif
}
}
