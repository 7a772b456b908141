// SPDX-License-Identifier: BSD-3-Clause
/**
 * State on which the processes that render one view together must agree. Internal to the module.
 */
#pragma once

#include <cstddef>

class vtkMultiProcessController;
class vtkPVRenderView;
class vtkSurfelSplatter;

namespace SurfelViews
{
/**
 * The processes that render pieces of the data into one picture. Null: this process has all of the
 * data, or each process renders its own part of a tiled display or a CAVE.
 * @param interactive whether the frame is drawn with less detail
 */
vtkMultiProcessController* RenderController(vtkPVRenderView* view, bool interactive);

/// A view's lens and centre of rotation.
struct ViewLens
{
  double FocalDisk = 0.0, FocalDistance = 0.0; ///< the camera's
  double CenterOfRotation[3] = { 0.0, 0.0, 0.0 };
  bool HasCenter = false; ///< whether the view has a centre of rotation
};

/**
 * The client's lens on all processes, also set on their cameras: ParaView leaves out focal disk and
 * focal distance when it synchronizes cameras. Collective where servers render; the client takes
 * part.
 */
ViewLens SynchronizeLens(vtkPVRenderView* view, bool interactive);

/// The focus settings of a view or a representation.
struct Focus
{
  enum Modes
  {
    CAMERA = 0,
    POINT = 1,
    CENTER_OF_ROTATION = 2,
    MIDDLE = 3
  };
  int Mode = MIDDLE;
  double Point[3] = { 0.0, 0.0, 0.0 };

  void Apply(const ViewLens& lens, vtkSurfelSplatter* splatter) const;
};

/// The maximum of all processes' values; collective. @param controller or null: this process alone
std::size_t MaximumOfAll(std::size_t value, vtkMultiProcessController* controller);
}
