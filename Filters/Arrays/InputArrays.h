// SPDX-License-Identifier: BSD-3-Clause
/**
 * Checks and reads the input of the filters, and makes arrays for their output.
 */
#pragma once

#include "SurfelData/SurfelCloudSource.h"

#include "vtkNew.h"
#include "vtkSmartPointer.h"
#include "vtkType.h"

#include <initializer_list>
#include <string>

class vtkDataArray;
class vtkObject;
class vtkPointSet;

namespace SurfelGeometry
{
/// Empty if the neighbour search takes this many points, else what is wrong and what to do.
std::string CheckNumberOfPoints(vtkIdType points);

using SurfelSplatting::ReadOrigin;

/// The points; if some of their arrays have not one value for each point, a copy without these, of
/// which the filter warns. Hidden points, such as blanked ones of a grid, have no finite
/// coordinates in it, so that they are dropped, and rows of depth images stay. @param points may be
/// null
vtkSmartPointer<vtkPointSet> WithFittingArrays(vtkPointSet* points, vtkObject* filter);

/// The point array with this name; otherwise the active normals or the point array "Normals". Null
/// if there is none, or it has not three components.
vtkDataArray* FindNormals(vtkPointSet* input, const char* name);

/// Whether the normals are those of faces, as the field array of vtkPointsOnFaces tells. Where two
/// bodies touch, they point to both sides of one plane, and are right.
bool HasNormalsOfFaces(vtkPointSet* input);
constexpr const char* FacesArray = "ModelHasFaces";

/// The point array of the vectors from points to their scanners, world units, which may be zero.
/// Null if there is none, or it has not three components.
vtkDataArray* FindScanners(vtkPointSet* input);
constexpr const char* ToScannerArray = "ToScanner";

/// How many things something has happened to.
struct CountedThings
{
  vtkIdType Count;
  const char* Thing; // in the singular, whose plural ends in s
  const char* What;
};

/// Points that are nowhere, which all filters drop.
inline CountedThings DroppedPoints(vtkIdType count)
{
  return { count, "point", "with NaN or infinite coordinates, or hidden, dropped" };
}

/// Lists the counts above 0 for a warning: "3 duplicates dropped; 1 point ..."; empty if there are
/// none.
std::string ListCounts(std::initializer_list<CountedThings> counts);

template <typename Array>
vtkNew<Array> MakeArray(const char* name, int components, vtkIdType count)
{
  vtkNew<Array> array;
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(count);
  return array;
}
}
