// SPDX-License-Identifier: BSD-3-Clause
#include "SetupKernelImplementation.h"

const SurfelSplatting::SetupKernel SurfelSplatting::SetupKernelAVX512 = {
  SurfelSplatting::MakeSplats, "AVX-512"
};
