// SPDX-License-Identifier: BSD-3-Clause
/**
 * Checks, before minutes of work, whether there is enough memory for a cloud.
 */
#pragma once

#include "Filters/Common/IdType.h"

#include <string>

namespace SurfelGeometry
{
/// Memory of vtkSurfelEstimation and of vtkSurfelNormalization, as vtkSurfelEstimation.h says.
constexpr double BytesPerPoint = 270.0;

/// Memory of vtkPointsToSurfels, which keeps the neighbours from one filter to the next, and of its
/// normalization, besides surfels and neighbours.
constexpr double BytesPerPointOfBoth = 290.0, BytesPerPointBesidesNeighbors = 140.0;

/// Memory that can be allocated without swapping, bytes: the minimum of the system's, the control
/// group's and what a limit of the process leaves. Infinity if it is unknown (not on Linux).
double AvailableMemory();

/// Gives freed memory that the allocator keeps in its heap back to the system, where it can.
void ReturnFreeMemory();

/// An error message if `points` with `bytesPerPoint` do not fit; empty if they do.
std::string CheckMemory(vtkIdType points, double bytesPerPoint, double available);

/// The error message of a filter whose allocation failed nevertheless.
std::string LackOfMemory(vtkIdType points);
}
