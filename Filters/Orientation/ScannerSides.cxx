// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Orientation/ScannerSides.h"

#include "Filters/Common/ArrayTuples.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Common/ParityUnionFind.h"
#include "Filters/Neighbors/LocalCloud.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace SurfelGeometry
{
namespace
{
/// Largest variance across the tangent plane over that along it of points that tell their sides
/// alone. At edges, where the plane leans on both of their faces, it is larger.
constexpr double SeenFlatness = 0.15;

bool IsSurelySeen(const PlaneFit& fit, double facing)
{
  return facing > 0.0 && facing * facing > fit.Flatness && fit.Flatness <= SeenFlatness &&
    fit.HasPlane();
}
}

std::vector<float> FaceScanners(const LocalCloud& cloud, vtkDataArray* toScanner, PlaneFits& fits)
{
  std::vector<float> facings(fits.size(), 0.0f);
  if (!toScanner)
  {
    return facings;
  }
  ParallelFor(0, cloud.Size(), [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      double way[3];
      ReadTuple(toScanner, cloud.InputIds[i], way);
      const double length = std::hypot(way[0], way[1], way[2]);
      if (!(length > 0.0) || !std::isfinite(length))
      {
        continue;
      }
      PlaneFit& fit = fits[i];
      const double facing = Dot(fit.Normal, Vector3{ way[0], way[1], way[2] }) / length;
      const bool isTurned =
        facing < 0.0 && !fit.SideGiven && (!fit.OnPlate || IsSurelySeen(fit, -facing));
      fit.Normal = isTurned ? -1.0 * Vector3(fit.Normal) : Vector3(fit.Normal);
      facings[i] = static_cast<float>(isTurned ? -facing : facing);
    }
  });
  return facings;
}

std::vector<unsigned char> FindSurelySeen(const PlaneFits& fits, const std::vector<float>& facings)
{
  std::vector<unsigned char> seen(fits.size());
  for (size_t i = 0; i < fits.size(); ++i)
  {
    seen[i] = IsSurelySeen(fits[i], facings[i]) ? 1 : 0;
  }
  return seen;
}

void JoinSeen(int a, int b, bool differ, ParityUnionFind& signs, std::vector<int>& evidence)
{
  const auto [rootA, flipA] = signs.Find(a);
  const auto [rootB, flipB] = signs.Find(b);
  const int sign = (flipA != flipB) != differ ? -1 : 1; // of root a relative to root b
  const int ofA = evidence[rootA], ofB = sign * evidence[rootB];
  const bool contradicts =
    (ofA < 0) != (ofB < 0) && std::min(std::abs(ofA), std::abs(ofB)) >= EnoughSeen;
  if (rootA != rootB && !contradicts)
  {
    signs.Join(a, b, differ);
    evidence[rootA] = ofA + ofB;
    evidence[rootB] = sign * (ofA + ofB);
  }
}
}
