// SPDX-License-Identifier: BSD-3-Clause
/**
 * Points that are far from all others would become discs as large as the space about them.
 */
#pragma once

#include "Filters/Estimation/PlaneFit.h"

namespace SurfelGeometry
{
struct SearchedCloud;

/// Makes points round and as small as their neighbours that are alone, by FitSettings'
/// IsolationFactor, and sparse ones on no surface smaller.
void BoundIsolated(double factor, const SearchedCloud& searched, PlaneFits& fits);
}
