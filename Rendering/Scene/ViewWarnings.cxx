// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/ViewWarnings.h"

#include "Core/Splats/SetupConstants.h"
#include "Rendering/Scene/SceneView.h"

#include <vtkCamera.h>
#include <vtkMath.h>
#include <vtkMatrix4x4.h>
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

/// Surfels beyond this depth are not representable: their nearest and farthest depths are summed.
constexpr double FarthestSurfel = MaxSplatDepth / 2.0;

/// Of the corners of its bounds, along the view direction.
double FarthestDepth(const SceneItem& item, vtkCamera& camera)
{
  double bounds[6], farthest = 0.0;
  item.Mapper->GetBounds(bounds);
  for (int corner = 0; corner < 8 && bounds[0] <= bounds[1]; ++corner)
  {
    double p[4] = { bounds[corner & 1], bounds[2 + (corner >> 1 & 1)], bounds[4 + (corner >> 2)],
      1.0 };
    item.Matrix->MultiplyPoint(p, p);
    vtkMath::Subtract(p, camera.GetPosition(), p);
    farthest = std::fmax(farthest, vtkMath::Dot(p, camera.GetDirectionOfProjection()));
  }
  return farthest;
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

void ViewWarnings::TellOfItems(
  const std::vector<SceneItem>& items, const SceneView& view, const Warn& warn)
{
  const auto isFar = [&](const SceneItem& item) {
    return FarthestDepth(item, *view.Camera) > FarthestSurfel;
  };
  if (!this->ToldFar && std::any_of(items.begin(), items.end(), isFar))
  {
    this->ToldFar = true;
    warn("Surfels at a depth of more than 5e15 are not drawn: use a larger unit of length, for "
         "example by the scale of the actor.");
  }
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
