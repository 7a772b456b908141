// SPDX-License-Identifier: BSD-3-Clause
/**
 * Camera and lens of a picture in an OpenEXR header. Internal to the module.
 *
 * OpenEXR gives every file a screen window and says that (0, 0) and width 1 stand for none; a
 * window that is truly so is written as wide as the next float.
 */
#pragma once

#include <OpenEXR/ImfForward.h>

class vtkFieldData;
class vtkImageData;

namespace SurfelSplatting
{
/// Adds what the picture's field data say (SurfelArrays.h); nothing where they say nothing.
void AddCamera(vtkImageData* image, Imf::Header& header);

/// The field data of the picture in the data window, as far as the header has them.
void ReadCamera(const Imf::Header& header, vtkFieldData* data);
}
