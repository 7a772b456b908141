// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/SceneAdapter.h"

#include "Core/Base/LinearLight.h"
#include "Core/Surfels/SurfelArrays.h"
#include "Rendering/Scene/HierarchyCache.h"
#include "vtkSurfelMapper.h"

#include <vtkCamera.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkLight.h>
#include <vtkLightCollection.h>
#include <vtkMath.h>
#include <vtkMatrix4x4.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkSMPTools.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>

namespace SurfelSplatting
{
namespace
{
Affine3 ToAffine(vtkMatrix4x4* m)
{
  Affine3 a;
  for (int i = 0; i < 3; ++i)
  {
    a.L[i] = { m->GetElement(i, 0), m->GetElement(i, 1), m->GetElement(i, 2) };
    a.T[i] = m->GetElement(i, 3);
  }
  return a;
}

/// Position and focal point of a light in world coordinates.
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

/// The array itself where it is of type Array, a converted copy otherwise; kept alive by the
/// source.
template <typename Array>
typename Array::ValueType* Pointer(vtkDataArray* array, SurfelCloudSource& source)
{
  vtkSmartPointer<Array> typed = Array::SafeDownCast(array);
  if (!typed)
  {
    typed = vtkSmartPointer<Array>::New();
    typed->DeepCopy(array);
  }
  source.Arrays.push_back(typed);
  return typed->GetPointer(0);
}

/// Empty where the array is as it should be.
std::string CheckArray(vtkPolyData* input, const char* name, int components, bool required)
{
  vtkDataArray* array = input->GetPointData()->GetArray(name);
  if (!array)
  {
    return required ? std::string("The input has no point array ") + name +
        ": it holds points, not surfels. Put a vtkSurfelEstimation before the mapper."
                    : std::string();
  }
  if (array->GetNumberOfComponents() != components)
  {
    return std::string("Point array ") + name + " has " +
      std::to_string(array->GetNumberOfComponents()) + " components instead of " +
      std::to_string(components) + ": see the data contract in the documentation.";
  }
  if (array->GetNumberOfTuples() != input->GetNumberOfPoints())
  {
    return std::string("Point array ") + name + " has " +
      std::to_string(array->GetNumberOfTuples()) + " tuples for " +
      std::to_string(input->GetNumberOfPoints()) + " points: each surfel needs one.";
  }
  return std::string();
}

std::string CheckOrigin(vtkPolyData* input)
{
  vtkDataArray* array = input->GetFieldData()->GetArray(Arrays::Origin);
  return array && array->GetNumberOfValues() != 3 ? std::string("Field array ") + Arrays::Origin +
      " has " + std::to_string(array->GetNumberOfValues()) +
      " values instead of 3: where the surfels are is not known."
                                                  : std::string();
}

Material MakeMaterial(vtkProperty* property, bool linearLight)
{
  Material material;
  material.Lit = property->GetLighting();
  material.Ambient = property->GetAmbient();
  material.Diffuse = property->GetDiffuse();
  material.Specular = property->GetSpecular();
  material.SpecularPower = property->GetSpecularPower();
  property->GetDiffuseColor(material.Color.data());
  property->GetAmbientColor(material.AmbientColor.data());
  property->GetSpecularColor(material.SpecularColor.data());
  for (auto* color : { &material.Color, &material.AmbientColor, &material.SpecularColor })
  {
    std::transform(color->begin(), color->end(), color->begin(),
      [linearLight](double c) { return linearLight ? LightOfCode(c) : c; });
  }
  return material;
}
}

void SMPExecutor::For(std::size_t size, std::size_t grain, const RangeFunction& function) const
{
  ExceptionCarrier carrier;
  vtkSMPTools::For(0, static_cast<vtkIdType>(size), static_cast<vtkIdType>(grain),
    [&](vtkIdType begin, vtkIdType end) {
      carrier.Run(
        [&]() { function(static_cast<std::size_t>(begin), static_cast<std::size_t>(end)); });
    });
  carrier.Rethrow();
}

View MakeView(vtkCamera* camera, const int size[2], double aspect)
{
  View view;
  view.Width = size[0];
  view.Height = size[1];
  view.Parallel = camera->GetParallelProjection() != 0;

  // VTK's view coordinates look along -z.
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
    // A stereo camera's eyes stand beside its position; VTK moves them in the projection.
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
    if (!source->GetSwitch())
    {
      continue;
    }
    double position[3], focalPoint[3];
    LightGeometry(source, camera, position, focalPoint);
    Light light;
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
      continue;
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
    result.push_back(light);
    headlights += source->LightTypeIsHeadlight() ? 1 : 0;
  }
  if (result.size() == 1 && headlights == 1)
  {
    result[0].LoneHeadlight = !result[0].Positional;
  }
  return result;
}

std::string MakeCloud(vtkSurfelMapper* mapper, vtkMatrix4x4* actorMatrix, vtkProperty* property,
  bool paperDetail, bool linearLight, SurfelCloudSource& source)
{
  vtkPolyData* input = mapper->GetInput();
  SurfelCloud& cloud = source.Cloud;
  if (!input || input->GetNumberOfPoints() == 0)
  {
    return std::string();
  }
  for (const std::string& problem :
    { CheckArray(input, Arrays::Covariance, 6, true),
      CheckArray(input, Arrays::AreaVector, 3, true), CheckArray(input, Arrays::TwoSided, 1, false),
      CheckArray(input, Arrays::Opacity, 1, false), CheckOrigin(input) })
  {
    if (!problem.empty())
    {
      return problem;
    }
  }

  vtkPointData* data = input->GetPointData();
  cloud.NumberOfSurfels = static_cast<std::size_t>(input->GetNumberOfPoints());
  vtkDataArray* points = input->GetPoints()->GetData();
  if (points->GetDataType() == VTK_DOUBLE)
  {
    cloud.PositionsDouble = Pointer<vtkDoubleArray>(points, source);
  }
  else
  {
    cloud.PositionsFloat = Pointer<vtkFloatArray>(points, source);
  }
  cloud.Covariances = Pointer<vtkFloatArray>(data->GetArray(Arrays::Covariance), source);
  cloud.AreaVectors = Pointer<vtkFloatArray>(data->GetArray(Arrays::AreaVector), source);
  if (vtkDataArray* twoSided = data->GetArray(Arrays::TwoSided))
  {
    cloud.TwoSided = Pointer<vtkUnsignedCharArray>(twoSided, source);
  }
  if (vtkDataArray* opacity = data->GetArray(Arrays::Opacity))
  {
    cloud.Opacities = Pointer<vtkFloatArray>(opacity, source);
  }
  vtkDataArray* colors = mapper->GetDirectColors();
  if (colors)
  {
    cloud.ColorsFloat = Pointer<vtkFloatArray>(colors, source);
  }
  else
  {
    colors = mapper->MapScalars(1.0);
    const bool usable = colors && colors->GetNumberOfComponents() == 4 &&
      colors->GetNumberOfTuples() == input->GetNumberOfPoints();
    colors = usable ? colors : nullptr;
    auto* bytes = vtkUnsignedCharArray::SafeDownCast(colors);
    if (bytes && linearLight)
    {
      colors = mapper->GetLinearColors(bytes);
      cloud.ColorsFloat = Pointer<vtkFloatArray>(colors, source);
    }
    else
    {
      cloud.ColorsUChar = colors ? Pointer<vtkUnsignedCharArray>(colors, source) : nullptr;
    }
  }
  if (HierarchyCache::IsHierarchy(input))
  {
    const std::string problem =
      mapper->GetHierarchyCache().Update(input, colors, paperDetail, SMPExecutor(), cloud);
    if (!problem.empty())
    {
      return problem;
    }
  }

  Affine3 origin;
  mapper->GetOrigin(origin.T.data());
  cloud.LocalToWorld = Affine3::Compose(ToAffine(actorMatrix), origin);
  cloud.Opacity = property->GetOpacity();
  cloud.Surface = MakeMaterial(property, linearLight);
  return std::string();
}
}
