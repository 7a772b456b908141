// SPDX-License-Identifier: BSD-3-Clause
/**
 * A volume as Gaussians in space, as ParaView's colour map says.
 */
#pragma once

#include <vtkSmartPointer.h>
#include <vtkType.h>

#include <string>

class vtkDiscretizableColorTransferFunction;
class vtkInformation;
class vtkMapper;
class vtkPolyData;

namespace SurfelViews
{
/// The colour map of a representation that is coloured by an array of the points.
struct VolumeColors
{
  /// @param array  vtkAlgorithm::GetInputArrayInformation of what the representation is coloured by
  /// @param mapper the one whose lookup table is the colour map
  VolumeColors(vtkInformation* array, vtkMapper* mapper);

  bool operator==(const VolumeColors& other) const
  {
    return this->Array == other.Array && this->Functions == other.Functions &&
      this->Time == other.Time;
  }

  std::string Array;                                          // empty: there is none
  vtkDiscretizableColorTransferFunction* Functions = nullptr; // colour and opacity; null: no Array
  vtkMTimeType Time = 0;                                      // of the functions
};

/**
 * The Gaussians of an image along three axes with one scalar at each point, or null for all other
 * data. As with ParaView's volumes the opacities are those of a way of the length of the image's
 * diagonal over the cubic root of the number of its cells.
 *
 * @param input with a piece of an image, and its whole extent
 * @param shade whether the Gaussians get normals, so that they are lit
 */
vtkSmartPointer<vtkPolyData> MakeVolumeGaussians(
  vtkInformation* input, const VolumeColors& colors, bool shade);

/// Whether a cloud was made of a volume: its colours are its own, whatever it is coloured by.
bool IsOfVolume(vtkPolyData* cloud);
}
