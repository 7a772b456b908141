// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/SurfelSides.h"

#include "Filters/Orientation/ScannerSides.h"
#include "Filters/Orientation/ThinPlates.h"
#include "Filters/Partition/SharedOrientation.h"

#include <algorithm>
#include <functional>

namespace SurfelGeometry
{
namespace
{
/// The place of the sensor relative to an origin.
Vector3 LocalViewpoint(const SidesInput& input, const double origin[3])
{
  const double* world = input.Viewpoint;
  return { world[0] - origin[0], world[1] - origin[1], world[2] - origin[2] };
}

/// Whether the work succeeds, on all ranks that estimate one cloud.
bool All(const SidesInput& input, const std::function<bool()>& work)
{
  return input.Shared ? input.Shared->All(work) : work();
}

/// Lets the surfels face the sensor, if that is asked for.
void FaceSensor(const SidesInput& input, PlaneFits& fits)
{
  if (input.Rule == SideRule::Viewpoint || input.UseViewpoint)
  {
    FaceViewpoint(input.Cloud, LocalViewpoint(input, input.Cloud.Origin), fits);
  }
}
}

bool DecideSides(const SidesInput& input, const StageProgress& progress, PlaneFits& fits,
  OrientationResult& result)
{
  if (input.Rule == SideRule::Viewpoint || input.Rule == SideRule::TwoSided)
  {
    return All(input, [&] {
      FaceSensor(input, fits);
      result.TwoSided.assign(fits.size(), input.Rule == SideRule::TwoSided ? 1 : 0);
      return true;
    });
  }
  const auto areGiven = [&] {
    result.TwoSided.assign(fits.size(), 0);
    return std::all_of(fits.begin(), fits.end(), [](const PlaneFit& fit) { return fit.SideGiven; });
  };
  if (All(input, areGiven))
  {
    return true;
  }
  OutsideSettings settings;
  settings.UseViewpoint = input.UseViewpoint;
  settings.UseScanners = input.Rule == SideRule::Scanners;
  settings.Viewpoint =
    LocalViewpoint(input, input.Shared ? input.Shared->Origin() : input.Cloud.Origin);
  const auto prepare = [&] {
    if (!TurnPlatesOutward(input.Cloud, input.Graph, progress.Part(0.0, 0.2), fits))
    {
      return false;
    }
    if (settings.UseScanners)
    {
      settings.Facings = FaceScanners(input.Cloud, input.ToScanner, fits);
    }
    return true;
  };
  if (!All(input, prepare))
  {
    return false;
  }
  const StageProgress rest = progress.Part(0.2, 1.0);
  return input.Shared ? input.Shared->Orient(input.Cloud, input.Graph, settings, rest, fits, result)
                      : OrientConsistently(input.Cloud, input.Graph, settings, rest, fits, result);
}
}
