// SPDX-License-Identifier: BSD-3-Clause
/**
 * Camera and lens of a picture in an OpenEXR header. Internal to the module.
 */
#pragma once

#include <OpenEXR/ImfForward.h>

class vtkImageData;

namespace SurfelSplatting
{
/// Adds what the picture's field data say (SurfelArrays.h); nothing where they say nothing.
void AddCamera(vtkImageData* image, Imf::Header& header);
}
