// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Arrays/InputArrays.h"

#include "vtkDataArray.h"
#include "vtkDataSetAttributes.h"
#include "vtkFieldData.h"
#include "vtkObject.h"
#include "vtkPointData.h"
#include "vtkPointSet.h"
#include "vtkPoints.h"
#include "vtkUnsignedCharArray.h"

#include <limits>

namespace SurfelGeometry
{
namespace
{
bool AreVectorsOf(vtkPointSet* points, vtkDataArray* array)
{
  return array && array->GetNumberOfComponents() == 3 &&
    array->GetNumberOfTuples() == points->GetNumberOfPoints();
}

bool IsHidden(vtkUnsignedCharArray* ghosts, vtkIdType i)
{
  return (ghosts->GetValue(i) & vtkDataSetAttributes::HIDDENPOINT) != 0;
}

bool HasHidden(vtkPointSet* points)
{
  const vtkIdType count = points ? points->GetNumberOfPoints() : 0;
  vtkUnsignedCharArray* ghosts = count > 0 ? points->GetPointGhostArray() : nullptr;
  vtkIdType first = ghosts && ghosts->GetNumberOfValues() == count ? 0 : count;
  while (first < count && !IsHidden(ghosts, first))
  {
    ++first;
  }
  return first < count;
}

/// A copy whose hidden points are nowhere.
vtkSmartPointer<vtkPointSet> WithoutHidden(vtkPointSet* points)
{
  const double nowhere = std::numeric_limits<double>::quiet_NaN();
  vtkNew<vtkPoints> places;
  places->SetDataType(points->GetPoints()->GetDataType() == VTK_FLOAT ? VTK_FLOAT : VTK_DOUBLE);
  places->SetNumberOfPoints(points->GetNumberOfPoints());
  vtkUnsignedCharArray* ghosts = points->GetPointGhostArray();
  for (vtkIdType i = 0; i < points->GetNumberOfPoints(); ++i)
  {
    double p[3] = { nowhere, nowhere, nowhere };
    if (!IsHidden(ghosts, i))
    {
      points->GetPoint(i, p);
    }
    places->SetPoint(i, p);
  }
  const auto seen = vtkSmartPointer<vtkPointSet>::Take(points->NewInstance());
  seen->ShallowCopy(points);
  seen->SetPoints(places);
  return seen;
}
}

std::string CheckNumberOfPoints(vtkIdType points)
{
  constexpr vtkIdType most = std::numeric_limits<int>::max() / 2;
  return points <= most ? std::string()
                        : "The input has " + std::to_string(points) +
      " points; the neighbour search takes up to " + std::to_string(most) + ". Split the cloud.";
}

vtkSmartPointer<vtkPointSet> WithFittingArrays(vtkPointSet* points, vtkObject* filter)
{
  const vtkIdType count = points ? points->GetNumberOfPoints() : 0;
  const int arrays = points ? points->GetPointData()->GetNumberOfArrays() : 0;
  vtkSmartPointer<vtkPointSet> fitting = points;
  if (HasHidden(points))
  {
    fitting = WithoutHidden(points);
  }
  std::string others;
  for (int i = arrays - 1; i >= 0; --i)
  {
    vtkAbstractArray* array = points->GetPointData()->GetAbstractArray(i);
    if (array->GetNumberOfTuples() == count)
    {
      continue;
    }
    if (others.empty())
    {
      const vtkSmartPointer<vtkPointSet> whole = fitting;
      fitting.TakeReference(whole->NewInstance());
      fitting->ShallowCopy(whole);
    }
    fitting->GetPointData()->RemoveArray(i);
    others += (others.empty() ? "" : ", ") +
      std::string(array->GetName() ? array->GetName() : "without a name") + " (" +
      std::to_string(array->GetNumberOfTuples()) + ")";
  }
  if (!others.empty())
  {
    vtkWarningWithObjectMacro(filter,
      "Point arrays left out, which have not one value for each of the " << count
                                                                         << " points: " << others);
  }
  return fitting;
}

vtkDataArray* FindNormals(vtkPointSet* input, const char* name)
{
  vtkPointData* data = input->GetPointData();
  vtkDataArray* normals = name ? data->GetArray(name) : nullptr;
  normals = normals ? normals : data->GetNormals();
  normals = normals ? normals : data->GetArray("Normals");
  return AreVectorsOf(input, normals) ? normals : nullptr;
}

bool HasNormalsOfFaces(vtkPointSet* input)
{
  return input->GetFieldData()->HasArray(FacesArray) != 0;
}

vtkDataArray* FindScanners(vtkPointSet* input)
{
  vtkDataArray* ways = input->GetPointData()->GetArray(ToScannerArray);
  return AreVectorsOf(input, ways) ? ways : nullptr;
}

std::string ListCounts(std::initializer_list<CountedThings> counts)
{
  std::string text;
  for (const auto& [count, thing, what] : counts)
  {
    if (count > 0)
    {
      text += (text.empty() ? "" : "; ") + std::to_string(count) + ' ' + thing +
        (count == 1 ? " " : "s ") + what;
    }
  }
  return text;
}
}
