// SPDX-License-Identifier: BSD-3-Clause
/**
 * The blocks of a representation's data, with their visibility, colour and opacity; and surfels
 * estimated from their points. Internal to the module.
 */
#pragma once

#include "vtkSmartPointer.h"

#include <vector>

class vtkBoundingBox;
class vtkCompositeDataDisplayAttributes;
class vtkDataObject;
class vtkMultiProcessController;
class vtkPolyData;

namespace SurfelViews
{
/// A part of the data with an appearance of its own: a leaf, or the pieces of one data set.
struct Block
{
  std::vector<vtkPolyData*> Pieces; ///< those that this process has; none is empty
  bool Visible = true;
  bool HasColor = false;
  double Color[3] = { 1.0, 1.0, 1.0 };
  bool HasOpacity = false;
  double Opacity = 1.0;
  unsigned int CompositeIndex = 0; ///< flat index in the data; 0: the data are not composite
};

/// All blocks, the same ones in the same order on every process. @param attributes or null
std::vector<Block> FindBlocks(vtkDataObject* data, vtkCompositeDataDisplayAttributes* attributes);

/// Adds the bounds of the block in world space, which the points of surfels with a local origin
/// lack.
void AddBounds(const Block& block, vtkBoundingBox& box);

/**
 * The points themselves where they are one piece, and surfels or Gaussians in space with a
 * hierarchy. Otherwise the pieces become one cloud, and surfels, the hierarchy or both are made
 * with the filters' default settings; a message reports an estimation. The point array
 * SurfelPointId then holds the ids of the points in their piece, and SurfelCompositeIndex, if there
 * are several pieces, the index of the piece.
 * @param controller of the processes that have pieces of the points; all call this together. Null:
 *                   this process has all points.
 */
vtkSmartPointer<vtkPolyData> MakeSurfels(
  const std::vector<vtkPolyData*>& pieces, vtkMultiProcessController* controller);

constexpr const char* PointIdArray = "SurfelPointId";
constexpr const char* CompositeIndexArray = "SurfelCompositeIndex";
}
