// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/CameraAdapter.h"

#include <vtkCamera.h>
#include <vtkLight.h>
#include <vtkLightCollection.h>
#include <vtkMath.h>
#include <vtkMatrix4x4.h>

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
/// Gets position and focal point of a light in world coordinates.
void LightGeometry(vtkLight* light, vtkCamera* camera, double position[3], double focalPoint[3])
{
  if (light->LightTypeIsHeadlight())
  {
    camera->GetPosition(position);
    camera->GetFocalPoint(focalPoint);
    return;
  }
  light->GetPosition(position);
  light->GetFocalPoint(focalPoint);
  vtkMatrix4x4* matrix = light->LightTypeIsCameraLight() ? camera->GetCameraLightTransformMatrix()
                                                         : light->GetTransformMatrix();
  if (matrix)
  {
    for (double* point : { position, focalPoint })
    {
      double p[4] = { point[0], point[1], point[2], 1.0 };
      matrix->MultiplyPoint(p, p);
      std::copy_n(p, 3, point);
    }
  }
}

/// Makes a light in camera space; false if it has no direction.
bool MakeLight(vtkLight* source, vtkCamera* camera, const View& view, Light& light)
{
  double position[3], focalPoint[3];
  LightGeometry(source, camera, position, focalPoint);
  for (int c = 0; c < 3; ++c)
  {
    light.Color[c] = source->GetDiffuseColor()[c] * source->GetIntensity();
  }
  light.Position = view.WorldToCamera.Apply({ position[0], position[1], position[2] });
  light.Direction = view.WorldToCamera.ApplyLinear(
    { focalPoint[0] - position[0], focalPoint[1] - position[1], focalPoint[2] - position[2] });
  const double length = Norm(light.Direction);
  if (!(length > 0.0))
  {
    return false;
  }
  for (double& x : light.Direction)
  {
    x /= length;
  }
  light.Positional = source->GetPositional() != 0;
  std::copy_n(source->GetAttenuationValues(), 3, light.Attenuation.begin());
  light.ConeCosine = source->GetConeAngle() < 90.0
    ? std::cos(vtkMath::RadiansFromDegrees(source->GetConeAngle()))
    : -1.0;
  light.Exponent = source->GetExponent();
  return true;
}
}

Affine3 ToAffine(vtkMatrix4x4* matrix)
{
  Affine3 a;
  for (int i = 0; i < 3; ++i)
  {
    a.L[i] = { matrix->GetElement(i, 0), matrix->GetElement(i, 1), matrix->GetElement(i, 2) };
    a.T[i] = matrix->GetElement(i, 3);
  }
  return a;
}

View MakeView(vtkCamera* camera, const int size[2], double aspect)
{
  View view;
  view.Width = size[0];
  view.Height = size[1];
  view.Parallel = camera->GetParallelProjection() != 0;

  // VTK's camera looks along -z, the core's along +z.
  view.WorldToCamera = ToAffine(camera->GetModelViewTransformMatrix());
  for (double& x : view.WorldToCamera.L[2])
  {
    x = -x;
  }
  view.WorldToCamera.T[2] = -view.WorldToCamera.T[2];

  // Normalised device coordinates: (P00 x + P03)/z - P02 (perspective), P00 x + P03 (parallel).
  vtkMatrix4x4* projection = camera->GetProjectionTransformMatrix(aspect, -1, 1);
  const double halfWidth = 0.5 * size[0], halfHeight = 0.5 * size[1];
  view.Fx = halfWidth * projection->GetElement(0, 0);
  view.Fy = halfHeight * projection->GetElement(1, 1);
  view.Cx = halfWidth *
    (1.0 + (view.Parallel ? projection->GetElement(0, 3) : -projection->GetElement(0, 2)));
  view.Cy = halfHeight *
    (1.0 + (view.Parallel ? projection->GetElement(1, 3) : -projection->GetElement(1, 2)));
  if (!view.Parallel)
  {
    // The eyes of a stereo camera are beside its position; VTK puts their offset into the
    // projection.
    view.WorldToCamera.T[0] += projection->GetElement(0, 3) / projection->GetElement(0, 0);
    view.WorldToCamera.T[1] += projection->GetElement(1, 3) / projection->GetElement(1, 1);
  }
  return view;
}

Lens MakeLens(vtkCamera* camera)
{
  const double distance = camera->GetFocalDistance();
  return { 0.5 * camera->GetFocalDisk(), distance > 0.0 ? distance : camera->GetDistance() };
}

std::vector<Light> MakeLights(vtkLightCollection* lights, vtkCamera* camera, const View& view)
{
  std::vector<Light> result;
  int headlights = 0;
  vtkCollectionSimpleIterator it;
  lights->InitTraversal(it);
  while (vtkLight* source = lights->GetNextLight(it))
  {
    Light light;
    if (source->GetSwitch() && MakeLight(source, camera, view, light))
    {
      result.push_back(light);
      headlights += source->LightTypeIsHeadlight() ? 1 : 0;
    }
  }
  if (result.size() == 1 && headlights == 1)
  {
    result[0].LoneHeadlight = !result[0].Positional;
  }
  return result;
}
}
