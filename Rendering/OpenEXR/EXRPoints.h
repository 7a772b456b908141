// SPDX-License-Identifier: BSD-3-Clause
/**
 * Makes points in space from the samples of a picture. Internal to the module.
 */
#pragma once

class vtkImageData;
class vtkPolyData;

namespace SurfelSplatting
{
/// Makes one vertex per deep sample, or per pixel with a depth, if the depth is finite. A picture
/// with WorldToCamera and ScreenWindow gives world coordinates, others (x + 1/2, y + 1/2, depth)
/// with x and y in pixels.
void MakePoints(vtkImageData* image, double pixelAspectRatio, vtkPolyData* points);
}
