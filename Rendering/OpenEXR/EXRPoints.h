// SPDX-License-Identifier: BSD-3-Clause
/**
 * Where in space a picture's samples are. Internal to the module.
 */
#pragma once

class vtkImageData;
class vtkPolyData;

namespace SurfelSplatting
{
/// One vertex per deep sample, or per pixel with a depth, where that is finite. Of a picture with
/// WorldToCamera and ScreenWindow in world coordinates, else (x + 1/2, y + 1/2, depth) in pixels.
void MakePoints(vtkImageData* image, double pixelAspectRatio, vtkPolyData* points);
}
