// SPDX-License-Identifier: BSD-3-Clause
#include "SetupKernelImplementation.h"

const SurfelSplatting::SetupKernel SurfelSplatting::SetupKernelAVX2 = { SurfelSplatting::MakeSplats,
  "AVX2" };
