// SPDX-License-Identifier: BSD-3-Clause
#include "SurfelData/SurfelCheck.h"

#include "Core/Surfels/SphericalHarmonics.h"
#include "Core/Surfels/SurfelArrays.h"

#include <vtkDataArray.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>

#include <algorithm>
#include <initializer_list>

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
        ": it holds points, not surfels. Make surfels of them with vtkPointsToSurfels."
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

/// The first problem; empty if there is none.
std::string FirstOf(std::initializer_list<std::string> problems)
{
  const auto* found = std::find_if(
    problems.begin(), problems.end(), [](const std::string& problem) { return !problem.empty(); });
  return found != problems.end() ? *found : std::string();
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
  return FirstOf({ CheckArray(gaussians, Arrays::GaussianCovariance, 6, true),
    CheckArray(gaussians, density, 1, true),
    CheckArray(gaussians, Arrays::GaussianNormal, 3, false),
    CheckArray(gaussians, Arrays::GaussianHarmonics, components, false) });
}
}

std::string CheckSurfels(vtkPolyData* surfels)
{
  if (!surfels)
  {
    return "There is no input: connect surfels, for example from vtkSurfelEstimation.";
  }
  if (surfels->GetPointData()->HasArray(Arrays::GaussianCovariance))
  {
    return CheckGaussians(surfels);
  }
  return FirstOf({ CheckArray(surfels, Arrays::Covariance, 6, true),
    CheckArray(surfels, Arrays::AreaVector, 3, true),
    CheckArray(surfels, Arrays::TwoSided, 1, false), CheckArray(surfels, Arrays::Overlap, 1, false),
    CheckArray(surfels, Arrays::Opacity, 1, false) });
}
}
