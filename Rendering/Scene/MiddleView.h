// SPDX-License-Identifier: BSD-3-Clause
/**
 * A small picture that tells what a photographer would focus on. Internal to the module.
 */
#pragma once

#include "Rendering/Scene/SceneView.h"

#include <vtkNew.h>

#include <vector>

class vtkCamera;
class vtkImageData;

namespace SurfelSplatting
{
/// What the camera of a picture sees, 120 px high, without its lens and other props.
class MiddleView
{
public:
  explicit MiddleView(const SceneView& whole);
  SceneView View; ///< to be completed by a splatter without lens

private:
  vtkNew<vtkCamera> Camera;
};

/// Whether any of these is a volume, which may be translucent everywhere: its "MedianDepth" counts.
bool HaveVolume(const std::vector<SceneItem>& items);

/// The distance along the view direction to the front of what is in the middle of a picture, by its
/// "MedianDepth", or else its "Depth"; 0 if it is empty.
double FrontOf(vtkImageData* picture);
}
