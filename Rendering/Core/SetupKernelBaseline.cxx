// SPDX-License-Identifier: BSD-3-Clause
#include "SetupKernelImplementation.h"

const SurfelSplatting::SetupKernel SurfelSplatting::SetupKernelBaseline = {
  SurfelSplatting::MakeSplats, "baseline"
};
