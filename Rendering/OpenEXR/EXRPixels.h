// SPDX-License-Identifier: BSD-3-Clause
/**
 * Reads the pixels of an OpenEXR file into a picture (Documentation/DataContract.md). Internal to
 * the module.
 */
#pragma once

#include <OpenEXR/ImfForward.h>

#include <functional>

class vtkImageData;

namespace SurfelSplatting
{
class EXRInput;

/// Receives the share of the work that is done, [0, 1].
using EXRProgress = std::function<void(double)>;

/// Number of components of "Color": 4; 3 without A; 0 without R, G and B.
int NumberOfColorComponents(const Imf::Header& header);

/// These functions fill an image of the file's size. They throw a std::exception if they fail.
void ReadFlatPixels(EXRInput& input, vtkImageData* image, const EXRProgress& progress);
void ReadDeepPixels(EXRInput& input, vtkImageData* image, const EXRProgress& progress);
}
