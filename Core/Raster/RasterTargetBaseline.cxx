// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Raster/RasterImplementation.h"

const SurfelSplatting::RasterTarget SurfelSplatting::RasterTargetBaseline = {
  SurfelSplatting::AddBatch, SurfelSplatting::AddGaussian, SurfelSplatting::BeginRun,
  SurfelSplatting::AddRun, SurfelSplatting::HiddenFrom, SurfelSplatting::FindBright,
  SurfelSplatting::CloseAll, "baseline"
};
