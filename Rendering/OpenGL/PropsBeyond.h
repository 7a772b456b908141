// SPDX-License-Identifier: BSD-3-Clause
/**
 * Which props may be seen beyond the border of a frame, from where they blur into it. Internal to
 * the module.
 */
#pragma once

#include "Rendering/OpenGL/PassFrame.h"

#include <vector>

class vtkProp;

namespace SurfelSplatting
{
/// The visible opaque props of a frame's renderer, other than surfels, that may draw anything
/// beyond the frame or within a few px of its border.
std::vector<vtkProp*> PropsBeyond(const PassFrame& frame);
}
