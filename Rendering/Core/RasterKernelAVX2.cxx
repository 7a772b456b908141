// SPDX-License-Identifier: BSD-3-Clause
#include "RasterKernelImplementation.h"

const SurfelSplatting::RasterKernel SurfelSplatting::RasterKernelAVX2 = { SurfelSplatting::AddSplat,
  SurfelSplatting::CloseBefore, SurfelSplatting::CloseAll, "AVX2" };
