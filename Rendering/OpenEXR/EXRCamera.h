// SPDX-License-Identifier: BSD-3-Clause
/**
 * Writes and reads the camera and lens of a picture in an OpenEXR header. Internal to the module.
 *
 * Every OpenEXR file has a screen window; (0, 0) with width 1 means that there is none. A window
 * that really has these values is written with the next larger float as its width.
 */
#pragma once

#include <OpenEXR/ImfForward.h>

class vtkFieldData;
class vtkImageData;

namespace SurfelSplatting
{
/// Adds attributes from the field data of a picture (SurfelArrays.h), as far as it has them.
void WriteCamera(vtkImageData* image, Imf::Header& header);

/// Adds field data for the picture in the data window, as far as the header has attributes.
void ReadCamera(const Imf::Header& header, vtkFieldData* data);
}
