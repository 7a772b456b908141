// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Common/InputArrays.h"

#include "Core/Surfels/SurfelArrays.h"

#include "vtkDataArray.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"

#include <limits>

namespace SurfelGeometry
{
namespace Arrays = SurfelSplatting::Arrays;

namespace
{
/// Whether there is an array with a tuple for each point.
bool HasArray(vtkPolyData* input, const char* name, int components)
{
  vtkDataArray* found = input->GetPointData()->GetArray(name);
  return found && found->GetNumberOfComponents() == components &&
    found->GetNumberOfTuples() == input->GetNumberOfPoints();
}

std::string CheckGaussians(vtkPolyData* input)
{
  if (!HasArray(input, Arrays::GaussianCovariance, 6))
  {
    return std::string("The point array ") + Arrays::GaussianCovariance +
      " has not six components for every point: see the data contract in the documentation.";
  }
  if (HasArray(input, Arrays::GaussianOpacity, 1) == HasArray(input, Arrays::GaussianExtinction, 1))
  {
    return std::string("Gaussians need a number for every point in one of the point arrays ") +
      Arrays::GaussianOpacity + " and " + Arrays::GaussianExtinction + ".";
  }
  if (input->GetPointData()->HasArray(Arrays::GaussianNormal) &&
    !HasArray(input, Arrays::GaussianNormal, 3))
  {
    return std::string("The point array ") + Arrays::GaussianNormal +
      " has not three components for every point: see the data contract in the documentation.";
  }
  return std::string();
}
}

std::string CheckSurfels(vtkPolyData* input)
{
  if (!input)
  {
    return "There is no input: connect surfels, for example from vtkSurfelEstimation.";
  }
  if (input->GetPointData()->HasArray(Arrays::GaussianCovariance))
  {
    return CheckGaussians(input);
  }
  const struct
  {
    const char* Name;
    int Components;
    bool Needed;
  } arrays[] = { { Arrays::AreaVector, 3, true }, { Arrays::Covariance, 6, true },
    { Arrays::TwoSided, 1, false }, { Arrays::Overlap, 1, false }, { Arrays::Opacity, 1, false } };
  for (const auto& array : arrays)
  {
    if (!array.Needed && !input->GetPointData()->GetArray(array.Name))
    {
      continue;
    }
    if (!HasArray(input, array.Name, array.Components))
    {
      return std::string("The input has no point array \"") + array.Name + "\" of " +
        std::to_string(array.Components) +
        " components for every point, so it has no surfels. Run vtkSurfelEstimation first.";
    }
  }
  return std::string();
}

std::string CheckNumberOfPoints(vtkIdType points)
{
  constexpr vtkIdType most = std::numeric_limits<int>::max() / 2;
  return points <= most ? std::string()
                        : "The input has " + std::to_string(points) +
      " points; the neighbour search takes up to " + std::to_string(most) + ". Split the cloud.";
}

vtkDataArray* FindNormals(vtkPointSet* input, const char* name)
{
  vtkPointData* data = input->GetPointData();
  vtkDataArray* normals = name ? data->GetArray(name) : nullptr;
  normals = normals ? normals : data->GetNormals();
  normals = normals ? normals : data->GetArray("Normals");
  return normals && normals->GetNumberOfComponents() == 3 &&
      normals->GetNumberOfTuples() == input->GetNumberOfPoints()
    ? normals
    : nullptr;
}

std::string ListCounts(std::initializer_list<std::pair<vtkIdType, const char*>> counts)
{
  std::string text;
  for (const auto& [count, what] : counts)
  {
    if (count > 0)
    {
      text += (text.empty() ? "" : "; ") + std::to_string(count) + ' ' + what;
    }
  }
  return text;
}
}
