// SPDX-License-Identifier: BSD-3-Clause
/**
 * Arrays of VTK whose values are in a mapped file (Core/Files/ArrayFile.h). The file stays mapped
 * as long as one of its arrays exists. Internal to the module.
 */
#pragma once

#include "Core/Files/ArrayFile.h"

#include <vtkDataArray.h>
#include <vtkSmartPointer.h>

#include <memory>

namespace SurfelSplatting
{
/// An array with the name, the type and the values of a stored one, which are not copied.
vtkSmartPointer<vtkDataArray> MakeMappedArray(
  const std::shared_ptr<const ArrayFile>& file, const StoredArray& stored);

/// The file that holds the values of an array; null if they are not from MakeMappedArray.
std::shared_ptr<const ArrayFile> FindArrayFile(vtkDataArray* array);

/// The type of an array in a file; false if files have no such type.
bool FindStoredType(vtkDataArray* array, ArrayType& type);

/// Whether files hold such an array: of numbers, with a name that is not too long.
bool IsStorable(vtkAbstractArray* array);

/// The array itself if it is one block of memory of this VTK type, otherwise a copy that is.
vtkSmartPointer<vtkDataArray> AsType(vtkDataArray* array, int type);
}
