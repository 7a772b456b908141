// SPDX-License-Identifier: BSD-3-Clause
/**
 * The blocks of a representation's data, with their visibility, colour and opacity; and surfels
 * estimated from their points. Internal to the module.
 */
#pragma once

#include "vtkSmartPointer.h"

#include <vector>

class vtkCompositeDataDisplayAttributes;
class vtkDataObject;
class vtkMultiProcessController;
class vtkPolyData;

namespace SurfelViews
{
/// A leaf of the data.
struct Block
{
  vtkPolyData* Points = nullptr; ///< null where this process has none of them
  bool Visible = true;
  bool HasColor = false;
  double Color[3] = { 1.0, 1.0, 1.0 };
  bool HasOpacity = false;
  double Opacity = 1.0;
  unsigned int CompositeIndex = 0; ///< flat index in the data; 0: the data are not composite
};

/// All leaves, the same ones in the same order on every process. @param attributes or null
std::vector<Block> FindBlocks(vtkDataObject* data, vtkCompositeDataDisplayAttributes* attributes);

/**
 * The points themselves where they are surfels with a hierarchy. Otherwise surfels, the hierarchy
 * or both are made with the filters' default settings; a message reports an estimation. The point
 * array SurfelPointId then holds the ids of the input points.
 * @param controller of the processes that have pieces of the points; all call this together. Null:
 *                   this process has all points.
 */
vtkSmartPointer<vtkPolyData> MakeSurfels(
  vtkPolyData* points, vtkMultiProcessController* controller);

constexpr const char* PointIdArray = "SurfelPointId";
}
