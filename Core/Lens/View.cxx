// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Lens/View.h"

#include <stdexcept>

namespace SurfelSplatting
{
namespace
{
Vector3 Normalized(const Vector3& a, const char* problem)
{
  const double length = Norm(a);
  if (!(length > 0.0 && std::isfinite(length)))
  {
    throw std::invalid_argument(problem);
  }
  return { a[0] / length, a[1] / length, a[2] / length };
}
}

View LookAt(const Vector3& position, const Vector3& focalPoint, const Vector3& viewUp,
  double viewAngle, int width, int height)
{
  if (!(viewAngle > 0.0 && viewAngle < 180.0) || width < 1 || height < 1)
  {
    throw std::invalid_argument("LookAt needs a view angle between 0 and 180 degrees and a picture "
                                "of at least one pixel");
  }
  const Vector3 forward =
    Normalized(focalPoint - position, "LookAt needs a finite position and focal point that differ");
  const Vector3 right = Normalized(Cross(forward, viewUp),
    "LookAt needs a finite view-up that is not parallel to the view direction");
  const Vector3 up = Cross(right, forward);

  View view;
  view.WorldToCamera.L = { right, up, forward };
  view.WorldToCamera.T = { -Dot(right, position), -Dot(up, position), -Dot(forward, position) };
  view.Fx = view.Fy = 0.5 * height / std::tan(viewAngle * Pi / 360.0);
  view.Cx = 0.5 * width;
  view.Cy = 0.5 * height;
  view.Width = width;
  view.Height = height;
  return view;
}
}
