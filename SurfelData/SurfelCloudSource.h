// SPDX-License-Identifier: BSD-3-Clause
/**
 * Points the core's cloud to the arrays of a vtkPolyData of surfels
 * (Documentation/DataContract.md).
 */
#pragma once

#include "Core/Surfels/SurfelCloud.h"

#include <vtkDataArray.h>
#include <vtkSmartPointer.h>

#include <vector>

class vtkPointSet;
class vtkPolyData;

namespace SurfelSplatting
{
/// A cloud and the arrays that it points to.
struct SurfelCloudSource
{
  SurfelCloud Cloud;
  std::vector<vtkSmartPointer<vtkDataArray>> Arrays;

  /// The values of an array: its own if it is of type Array, otherwise a converted copy. The source
  /// keeps them alive. Null if there is no array.
  template <typename Array>
  typename Array::ValueType* Keep(vtkDataArray* array)
  {
    if (!array)
    {
      return nullptr;
    }
    vtkSmartPointer<Array> typed = Array::SafeDownCast(array);
    if (!typed)
    {
      typed = vtkSmartPointer<Array>::New();
      typed->DeepCopy(array);
    }
    this->Arrays.push_back(typed);
    return typed->GetPointer(0);
  }
};

/// Points the cloud to the arrays of surfels, whose types and sizes were checked.
void SetSurfels(vtkPolyData* surfels, SurfelCloudSource& source);

/// The local origin, to be added to the points: the field array SurfelOrigin, three values in any
/// shape; 0 if there is none.
/// @param surfels may be null
void ReadOrigin(vtkPointSet* surfels, double origin[3]);
}
