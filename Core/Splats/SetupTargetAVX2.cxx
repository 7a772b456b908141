// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/SetupImplementation.h"

const SurfelSplatting::SetupTarget SurfelSplatting::SetupTargetAVX2 = {
  SurfelSplatting::MakeSplats<SurfelSplatting::VectorReal>, "AVX2"
};
