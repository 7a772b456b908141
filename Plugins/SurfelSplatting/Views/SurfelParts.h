// SPDX-License-Identifier: BSD-3-Clause
/**
 * The point sets that a representation's data consist of, with what its blocks are to look like;
 * and surfels of them, estimated where they have none. Internal to the module.
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
/// A leaf of the data, null where this process has nothing of it.
struct Part
{
  vtkPolyData* Points = nullptr;
  bool Visible = true;
  bool HasColor = false;
  double Color[3] = { 1.0, 1.0, 1.0 };
  bool HasOpacity = false;
  double Opacity = 1.0;
  unsigned int CompositeIndex = 0; ///< flat index in the data; 0: no composite ones
};

/// All leaves, the same ones in the same order on every process. @param attributes or null
std::vector<Part> FindParts(vtkDataObject* data, vtkCompositeDataDisplayAttributes* attributes);

/**
 * Points as they are where they are surfels with a hierarchy, or what they lack: estimated by the
 * filters' defaults, said in a message. A point array SurfelPointId has the ids of the points.
 * @param controller of the processes that have parts of it, which call this together; null: none
 */
vtkSmartPointer<vtkPolyData> MakeSurfels(
  vtkPolyData* points, vtkMultiProcessController* controller);

constexpr const char* PointIdArray = "SurfelPointId";
}
