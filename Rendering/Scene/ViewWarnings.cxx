// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/ViewWarnings.h"

#include "Rendering/Scene/SceneView.h"

#include <vtkCamera.h>
#include <vtkPlaneCollection.h>

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
bool IsFinite(const View& view)
{
  double sum = view.Fx + view.Fy + view.Cx + view.Cy;
  for (int i = 0; i < 3; ++i)
  {
    const auto& row = view.WorldToCamera.L[i];
    sum += view.WorldToCamera.T[i] + row[0] + row[1] + row[2];
  }
  return std::isfinite(sum);
}

/// What of a view is not finite, without which there is no picture; null: nothing.
const char* FindNotFinite(const SceneView& view, bool areFinite)
{
  return !IsFinite(view.Projection)
    ? "The camera is not finite, so that surfels are not seen: check its position, focal point, "
      "view-up and view angle."
    : !std::isfinite(view.Optics.Radius) || std::isnan(view.Optics.FocalDistance)
    ? "The lens is not finite, so that surfels are not seen: check the CircleOfConfusion, or the "
      "camera's focal disk and focal distance."
    : !areFinite ? "Cutoff, Prefilter and LODError must be finite: surfels may not be seen."
                 : nullptr;
}
}

void ViewWarnings::Tell(const SceneView& view, bool areFinite, const Warn& warn)
{
  const auto once = [&warn](const char* text, bool& told) {
    if (text && !told)
    {
      told = true;
      warn(text);
    }
  };
  const bool isParallel = view.Projection.Parallel && view.Optics.Radius > 0.0;
  once(FindNotFinite(view, areFinite), this->ToldNotFinite);
  once(isParallel
      ? "Parallel projection has no lens: the picture is sharp. Use a perspective camera "
        "for depth of field, or call SetLensModeToPinhole() if the picture is meant to "
        "be sharp."
      : nullptr,
    this->ToldParallel);
  once(view.Camera->GetUseOffAxisProjection()
      ? "Off-axis projection is not supported: surfels do not appear where meshes do. Set the same "
        "projection with SetExplicitProjectionTransformMatrix()."
      : nullptr,
    this->ToldOffAxis);
}

void ViewWarnings::TellOfPlanes(const std::vector<SceneItem>& items, const Warn& warn)
{
  const bool havePlanes = std::any_of(items.begin(), items.end(), [](const SceneItem& item) {
    vtkPlaneCollection* planes = item.Mapper->GetClippingPlanes();
    return planes && planes->GetNumberOfItems() > 0;
  });
  if (havePlanes && !this->ToldPlanes)
  {
    this->ToldPlanes = true;
    warn("Clipping planes of a mapper do not cut surfels: cut their points before they become "
         "surfels, for example with vtkClipPolyData.");
  }
}
}
