// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Raster/RasterTarget.h"
#include "Core/Simd/InstructionSet.h"
#include "Core/Splats/SetupTarget.h"

namespace SurfelSplatting
{
const RasterTarget& SelectRasterTarget()
{
  switch (DetectInstructionSet())
  {
#ifdef SURFELSPLATTING_X86_TARGETS
    case InstructionSet::AVX512:
      return RasterTargetAVX512;
    case InstructionSet::AVX2:
      return RasterTargetAVX2;
#endif
    default:
      return RasterTargetBaseline;
  }
}

const SetupTarget& SelectSetupTarget()
{
  switch (DetectInstructionSet())
  {
#ifdef SURFELSPLATTING_X86_TARGETS
    case InstructionSet::AVX512:
      return SetupTargetAVX512;
    case InstructionSet::AVX2:
      return SetupTargetAVX2;
#endif
    default:
      return SetupTargetBaseline;
  }
}
}
