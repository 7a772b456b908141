// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Raster/RasterImplementation.h"

const SurfelSplatting::RasterTarget SurfelSplatting::RasterTargetBaseline = {
  SurfelSplatting::AddSplat, SurfelSplatting::AddGaussian, SurfelSplatting::AddTent,
  SurfelSplatting::AddRun, SurfelSplatting::HiddenFrom, SurfelSplatting::CloseAll, "baseline"
};
