// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Common/InputArrays.h"

#include "Core/Surfels/SurfelArrays.h"

#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkVariant.h"

#include <algorithm>
#include <limits>

namespace SurfelGeometry
{
namespace Arrays = SurfelSplatting::Arrays;

std::string CheckSurfels(vtkPolyData* input)
{
  if (!input)
  {
    return "There is no input: connect surfels, for example from vtkSurfelEstimation.";
  }
  const struct
  {
    const char* Name;
    int Components;
    bool Needed;
  } arrays[] = { { Arrays::AreaVector, 3, true }, { Arrays::Covariance, 6, true },
    { Arrays::TwoSided, 1, false }, { Arrays::Opacity, 1, false } };
  for (const auto& array : arrays)
  {
    vtkDataArray* found = input->GetPointData()->GetArray(array.Name);
    if (!found && !array.Needed)
    {
      continue;
    }
    if (!found || found->GetNumberOfComponents() != array.Components ||
      found->GetNumberOfTuples() != input->GetNumberOfPoints())
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

void ReadOrigin(vtkPointSet* input, double origin[3])
{
  vtkDataArray* array = input->GetFieldData()->GetArray(Arrays::Origin);
  std::fill_n(origin, 3, 0.0);
  for (int i = 0; array && array->GetNumberOfValues() == 3 && i < 3; ++i)
  {
    origin[i] = array->GetVariantValue(i).ToDouble();
  }
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
