// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Raster/RasterTarget.h"

#include "Core/Simd/InstructionSet.h"

namespace SurfelSplatting
{
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
