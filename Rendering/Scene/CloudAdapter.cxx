// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/CloudAdapter.h"

#include "Core/Base/LinearLight.h"
#include "Core/Surfels/SurfelArrays.h"
#include "Rendering/Scene/CameraAdapter.h"
#include "Rendering/Scene/HierarchyCache.h"
#include "SurfelData/HierarchyArrays.h"
#include "SurfelData/SMPExecutor.h"
#include "SurfelData/SurfelCheck.h"

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
/// CheckSurfels, and whether their place is known.
std::string CheckPlacedSurfels(vtkPolyData* surfels)
{
  const std::string problem = CheckSurfels(surfels);
  if (!problem.empty())
  {
    return problem;
  }
  vtkDataArray* array = surfels->GetFieldData()->GetArray(Arrays::Origin);
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
}

std::string CheckStorable(vtkPolyData* surfels)
{
  const bool isInSpace = surfels->GetPointData()->HasArray(Arrays::GaussianCovariance);
  return isInSpace
    ? std::string(".surfels files hold surfels, not Gaussians in space (point array ") +
      Arrays::GaussianCovariance + "); write a .vtp file with vtkXMLPolyDataWriter"
    : CheckPlacedSurfels(surfels);
}

std::string MakeCloud(const CloudInput& input, SurfelCloudSource& source)
{
  vtkPolyData* surfels = input.Surfels;
  SurfelCloud& cloud = source.Cloud;
  if (!surfels || surfels->GetNumberOfPoints() == 0)
  {
    return std::string();
  }
  std::string problem = CheckPlacedSurfels(surfels);
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
  cloud.ShowsBacks = input.ShowsBacks;
  cloud.Surface = MakeMaterial(input.Property, input.LinearLight);
  return std::string();
}
}
