// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Splats/SetupImplementation.h"

const SurfelSplatting::SetupTarget SurfelSplatting::SetupTargetAVX2 = {
  SurfelSplatting::MakeSplats<SurfelSplatting::VectorReal>,
  SurfelSplatting::MakeCentral<SurfelSplatting::VectorReal>,
  SurfelSplatting::SeeFromCell<SurfelSplatting::VectorReal>, "AVX2"
};
