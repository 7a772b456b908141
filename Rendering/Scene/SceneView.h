// SPDX-License-Identifier: BSD-3-Clause
/**
 * Content of a picture: the surfel actors of a scene and the view of them. Internal to the module.
 */
#pragma once

#include "Core/Lens/Lens.h"
#include "Core/Lens/View.h"
#include "Core/Splats/DepthImageSurfels.h"

#include <vtkMatrix4x4.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkSmartPointer.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

class vtkCamera;
class vtkLightCollection;

namespace SurfelSplatting
{
/// A surfel actor of the scene.
struct SceneItem
{
  vtkSmartPointer<vtkPolyDataMapper> Mapper; ///< a vtkSurfelMapper
  vtkSmartPointer<vtkMatrix4x4> Matrix;      ///< from the mapper's coordinates to the world
  vtkSmartPointer<vtkProperty> Property;
};

/// How the scene is seen. The caller sets all members but Projection and Optics, which
/// vtkSurfelSplatter::CompleteView() computes from them.
struct SceneView
{
  vtkCamera* Camera = nullptr;
  vtkLightCollection* Lights = nullptr;
  int Size[2] = { 0, 0 };             ///< px
  double Aspect = 1.0;                ///< width / height for the camera's projection
  double ClippingRange[2] = { 0, 1 }; ///< surfels with centres outside are not drawn; world units
  double Oversampling = 1.0;          ///< pixels of this picture per pixel of the window
  double Coarsening = 1.0;            ///< factor on the LODError, to hold a frame rate
  bool IsMoving = false;              ///< the lens is not divided, for the same reason

  /// Number of lens cells if the camera is one of them, moved within the whole lens, and its
  /// FocalDisk is the diameter of a disc of that cell's area; 0 if the camera has the whole lens.
  int CellCount = 0;
  LensShape CellShape; ///< of that cell

  /// [height][width] distance of other opaque props along the view direction, world units;
  /// infinity where there are none. May be null.
  const float* OccluderDepth = nullptr;

  /// The image of other opaque props if they are blurred too; null if they stay sharp.
  const DepthImage* PropImage = nullptr;

  /// What OccluderDepth and PropImage depend on, before they are known (PropStamp.h). Null: only
  /// they themselves tell whether they have changed.
  const std::vector<std::uint64_t>* PropStamp = nullptr;

  /// Receives the share of the lens cells that are done. Returns false to stop with the mean of
  /// the cells so far. May be empty.
  std::function<bool(double)> Progress;

  View Projection; ///< of the camera, in the core's terms
  Lens Optics;     ///< from the splatter's settings and the camera

  /// Minimum circle of confusion, radius in px, of pixels of other props that are splatted. The
  /// same pixels are splatted whether or not the lens is divided into cells.
  double MinConfusion() const
  {
    return MinPixelConfusion / std::sqrt(std::max(1, this->CellCount));
  }
};
}
