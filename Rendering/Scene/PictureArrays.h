// SPDX-License-Identifier: BSD-3-Clause
/**
 * The arrays of a picture (Documentation/DataContract.md). Internal to the module.
 */
#pragma once

#include <vtkSmartPointer.h>
#include <vtkType.h>

class vtkFloatArray;
class vtkImageData;

namespace SurfelSplatting
{
class DeepImage;
struct SplatContext;

vtkSmartPointer<vtkFloatArray> NewPixelArray(const char* name, int components, vtkIdType pixels);

void AddDeepSamples(const DeepImage& deep, vtkImageData* output);

/// Where the picture was taken from and through which lens.
void AddCamera(const SplatContext& context, vtkImageData* output);
}
