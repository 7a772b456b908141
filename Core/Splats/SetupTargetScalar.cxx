// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/SetupImplementation.h"

const SurfelSplatting::SetupTarget SurfelSplatting::SetupTargetScalar = {
  SurfelSplatting::MakeSplats<double>, "scalar"
};
