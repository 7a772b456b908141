// SPDX-License-Identifier: BSD-3-Clause
/**
 * Which processes draw a view's picture together. Internal to the module.
 */
#pragma once

#include <cstddef>

class vtkMultiProcessController;
class vtkPVRenderView;

namespace SurfelViews
{
/// Those that render pieces of the data for one window; null where this one has all of it to draw,
/// and where walls of screens or caves are drawn, each process a part of the picture.
/// @param interactive whether the frame is drawn with less detail
vtkMultiProcessController* ProcessesOf(vtkPVRenderView* view, bool interactive);

/**
 * Collective where a view is rendered remotely or by several processes, the client included: its
 * camera's focal disk and distance, which ParaView leaves out when it synchronizes cameras.
 */
void ShareLens(vtkPVRenderView* view, bool interactive);

/// Collective: the largest of all processes' numbers. @param controller or null: this one's
std::size_t Largest(std::size_t mine, vtkMultiProcessController* controller);
}
