// SPDX-License-Identifier: BSD-3-Clause
/**
 * Makes the arrays of a picture (Documentation/DataContract.md). Internal to the module.
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

/// A float array with values still to be set.
vtkSmartPointer<vtkFloatArray> NewPixelArray(const char* name, int components, vtkIdType pixels);

/// Adds the point array SampleCount and the field data array DeepSamples.
void AddDeepSamples(const DeepImage& deep, vtkImageData* output);

/// Adds the field data arrays WorldToCamera, CameraLens and, in perspective, ScreenWindow.
void AddCameraArrays(const SplatContext& context, vtkImageData* output);
}
