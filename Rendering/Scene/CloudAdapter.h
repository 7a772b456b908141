// SPDX-License-Identifier: BSD-3-Clause
/**
 * Converts a vtkPolyData of surfels (Documentation/DataContract.md) into the core's cloud. Internal
 * to the module.
 */
#pragma once

#include "SurfelData/SurfelCloudSource.h"

#include <string>

class vtkDataArray;
class vtkMatrix4x4;
class vtkPolyData;
class vtkProperty;

namespace SurfelSplatting
{
class HierarchyCache;

/// Returns an empty string if a .surfels file can hold the surfels, otherwise what is wrong and
/// what to do.
std::string CheckStorable(vtkPolyData* surfels);

/// Input that a cloud is made from.
struct CloudInput
{
  vtkPolyData* Surfels = nullptr;
  vtkDataArray* Colors = nullptr; ///< RGBA of each surfel, bytes or floats; null: the property's
  HierarchyCache* Hierarchy = nullptr; ///< kept from frame to frame
  vtkMatrix4x4* Matrix = nullptr;      ///< of the actor
  vtkProperty* Property = nullptr;
  bool ShowsBacks = false;  ///< of the mapper
  bool PaperCut = false;    ///< whether the paper's rule chooses the level of detail
  bool LinearLight = false; ///< whether the property's colours are sRGB codes of light
};

/// Makes a cloud. Returns an empty string, or what is missing from the input and what to do.
std::string MakeCloud(const CloudInput& input, SurfelCloudSource& source);
}
