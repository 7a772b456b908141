// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/SetupImplementation.h"

const SurfelSplatting::SetupTarget SurfelSplatting::SetupTargetBaseline = {
  SurfelSplatting::MakeSplats<SurfelSplatting::VectorReal>, "baseline"
};
