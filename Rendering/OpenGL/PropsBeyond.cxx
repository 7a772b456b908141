// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/PropsBeyond.h"

#include "Rendering/OpenGL/CameraChanges.h"
#include "Rendering/Scene/PropStamp.h"
#include "SurfelData/SMPExecutor.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkMapper.h>
#include <vtkMath.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>

namespace SurfelSplatting
{
namespace
{
constexpr std::size_t PointsAtATime = 4096; // of a thread

/// What a frame shows without a few px at its border.
struct FrameInside
{
  double X, Y; // in normalised device coordinates

  FrameInside(const PixelRectangle& frame, double slack)
    : X(1.0 - 2.0 * slack / frame.Width)
    , Y(1.0 - 2.0 * slack / frame.Height)
  {
  }

  /// @param toClip row by row
  bool Has(const double* toClip, double x, double y, double z) const
  {
    const auto row = [&](int r) {
      const double* m = toClip + 4 * r;
      return m[0] * x + m[1] * y + m[2] * z + m[3];
    };
    const double w = row(3);
    return w > 0.0 && std::abs(row(0)) <= this->X * w && std::abs(row(1)) <= this->Y * w;
  }
};

bool HasBox(const FrameInside& inside, const double* toClip, const double* bounds)
{
  bool all = true;
  for (int corner = 0; corner < 8; ++corner)
  {
    all = all &&
      inside.Has(
        toClip, bounds[corner & 1], bounds[2 + (corner >> 1 & 1)], bounds[4 + (corner >> 2 & 1)]);
  }
  return all;
}

bool HasPoints(const FrameInside& inside, const double* toClip, vtkPoints* points)
{
  std::atomic<bool> all{ true };
  const auto count = static_cast<std::size_t>(points ? points->GetNumberOfPoints() : 0);
  SMPExecutor().For(count, PointsAtATime, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end && all; ++i)
    {
      double p[3];
      points->GetPoint(static_cast<vtkIdType>(i), p);
      if (!inside.Has(toClip, p[0], p[1], p[2]))
      {
        all = false;
      }
    }
  });
  return all;
}

/// Whether all that a prop draws is within a frame, at least a few px from its border, so that the
/// background beside it is seen as well.
/// @param toClip from the world to the frame
bool IsInside(vtkProp* prop, vtkMatrix4x4* toClip, const PixelRectangle& frame)
{
  auto* actor = vtkActor::SafeDownCast(prop);
  const double* bounds = IsKnownActor(actor) ? actor->GetBounds() : nullptr;
  if (!bounds || !vtkMath::AreBoundsInitialized(bounds))
  {
    return false;
  }
  vtkProperty* property = actor->GetProperty();
  const FrameInside inside(
    frame, 4.0 + std::max(property->GetLineWidth(), property->GetPointSize()));
  if (HasBox(inside, toClip->GetData(), bounds))
  {
    return true;
  }
  // A box has corners that the mesh has not. Testing its points takes less time than drawing them.
  auto* mesh = vtkPolyData::SafeDownCast(actor->GetMapper()->GetInputDataObject(0, 0));
  vtkNew<vtkMatrix4x4> meshToClip;
  actor->ComputeMatrix();
  vtkMatrix4x4::Multiply4x4(toClip, actor->GetMatrix(), meshToClip);
  return mesh && HasPoints(inside, meshToClip->GetData(), mesh->GetPoints());
}
}

std::vector<vtkProp*> PropsBeyond(const PassFrame& frame)
{
  vtkMatrix4x4* toClip =
    frame.Renderer->GetActiveCamera()->GetCompositeProjectionTransformMatrix(frame.Aspect, -1, 1);
  std::vector<vtkProp*> props = VisibleProps(frame.Renderer);
  props.erase(std::remove_if(props.begin(), props.end(),
                [&](vtkProp* prop) {
                  return !IsOtherProp(prop, true) || IsInside(prop, toClip, frame.Rectangle);
                }),
    props.end());
  return props;
}
}
