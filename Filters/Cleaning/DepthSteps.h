// SPDX-License-Identifier: BSD-3-Clause
/**
 * Depth cameras with a baseline, such as the first Kinect, measure disparity, 1/z, in whole steps.
 * At 3 m a step is 26 mm, five times the distance of the points: floors are stairs, which look
 * hammered under light.
 *
 * The smooth surface is found in the image of 1/z, where planes are linear: the membrane through
 * the measured values that stays near them (ours). A value moves by at most half a step, the
 * rounding, and twice the sensor's noise of half a step (Khoshelham and Elberink 2012, "Accuracy
 * and resolution of Kinect depth data", eq. 10). Points move along their rays.
 */
#pragma once

#include "Filters/Common/StageProgress.h"
#include "Filters/Common/VectorMath.h"

#include <vector>

class vtkPoints;

namespace SurfelGeometry
{
/// An image of depths, row by row. Its points are relative to the sensor along an axis of theirs:
/// scans that were turned since are left as they are.
struct DepthImage
{
  vtkPoints* Points;
  int Columns; // > 0, divides the number of points
  double Viewpoint[3];
};

/// @param shifts [points] world units; empty if the depths have no such steps. Returns false if
/// stopped.
bool SmoothDepthSteps(
  const DepthImage& image, const StageProgress& progress, std::vector<Float3>& shifts);
}
