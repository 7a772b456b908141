// SPDX-License-Identifier: BSD-3-Clause
#include "InstructionSet.h"
#include "RasterKernel.h"
#include "SetupKernel.h"

namespace SurfelSplatting
{
const RasterKernel& SelectRasterKernel()
{
  switch (DetectInstructionSet())
  {
#ifdef SURFELSPLATTING_X86_KERNELS
    case InstructionSet::AVX512:
      return RasterKernelAVX512;
    case InstructionSet::AVX2:
      return RasterKernelAVX2;
#endif
    default:
      return RasterKernelBaseline;
  }
}

const SetupKernel& SelectSetupKernel()
{
  switch (DetectInstructionSet())
  {
#ifdef SURFELSPLATTING_X86_KERNELS
    case InstructionSet::AVX512:
      return SetupKernelAVX512;
    case InstructionSet::AVX2:
      return SetupKernelAVX2;
#endif
    default:
      return SetupKernelBaseline;
  }
}
}
