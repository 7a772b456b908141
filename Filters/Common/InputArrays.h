// SPDX-License-Identifier: BSD-3-Clause
/**
 * What the filters read of their input and demand of it, and new arrays for their output.
 */
#pragma once

#include "vtkNew.h"
#include "vtkType.h"

#include <initializer_list>
#include <string>
#include <utility>

class vtkDataArray;
class vtkPolyData;
class vtkPointSet;

namespace SurfelGeometry
{
/// Empty where the input holds surfels (Documentation/DataContract.md), else what is wrong and what
/// to do.
std::string CheckSurfels(vtkPolyData* input);

/// The field array SurfelOrigin, three values in any shape; 0 where there is none.
void ReadOrigin(vtkPointSet* input, double origin[3]);

/// The point array of a name, where there is one; otherwise active normals, or a point array
/// "Normals". Null where there is none of three components.
vtkDataArray* FindNormals(vtkPointSet* input, const char* name);

/// What was met, how often, for a warning: "3 duplicates dropped; 1 ..."; empty where nothing was.
std::string ListCounts(std::initializer_list<std::pair<vtkIdType, const char*>> counts);

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
