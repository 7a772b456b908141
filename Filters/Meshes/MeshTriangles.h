// SPDX-License-Identifier: BSD-3-Clause
/**
 * The faces of a mesh as triangles, and whether its vertices tell the surface.
 */
#pragma once

#include "Filters/Common/VectorMath.h"

#include "vtkType.h"

#include <array>
#include <vector>

class vtkPoints;
class vtkPolyData;

namespace SurfelGeometry
{
struct MeshTriangle
{
  std::array<vtkIdType, 3> Corners; ///< in the order of the face
  Vector3 Normal;                   ///< unit length, by this order
  double Area;                      ///< above 0, finite
};

std::vector<Vector3> PositionsOf(vtkPoints* points);

/// Of polygons, which may be concave, and of strips. Faces without area, of points that are not
/// finite, or of none, are left out.
/// @param positions [n] of the points of the mesh
std::vector<MeshTriangle> TrianglesOf(vtkPolyData* mesh, const std::vector<Vector3>& positions);

double TotalArea(const std::vector<MeshTriangle>& triangles);

/// Square root of the area of the face in the middle of the whole area, over the spacing that the
/// vertices would have if they were spread evenly: 0.7 of an even mesh.
double Coarseness(const std::vector<MeshTriangle>& triangles, vtkIdType vertices);

/// Corners by their places: faces that meet may have points of their own there.
struct PlacedCorners
{
  std::vector<std::array<int, 3>> Triangles; // numbers of places
  vtkIdType Points = 0;                      // of the mesh, that are corners
  vtkIdType Places = 0;
};
PlacedCorners PlaceCorners(
  const std::vector<MeshTriangle>& triangles, const std::vector<Vector3>& positions);
}
