// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/SetupImplementation.h"

const SurfelSplatting::SetupTarget SurfelSplatting::SetupTargetAVX512 = {
  SurfelSplatting::MakeSplats<SurfelSplatting::VectorReal>, "AVX-512"
};
