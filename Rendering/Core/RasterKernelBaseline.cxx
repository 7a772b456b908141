// SPDX-License-Identifier: BSD-3-Clause
#include "RasterKernelImplementation.h"

const SurfelSplatting::RasterKernel SurfelSplatting::RasterKernelBaseline = {
  SurfelSplatting::AddSplat, SurfelSplatting::CloseBefore, SurfelSplatting::CloseAll, "baseline"
};
