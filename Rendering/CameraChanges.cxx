// SPDX-License-Identifier: BSD-3-Clause
#include "CameraChanges.h"

#include <vtkCamera.h>
#include <vtkMath.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPropCollection.h>
#include <vtkRenderer.h>

#include <cmath>

namespace SurfelSplatting
{
CameraSwap::CameraSwap(vtkRenderer* renderer, vtkCamera* camera)
  : Renderer(renderer)
  , Own(renderer->GetActiveCamera())
{
  renderer->SetActiveCamera(camera);
}

CameraSwap::~CameraSwap()
{
  this->Renderer->SetActiveCamera(this->Own);
}

void ShiftCamera(vtkCamera* camera, double x, double y, double u, double v)
{
  vtkMatrix4x4* toView = camera->GetViewTransformMatrix();
  double position[3], focalPoint[3];
  camera->GetPosition(position);
  camera->GetFocalPoint(focalPoint);
  for (int i = 0; i < 3; ++i)
  {
    const double d = x * toView->GetElement(0, i) + y * toView->GetElement(1, i);
    position[i] += d;
    focalPoint[i] += d;
  }
  camera->SetPosition(position);
  camera->SetFocalPoint(focalPoint);
  if (camera->GetUseExplicitProjectionTransformMatrix())
  {
    vtkMatrix4x4* explicitMatrix = camera->GetExplicitProjectionTransformMatrix();
    vtkNew<vtkMatrix4x4> shifted;
    shifted->DeepCopy(explicitMatrix);
    // Coordinates behind the projection are divided by -z (perspective) or by 1.
    const int column = camera->GetParallelProjection() ? 3 : 2;
    const double sign = column == 3 ? 1.0 : -1.0;
    shifted->SetElement(0, column, shifted->GetElement(0, column) + sign * u);
    shifted->SetElement(1, column, shifted->GetElement(1, column) + sign * v);
    camera->SetExplicitProjectionTransformMatrix(shifted);
    return;
  }
  const double* center = camera->GetWindowCenter();
  camera->SetWindowCenter(center[0] - u, center[1] - v);
}

void WidenCamera(vtkCamera* camera, const int size[2], double aspect, int margin)
{
  const double x = 1.0 + 2.0 * margin / size[0], y = 1.0 + 2.0 * margin / size[1];
  if (camera->GetUseExplicitProjectionTransformMatrix())
  {
    vtkNew<vtkMatrix4x4> wide;
    wide->DeepCopy(camera->GetExplicitProjectionTransformMatrix());
    for (int column = 0; column < 4; ++column)
    {
      wide->SetElement(0, column, wide->GetElement(0, column) / x);
      wide->SetElement(1, column, wide->GetElement(1, column) / y);
    }
    camera->SetExplicitProjectionTransformMatrix(wide);
    return;
  }
  const double* center = camera->GetWindowCenter();
  camera->SetWindowCenter(center[0] / x, center[1] / y);
  const double half = 0.5 * vtkMath::RadiansFromDegrees(camera->GetViewAngle());
  const double wider = std::atan(std::tan(half) * (camera->GetUseHorizontalViewAngle() ? x : y));
  camera->SetViewAngle(2.0 * vtkMath::DegreesFromRadians(wider));
  camera->SetExplicitAspectRatio(
    (camera->GetUseExplicitAspectRatio() ? camera->GetExplicitAspectRatio() : aspect) * x / y);
  camera->UseExplicitAspectRatioOn();
}

std::vector<vtkProp*> VisibleProps(vtkRenderer* renderer)
{
  std::vector<vtkProp*> props;
  vtkCollectionSimpleIterator it;
  renderer->GetViewProps()->InitTraversal(it);
  while (vtkProp* prop = renderer->GetViewProps()->GetNextProp(it))
  {
    if (prop->GetVisibility())
    {
      props.push_back(prop);
    }
  }
  return props;
}
}
