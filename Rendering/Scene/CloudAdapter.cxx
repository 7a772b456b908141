// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/CloudAdapter.h"

#include "Core/Base/LinearLight.h"
#include "Core/Surfels/SurfelArrays.h"
#include "Rendering/Scene/CameraAdapter.h"
#include "Rendering/Scene/HierarchyCache.h"
#include "SurfelData/HierarchyArrays.h"
#include "SurfelData/SMPExecutor.h"

#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkMatrix4x4.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>

namespace SurfelSplatting
{
namespace
{
/// Returns an empty string if the array is as the data contract says, otherwise what to do.
std::string CheckArray(vtkPolyData* input, const char* name, int components, bool required)
{
  vtkDataArray* array = input->GetPointData()->GetArray(name);
  if (!array)
  {
    return required ? std::string("The input has no point array ") + name +
        ": it holds points, not surfels. Put a vtkPointsToSurfels before the mapper."
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
      " values instead of 3: the position of the surfels is unknown."
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

void SetColors(vtkDataArray* colors, SurfelCloudSource& source)
{
  if (vtkFloatArray::SafeDownCast(colors))
  {
    source.Cloud.ColorsFloat = source.Keep<vtkFloatArray>(colors);
  }
  else if (colors)
  {
    source.Cloud.ColorsUChar = source.Keep<vtkUnsignedCharArray>(colors);
  }
}

std::string CheckGaussians(vtkPolyData* gaussians)
{
  vtkPointData* data = gaussians->GetPointData();
  const bool isVolume = data->HasArray(Arrays::GaussianExtinction);
  if (isVolume && data->HasArray(Arrays::GaussianOpacity))
  {
    return std::string("There are two point arrays ") + Arrays::GaussianOpacity + " and " +
      Arrays::GaussianExtinction + ": keep one of them.";
  }
  const char* density = isVolume ? Arrays::GaussianExtinction : Arrays::GaussianOpacity;
  vtkDataArray* harmonics = data->GetArray(Arrays::GaussianHarmonics);
  const int components = harmonics ? harmonics->GetNumberOfComponents() : 3;
  if (components % 3 != 0 || !IsNumberOfHarmonics(components / 3))
  {
    return std::string("Point array ") + Arrays::GaussianHarmonics + " has " +
      std::to_string(components) + " components instead of 3, 12, 27 or 48: harmonics of degree 0" +
      " to 3 for three colours.";
  }
  for (const std::string& problem :
    { CheckArray(gaussians, Arrays::GaussianCovariance, 6, true),
      CheckArray(gaussians, density, 1, true),
      CheckArray(gaussians, Arrays::GaussianNormal, 3, false),
      CheckArray(gaussians, Arrays::GaussianHarmonics, components, false), CheckOrigin(gaussians) })
  {
    if (!problem.empty())
    {
      return problem;
    }
  }
  return std::string();
}
}

std::string CheckSurfels(vtkPolyData* surfels)
{
  if (surfels->GetPointData()->HasArray(Arrays::GaussianCovariance))
  {
    return CheckGaussians(surfels);
  }
  for (const std::string& problem : { CheckArray(surfels, Arrays::Covariance, 6, true),
         CheckArray(surfels, Arrays::AreaVector, 3, true),
         CheckArray(surfels, Arrays::TwoSided, 1, false),
         CheckArray(surfels, Arrays::Overlap, 1, false),
         CheckArray(surfels, Arrays::Opacity, 1, false), CheckOrigin(surfels) })
  {
    if (!problem.empty())
    {
      return problem;
    }
  }
  return std::string();
}

std::string CheckStorable(vtkPolyData* surfels)
{
  const bool isInSpace = surfels->GetPointData()->HasArray(Arrays::GaussianCovariance);
  return isInSpace
    ? std::string(".surfels files hold surfels, not Gaussians in space (point array ") +
      Arrays::GaussianCovariance + "); write a .vtp file with vtkXMLPolyDataWriter"
    : CheckSurfels(surfels);
}

std::string MakeCloud(const CloudInput& input, SurfelCloudSource& source)
{
  vtkPolyData* surfels = input.Surfels;
  SurfelCloud& cloud = source.Cloud;
  if (!surfels || surfels->GetNumberOfPoints() == 0)
  {
    return std::string();
  }
  std::string problem = CheckSurfels(surfels);
  if (!problem.empty())
  {
    return problem;
  }
  cloud.LocalToWorld = Affine3();
  SetSurfels(surfels, source);
  SetColors(input.Colors, source);
  if (IsHierarchy(surfels))
  {
    problem = input.Hierarchy->Update(surfels, input.Colors, input.PaperCut, SMPExecutor(), cloud);
    if (!problem.empty())
    {
      return problem;
    }
  }
  vtkDataArray* harmonics = surfels->GetPointData()->GetArray(Arrays::GaussianHarmonics);
  if (cloud.IsInSpace() && harmonics && !input.Colors)
  {
    input.Hierarchy->UpdateHarmonics(surfels, harmonics, SMPExecutor(), cloud);
  }
  Affine3 origin;
  ReadOrigin(surfels, origin.T.data());
  origin = Affine3::Compose(origin, cloud.LocalToWorld); // of a hierarchy that was moved
  cloud.LocalToWorld = Affine3::Compose(ToAffine(input.Matrix), origin);
  cloud.Opacity = input.Property->GetOpacity();
  cloud.Surface = MakeMaterial(input.Property, input.LinearLight);
  return std::string();
}
}
