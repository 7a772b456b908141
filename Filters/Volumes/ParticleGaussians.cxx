// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Volumes/ParticleGaussians.h"

#include "Core/Base/Geometry.h"

#include "vtkDataArray.h"
#include "vtkPointSet.h"
#include "vtkPoints.h"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace SurfelVolumes
{
namespace
{
using SurfelSplatting::Pi;

/// Particles that a thread takes at a time.
constexpr vtkIdType Block = 1 << 14;

/// Whether the optical depth through the centre, s r sqrt(2 pi), is too small to be seen.
bool IsTransparent(const Gaussian& gaussian)
{
  return gaussian.Extinction * std::sqrt(2.0 * Pi * gaussian.Covariance[0]) < LeastOpticalDepth;
}

bool IsFinite(const Gaussian& gaussian)
{
  return std::all_of(gaussian.Position, gaussian.Position + 3,
           [](float value) { return std::isfinite(value); }) &&
    std::isfinite(gaussian.Covariance[0]);
}

/// Returns false if the particle is unusable.
bool MakeGaussian(const Particles& particles, vtkIdType id, const TransferTable& table,
  const double origin[3], Gaussian& gaussian)
{
  const double scalar = particles.Scalars->GetComponent(id, 0);
  const double radius = particles.Radii ? particles.Radii->GetComponent(id, 0) : particles.Radius;
  if (!std::isfinite(scalar) || !(radius > 0.0))
  {
    return false;
  }
  double place[3];
  particles.Points->GetPoint(id, place);
  const Medium medium = table.Mean(scalar, 0.0);
  gaussian.Extinction = static_cast<float>(medium.Extinction);
  for (int k = 0; k < 3; ++k)
  {
    gaussian.Position[k] = static_cast<float>(place[k] - origin[k]);
    gaussian.Covariance[k] = static_cast<float>(radius * radius);
    gaussian.Covariance[3 + k] = 0.0f;
    gaussian.Color[k] = medium.Extinction > 0.0 ? ColorByte(medium.Emission[k] / medium.Extinction)
                                                : static_cast<unsigned char>(0);
  }
  return IsFinite(gaussian) && gaussian.Covariance[0] > 0.0f;
}
}

std::string CheckParticles(const Particles& particles, const char* radiusArrayName)
{
  const vtkIdType count = particles.Points->GetNumberOfPoints();
  if (!particles.Scalars || particles.Scalars->GetNumberOfTuples() != count)
  {
    return "The points have no scalars. Choose an array with SetInputArrayToProcess().";
  }
  if (radiusArrayName &&
    (!particles.Radii || particles.Radii->GetNumberOfComponents() != 1 ||
      particles.Radii->GetNumberOfTuples() != count))
  {
    return std::string("The points have no array \"") + radiusArrayName +
      "\" of one component with a value for each. Set RadiusArrayName to the name of an array of "
      "the points, or to "
      "nothing and set Radius.";
  }
  if (!radiusArrayName && !(particles.Radius > 0.0))
  {
    return "The points need a radius: set RadiusArrayName, or a Radius above 0.";
  }
  return std::string();
}

void FindFiniteCenter(vtkPointSet* points, double center[3])
{
  for (int k = 0; k < 3; ++k)
  {
    double range[2];
    points->GetPoints()->GetData()->GetFiniteRange(range, k);
    center[k] = range[0] <= range[1] ? 0.5 * range[0] + 0.5 * range[1] : 0.0;
  }
}

bool CollectParticles(const Particles& particles, const TransferTable& table,
  const double origin[3], const SurfelGeometry::StageProgress& progress,
  GaussianCollection& collection, vtkIdType& unusable)
{
  const vtkIdType count = particles.Points->GetNumberOfPoints();
  std::atomic<vtkIdType> dropped{ 0 };
  const bool done = collection.Collect(
    (count + Block - 1) / Block, progress, [&](vtkIdType block, GaussianPart& part) {
      const vtkIdType end = std::min(count, (block + 1) * Block);
      for (vtkIdType id = block * Block; id < end; ++id)
      {
        Gaussian gaussian;
        if (!MakeGaussian(particles, id, table, origin, gaussian))
        {
          ++dropped;
        }
        else if (!IsTransparent(gaussian))
        {
          part.Gaussians.push_back(gaussian);
        }
      }
    });
  unusable = dropped;
  return done;
}
}
