// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/SetupTarget.h"

#include "Core/Simd/InstructionSet.h"

namespace SurfelSplatting
{
const SetupTarget& SelectSetupTarget()
{
#ifdef SURFELSPLATTING_X86_TARGETS
  return TargetChoice<SetupTarget>{ &SetupTargetBaseline, &SetupTargetAVX2, &SetupTargetAVX512 }
    .Best();
#else
  return SetupTargetBaseline;
#endif
}
}
