// SPDX-License-Identifier: BSD-3-Clause
/**
 * Points on the faces of meshes whose vertices do not tell the surface. Internal to the module.
 */
#pragma once

#include <vtkSmartPointer.h>

class vtkPolyData;

namespace SurfelViews
{
/**
 * Points that are spread evenly over the faces, where the vertices are too few or too uneven, as in
 * CAD, by the rule of the command line; otherwise the points as they are. Real numbers, colours and
 * normals are interpolated, and others are those of the nearest corner.
 */
vtkSmartPointer<vtkPolyData> PointsOnFaces(vtkPolyData* mesh);
}
