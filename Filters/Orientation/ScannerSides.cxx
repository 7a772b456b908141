// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Orientation/ScannerSides.h"

#include "Filters/Common/LocalCloud.h"

#include "vtkDataArray.h"
#include "vtkSMPTools.h"

#include <cmath>

namespace SurfelGeometry
{
std::vector<float> FaceScanners(const LocalCloud& cloud, vtkDataArray* toScanner, PlaneFits& fits)
{
  std::vector<float> facings(fits.size(), 0.0f);
  if (!toScanner)
  {
    return facings;
  }
  vtkSMPTools::For(0, cloud.Size(), [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      double way[3];
      toScanner->GetTuple(cloud.InputIds[i], way);
      const double length = std::hypot(way[0], way[1], way[2]);
      if (!(length > 0.0) || !std::isfinite(length))
      {
        continue;
      }
      PlaneFit& fit = fits[i];
      const double facing = Dot(fit.Normal, Vector3{ way[0], way[1], way[2] }) / length;
      const bool isTurned =
        facing < 0.0 && !fit.Given && (!fit.OnPlate || IsSurelySeen(fit, -facing));
      fit.Normal = isTurned ? -1.0 * Vector3(fit.Normal) : Vector3(fit.Normal);
      facings[i] = static_cast<float>(isTurned ? -facing : facing);
    }
  });
  return facings;
}
}
