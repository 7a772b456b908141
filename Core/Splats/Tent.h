// SPDX-License-Identifier: BSD-3-Clause
/**
 * One layer of a coarse grid's cell as it is drawn into the picture: two cache lines.
 *
 * The grid (Core/Raster/CoarseGrid.h) has cells of d px. The picture interpolates bilinearly
 * between their centres: a layer counts max(0, 1 - |dx| / d) max(0, 1 - |dy| / d) at dx, dy px from
 * its cell's centre, a tent over 2d by 2d px.
 *
 * A layer's fragments pass the lens at different points u. Behind layers that cover a part of the
 * lens, with T(u) = t0 + 4 t1.u (Core/Lens/LensVisibility.h), its colour is seen as
 *
 *   mean of c T(u) = c T(u) at the mean of u + 4 t1.cov(c, u)
 */
#pragma once

#include "Core/Base/PixelBox.h"

namespace SurfelSplatting
{
struct alignas(64) Tent
{
  float X, Y;        ///< centre, px
  float InverseCell; ///< 1 / d, per px
  float Weight;      ///< coverage at the centre, [0, inf)
  float Near;        ///< z-range of the layer along the view direction, world units
  float Far;
  float Depth;                                    ///< mean depth of the layer, world units
  float Red, Green, Blue;                         ///< straight, shaded, linear
  float Opacity;                                  ///< [0, 1]
  float PointX, PointY;                           ///< mean point of the lens
  PixelBox Box;                                   ///< pixels of the picture under the tent
  float RedX, RedY, GreenX, GreenY, BlueX, BlueY; ///< covariance of colour and point
  float XX, XY, YY;                               ///< covariance of the point
};

static_assert(sizeof(Tent) == 128, "a tent is two cache lines");
}
