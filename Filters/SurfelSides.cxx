// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/SurfelSides.h"

#include "Filters/Orientation/ScannerSides.h"
#include "Filters/Orientation/ThinPlates.h"
#include "Filters/Partition/SharedOrientation.h"

#include <algorithm>

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

/// Whether the condition holds on all ranks that estimate one cloud.
bool All(const SidesInput& input, bool condition)
{
  return input.Shared ? input.Shared->All(condition) : condition;
}
}

bool DecideSides(const SidesInput& input, const StageProgress& progress, PlaneFits& fits,
  OrientationResult& result)
{
  if (input.Rule == SideRule::Viewpoint)
  {
    FaceViewpoint(input.Cloud, LocalViewpoint(input, input.Cloud.Origin), fits);
    result.TwoSided.assign(fits.size(), 0);
    return true;
  }
  if (input.Rule == SideRule::TwoSided)
  {
    if (input.UseViewpoint)
    {
      FaceViewpoint(input.Cloud, LocalViewpoint(input, input.Cloud.Origin), fits);
    }
    result.TwoSided.assign(fits.size(), 1);
    return true;
  }
  if (All(input,
        std::all_of(fits.begin(), fits.end(), [](const PlaneFit& fit) { return fit.Given; })))
  {
    result.TwoSided.assign(fits.size(), 0);
    return true;
  }
  if (!All(input, TurnPlatesOutward(input.Cloud, input.Graph, progress.Part(0.0, 0.2), fits)))
  {
    return false;
  }
  OutsideSettings settings;
  settings.UseViewpoint = input.UseViewpoint;
  settings.Viewpoint =
    LocalViewpoint(input, input.Shared ? input.Shared->Origin() : input.Cloud.Origin);
  if (input.Rule == SideRule::Scanners)
  {
    settings.UseScanners = true;
    settings.Facings = FaceScanners(input.Cloud, input.ToScanner, fits);
  }
  const StageProgress rest = progress.Part(0.2, 1.0);
  return input.Shared ? input.Shared->Orient(input.Cloud, input.Graph, settings, rest, fits, result)
                      : OrientConsistently(input.Cloud, input.Graph, settings, rest, fits, result);
}
}
