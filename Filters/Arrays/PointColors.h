// SPDX-License-Identifier: BSD-3-Clause
/**
 * The colours of points: direct colours, which VTK shows as they are.
 */
#pragma once

#include "Filters/Common/RawVector.h"
#include "Filters/Neighbors/LocalCloud.h"

#include <vector>

class vtkDataArray;
class vtkPointSet;
class vtkUnsignedCharArray;
template <class Object>
class vtkSmartPointer;

namespace SurfelGeometry
{
/// Components that are changed: an opacity stays.
constexpr int ColorComponents = 3;

/// Red, green and blue of each point, 0 to 255, in the order of a cloud; empty: unknown.
using CloudColors = RawVector<unsigned char>; // [3n]

/// The array of points that other processes have sent: float, 0 to 255.
constexpr const char* FetchedColorsArray = "FetchedColors";

/// The point array with the colours: the active scalars, or else the first array, of unsigned char
/// with three or four components; of fetched points, their array. Null if there is none.
vtkDataArray* FindColors(vtkPointSet* points);

/// The same, but null for surfels: their colours interpolate already (ColorInterpolation.h).
vtkDataArray* FindColorsToInterpolate(vtkPointSet* points);

/// The colours of a cloud's points; empty if there are none.
CloudColors GatherColors(vtkPointSet* points, const LocalCloud& cloud);

/// A new array of the name and components of `colors`.
vtkSmartPointer<vtkUnsignedCharArray> NewColorsLike(vtkDataArray* colors, vtkIdType count);

/// Puts the array in place of the one that FindColors finds.
void ReplaceColors(vtkUnsignedCharArray* colors, vtkPointSet* points);

/// Replaces the colours of the points by others; opacities stay.
/// @param order [points] which of `colors` each point gets
void WriteColors(const CloudColors& colors, const std::vector<int>& order, vtkPointSet* points);
}
