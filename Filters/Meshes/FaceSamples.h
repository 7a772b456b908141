// SPDX-License-Identifier: BSD-3-Clause
/**
 * Points that are spread over the faces of a mesh, and their point data.
 */
#pragma once

#include "Filters/Meshes/MeshTriangles.h"

#include "vtkSmartPointer.h"

class vtkDataArray;
class vtkPolyData;

namespace SurfelGeometry
{
struct FaceSample
{
  int Triangle;
  Vector3 Weights; ///< of its corners; their sum is 1
};

/// About `count` of them, evenly by area, but denser on thin parts, around which there would be too
/// few: wires and rods would be dashes. Others lose a third of their points at most.
/// @param parts [n] of the triangles, or empty: all are as dense
std::vector<FaceSample> SpreadSamples(const std::vector<MeshTriangle>& triangles,
  const std::vector<Vector3>& positions, const std::vector<int>& parts, vtkIdType count);

/**
 * Points, point data and field data of the samples. Real numbers and colours are those in between,
 * others those of the nearest corner, as are bits and texts.
 * @param normals of the mesh, or null. Where they are vectors, corners without one, or whose normal
 *   leans on the face by more than CreaseAngle, as means over edges do, have that of the face;
 *   given ones tell which side it is.
 */
void InterpolateSamples(vtkPolyData* mesh, const std::vector<MeshTriangle>& triangles,
  const std::vector<FaceSample>& samples, vtkDataArray* normals, vtkPolyData* output);

/// Degrees between faces, from which on the edge between them is sharp.
constexpr double CreaseAngle = 30.0;

/// The active normals or the array "Normals"; null if there are none.
vtkDataArray* NormalsOfMesh(vtkPolyData* mesh);

/// Whether an array has three real numbers for each point.
bool AreVectors(vtkDataArray* array);

/// Whether the given normals at its corners tell the other side of a triangle.
bool IsTurned(const MeshTriangle& triangle, vtkDataArray* normals);
}
