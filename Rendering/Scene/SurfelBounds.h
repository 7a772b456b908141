// SPDX-License-Identifier: BSD-3-Clause
/**
 * Bounds of surfels with their extent. Internal to the module.
 */
#pragma once

class vtkPolyData;

namespace SurfelSplatting
{
/**
 * Bounds of the finite surfels' centres, widened by the standard deviation of the largest kernel;
 * of Gaussians in space, some of which may be much larger than the others, each is widened by its
 * own. Relative to the origin of the surfels, world units. Takes those of a file (Arrays::Bounds)
 * if it has them.
 * @return false if there are no finite surfels
 */
bool FindSurfelBounds(vtkPolyData* surfels, double bounds[6]);
}
