// SPDX-License-Identifier: BSD-3-Clause
/**
 * One layer of a coarse grid's cell as it is drawn into the picture: one cache line.
 *
 * The grid (Core/Raster/CoarseGrid.h) has cells of d px. The picture interpolates bilinearly
 * between their centres: a layer counts max(0, 1 - |dx| / d) max(0, 1 - |dy| / d) at dx, dy px from
 * its cell's centre, a tent over 2d by 2d px.
 */
#pragma once

#include "Core/Base/PixelBox.h"

#include <cstdint>

namespace SurfelSplatting
{
struct alignas(64) Tent
{
  float X, Y;        ///< centre, px
  float InverseCell; ///< 1 / d, per px
  float Weight;      ///< coverage at the centre, [0, inf)
  float Near;        ///< z-range of the layer along the view direction, world units
  float Far;
  float Depth;            ///< mean depth of the layer, world units
  float Red, Green, Blue; ///< straight, shaded, linear
  float Opacity;          ///< [0, 1]
  float PointX, PointY; ///< mean point of the lens
  float ColorX[3], ColorY[3], XX, XY, YY; // covariances with the point
  PixelBox Box;           ///< pixels of the picture under the tent
};

static_assert(sizeof(Tent) == 128, "a tent is one cache line");
}
