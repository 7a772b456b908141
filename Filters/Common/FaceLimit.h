// SPDX-License-Identifier: BSD-3-Clause
/**
 * Up to how many vertices of a mesh its faces matter to the filters.
 */
#pragma once

namespace SurfelGeometry
{
/// The vertices of larger meshes tell the surface, and faces take more memory than these.
constexpr long long MostVerticesOfFaces = 200000;
}
