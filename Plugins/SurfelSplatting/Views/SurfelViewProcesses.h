// SPDX-License-Identifier: BSD-3-Clause
/**
 * Which processes draw a view's picture together. Internal to the module.
 */
#pragma once

#include <cstddef>

class vtkMultiProcessController;
class vtkPVRenderView;
class vtkSurfelSplatter;

namespace SurfelViews
{
/// Those that render pieces of the data for one window; null where this one has all of it to draw,
/// and where walls of screens or caves are drawn, each process a part of the picture.
/// @param interactive whether the frame is drawn with less detail
vtkMultiProcessController* ProcessesOf(vtkPVRenderView* view, bool interactive);

/// What a view looks at through a lens.
struct ViewLens
{
  double FocalDisk = 0.0, FocalDistance = 0.0; ///< the camera's
  double CenterOfRotation[3] = { 0.0, 0.0, 0.0 };
  bool HasCenter = false; ///< whether the view has a centre of rotation
};

/**
 * Collective where a view is rendered remotely or by several processes, the client included, whose
 * lens it is: ParaView leaves focal disk and distance out when it synchronizes cameras. The camera
 * has them afterwards.
 */
ViewLens ShareLens(vtkPVRenderView* view, bool interactive);

/// What is in focus, as a panel has it.
struct Focus
{
  enum Modes
  {
    CAMERA = 0,
    POINT = 1,
    CENTER_OF_ROTATION = 2
  };
  int Mode = CAMERA;
  double Point[3] = { 0.0, 0.0, 0.0 };

  void Apply(const ViewLens& lens, vtkSurfelSplatter* splatter) const;
};

/// Collective: the largest of all processes' numbers. @param controller or null: this one's
std::size_t Largest(std::size_t mine, vtkMultiProcessController* controller);
}
