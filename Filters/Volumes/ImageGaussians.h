// SPDX-License-Identifier: BSD-3-Clause
/**
 * The Gaussians of an image's cells, in world coordinates.
 */
#pragma once

#include "Filters/Volumes/GaussianOutput.h"
#include "Filters/Volumes/GradientNormals.h"
#include "Filters/Volumes/TransferTable.h"

#include <string>

class vtkDataArray;
class vtkImageData;

namespace SurfelVolumes
{
/// Where the normals of an image's points come from.
struct NormalSource
{
  vtkDataArray* Array; // point data; the scalars, or what has its gradient in the first component
  OutsideScalar Outside;
  std::array<bool, 6> AreEnds; // low x, high x, low y ...: whether it is the whole image's face
};

/// Scalars at the points of an image. The first component is classified; of dependent ones the
/// fourth is, and the first three are the colour: 0 to 255, to 65535, or to 1 by the type.
struct ImageScalars
{
  vtkDataArray* Array;
  bool AreDependent;
  const NormalSource* Normals = nullptr; // null: none are needed
};

/// The number of the component that the transfer functions classify.
int ClassifiedComponent(const ImageScalars& scalars);

/// Empty if the image is a volume with these scalars, else what is wrong and what to do.
std::string CheckImage(vtkImageData* image, vtkDataArray* scalars);

/**
 * Collects the Gaussians of the cells that are not empty. Cells at a scalar that is not finite or a
 * hidden point, hidden cells and duplicates of another process's cells are empty.
 * Positions are relative to the centre of the image.
 *
 * Normals are 0 where the gradient is 0. Points that are not usable count as beyond the image. In
 * cells at the faces of the whole image differences across the face are those to the outside
 * (FaceDifference), at all corners: within a voxel of the face, a central difference reaches beyond
 * it. A cell of what is opaque is all that is seen of it.
 *
 * @param scalars point data of the image
 * @param subdivision how often a cell may be split into eight
 * @return whether it was not stopped, see GaussianCollection::Collect
 */
bool CollectImage(vtkImageData* image, const ImageScalars& scalars, const TransferTable& table,
  int subdivision, const SurfelGeometry::StageProgress& progress, GaussianCollection& collection);

/// The centre of the image, world units.
void FindCenter(vtkImageData* image, double center[3]);
}
