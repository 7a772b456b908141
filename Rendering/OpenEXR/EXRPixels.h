// SPDX-License-Identifier: BSD-3-Clause
/**
 * The pixels of an OpenEXR file as a picture (Documentation/DataContract.md). Internal to the
 * module.
 */
#pragma once

#include <OpenEXR/ImfForward.h>

#include <functional>

class vtkImageData;

namespace SurfelSplatting
{
class EXRInput;

/// Takes what is done of the whole, 0 to 1.
using EXRProgress = std::function<void(double)>;

/// Components of "Color": 4, 3 without A, 0 without R, G and B.
int NumberOfColorComponents(const Imf::Header& header);

/// Fill an image of the file's size. Throw what is wrong as a std::exception.
void ReadFlatPixels(EXRInput& input, vtkImageData* image, const EXRProgress& progress);
void ReadDeepPixels(EXRInput& input, vtkImageData* image, const EXRProgress& progress);
}
