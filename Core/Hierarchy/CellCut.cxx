// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Hierarchy/HierarchyCut.h"

#include <cmath>

namespace SurfelSplatting
{
namespace
{
/// A place along a side of the picture, px, clamped to [0, size].
int Inside(double at, int size)
{
  return static_cast<int>(std::fmin(std::fmax(at, 0.0), size));
}
}

void SeeFromCell(const std::vector<CutRange>& all, const View& view, const Lens& lens,
  const Vector3& center, std::vector<CutRange>& runs)
{
  runs.clear();
  for (CutRange run : all)
  {
    if (run.Near > 0.0f)
    {
      // The plane in focus stays where it is.
      const double near = 1.0 / lens.FocalDistance - 1.0 / run.Near;
      const double far = 1.0 / lens.FocalDistance - 1.0 / run.Far;
      const double x[2] = { view.Fx * center[0] * near, view.Fx * center[0] * far };
      const double y[2] = { view.Fy * center[1] * near, view.Fy * center[1] * far };
      run.Box = { Inside(std::floor(run.Box.X0 + std::fmin(x[0], x[1])), view.Width),
        Inside(std::floor(run.Box.Y0 + std::fmin(y[0], y[1])), view.Height),
        Inside(std::ceil(run.Box.X1 + std::fmax(x[0], x[1])), view.Width),
        Inside(std::ceil(run.Box.Y1 + std::fmax(y[0], y[1])), view.Height) };
    }
    else
    {
      run.Box = { 0, 0, view.Width, view.Height };
    }
    if (!IsEmpty(run.Box))
    {
      runs.push_back(run);
    }
  }
}
}
