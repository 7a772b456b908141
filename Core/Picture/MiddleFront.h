// SPDX-License-Identifier: BSD-3-Clause
/**
 * What a photographer would focus on.
 */
#pragma once

namespace SurfelSplatting
{
/**
 * Distance to the front of the surface in the middle of a picture; 0 where it is empty. The less
 * the middle shows, as of a trunk or a mast, the more of what is around it counts, and the less
 * only its front: where nothing is there, half of all that is seen is nearer.
 * @param depths [height][width] distances along the view direction, 0 where nothing is seen. Of a
 * small picture, whose pixels are means, so that single points do not count.
 */
double MiddleFront(const float* depths, int width, int height);
}
