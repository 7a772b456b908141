// SPDX-License-Identifier: BSD-3-Clause
/**
 * The Gaussians of particles: points with a radius and a scalar.
 */
#pragma once

#include "Filters/Volumes/GaussianOutput.h"
#include "Filters/Volumes/TransferTable.h"

#include <string>

class vtkDataArray;
class vtkPointSet;

namespace SurfelVolumes
{
/// Points, their scalars, and their radii: an array, or a number for all if the array is null.
struct Particles
{
  vtkPointSet* Points;
  vtkDataArray* Scalars;
  vtkDataArray* Radii;
  double Radius;
};

/// Empty if there is a scalar and a radius for each point, else what is wrong and what to do.
std::string CheckParticles(const Particles& particles, const char* radiusArrayName);

/// The centre of the points' finite bounds; 0 if there is none.
void FindFiniteCenter(vtkPointSet* points, double center[3]);

/// Collects one Gaussian for each particle that is not transparent: its radius is the standard
/// deviation, the extinction that of its scalar. Positions are relative to `origin`.
/// @param unusable number of particles that have a place, a scalar or a radius that is not finite,
///                 or no radius above 0; they are left out
bool CollectParticles(const Particles& particles, const TransferTable& table,
  const double origin[3], const SurfelGeometry::StageProgress& progress,
  GaussianCollection& collection, vtkIdType& unusable);
}
