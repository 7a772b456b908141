// SPDX-License-Identifier: BSD-3-Clause
/**
 * Whether a cloud fits: better told before minutes of work than by the end of the process.
 */
#pragma once

#include "vtkType.h"

#include <string>

namespace SurfelGeometry
{
/// Memory that a new array may still take without swapping, bytes: the system's and, where there is
/// one, that of the control group. Infinity where nobody knows (not Linux).
double AvailableMemory();

/// What is wrong if `points` at `bytesPerPoint` do not fit; empty if they do.
std::string CheckMemory(vtkIdType points, double bytesPerPoint, double available);
}
