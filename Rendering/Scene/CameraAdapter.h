// SPDX-License-Identifier: BSD-3-Clause
/**
 * Converts VTK's camera and lights into the core's view, lens and lights. Internal to the module.
 */
#pragma once

#include "Core/Base/Geometry.h"
#include "Core/Lens/Lens.h"
#include "Core/Lens/View.h"
#include "Core/Surfels/Shading.h"

#include <vector>

class vtkCamera;
class vtkLightCollection;
class vtkMatrix4x4;

namespace SurfelSplatting
{
/// The upper three rows of a matrix.
Affine3 ToAffine(vtkMatrix4x4* matrix);

/// The view of a camera. Any view and projection whose image plane is not sheared is supported:
/// view angle, window centre (tiles), parallel. The clipping range is left open.
View MakeView(vtkCamera* camera, const int size[2], double aspect);

/// The lens of a camera: FocalDisk is its diameter. If FocalDistance is 0, the distance to the
/// focal point is in focus.
Lens MakeLens(vtkCamera* camera);

/// The lights that are switched on, in camera space. Headlights and camera lights follow the
/// camera.
std::vector<Light> MakeLights(vtkLightCollection* lights, vtkCamera* camera, const View& view);
}
