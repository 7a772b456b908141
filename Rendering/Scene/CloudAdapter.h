// SPDX-License-Identifier: BSD-3-Clause
/**
 * Converts a vtkPolyData of surfels (Documentation/DataContract.md) into the core's cloud. Internal
 * to the module.
 */
#pragma once

#include "Core/Surfels/SurfelCloud.h"

#include <vtkDataArray.h>
#include <vtkSmartPointer.h>

#include <string>
#include <vector>

class vtkMatrix4x4;
class vtkPolyData;
class vtkProperty;

namespace SurfelSplatting
{
class HierarchyCache;

/// The local origin of the surfels (field array SurfelOrigin), to be added to their points;
/// (0, 0, 0) if there is none.
void GetSurfelOrigin(vtkPolyData* surfels, double origin[3]);

/// Returns an empty string if the point arrays are as the data contract says, otherwise what is
/// wrong and what to do.
std::string CheckSurfels(vtkPolyData* surfels);

/// The same of what a .surfels file can hold.
std::string CheckStorable(vtkPolyData* surfels);

/// Input that a cloud is made from.
struct CloudInput
{
  vtkPolyData* Surfels = nullptr;
  vtkDataArray* Colors = nullptr; ///< RGBA of each surfel, bytes or floats; null: the property's
  HierarchyCache* Hierarchy = nullptr; ///< kept from frame to frame
  vtkMatrix4x4* Matrix = nullptr;      ///< of the actor
  vtkProperty* Property = nullptr;
  bool PaperCut = false;    ///< whether the paper's rule chooses the level of detail
  bool LinearLight = false; ///< whether the property's colours are sRGB codes of light
};

/// A cloud and the arrays that it points to.
struct SurfelCloudSource
{
  SurfelCloud Cloud;
  std::vector<vtkSmartPointer<vtkDataArray>> Arrays;
};

/// Points the cloud to the arrays of surfels that pass CheckSurfels.
void SetSurfels(vtkPolyData* surfels, SurfelCloudSource& source);

/// Makes a cloud. Returns an empty string, or what is missing from the input and what to do.
std::string MakeCloud(const CloudInput& input, SurfelCloudSource& source);
}
