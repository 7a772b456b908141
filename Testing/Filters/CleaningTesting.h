// SPDX-License-Identifier: BSD-3-Clause
/**
 * Clouds with colours, cleaned by one process and by several, for the tests of cleaning.
 */
#pragma once

#include "SurfelTesting.h"
#include "ThreadController.h"

#include "vtkFloatArray.h"
#include "vtkPointCloudCleaning.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <vector>

namespace SurfelTesting
{
/// Points with grey colours, if there are any.
inline vtkSmartPointer<vtkPolyData> WithShades(
  const std::vector<Vec>& points, const std::vector<unsigned char>& shades)
{
  const auto data = ToPolyData(points, VTK_DOUBLE);
  vtkNew<vtkUnsignedCharArray> colors;
  colors->SetName("RGB");
  colors->SetNumberOfComponents(3);
  for (const unsigned char shade : shades)
  {
    colors->InsertNextTuple3(shade, shade, shade);
  }
  if (!shades.empty())
  {
    data->GetPointData()->SetScalars(colors);
  }
  return data;
}

/// Adds the vectors to a scanner, if there is one.
inline vtkSmartPointer<vtkPolyData> WithScanner(
  const vtkSmartPointer<vtkPolyData>& data, const Vec* scanner)
{
  vtkNew<vtkFloatArray> ways;
  ways->SetName("ToScanner");
  ways->SetNumberOfComponents(3);
  for (vtkIdType i = 0; scanner && i < data->GetNumberOfPoints(); ++i)
  {
    Vec p;
    data->GetPoint(i, p.data());
    ways->InsertNextTuple(Minus(*scanner, p).data());
  }
  if (scanner)
  {
    data->GetPointData()->SetVectors(ways);
  }
  return data;
}

/// Cleans the cloud in one process and in three.
/// @param shades of the points; empty: none
/// @param scanner that has seen them; null: not known
/// @return points that were stray or moved
inline vtkIdType CompareWithProcesses(const std::vector<Vec>& points,
  const std::vector<unsigned char>& shades = {}, const Vec* scanner = nullptr)
{
  const size_t half = points.size() / 2, coloured = shades.size() / 2;
  const std::vector<Vec> parts[3] = { { points.begin(), points.begin() + half },
    { points.begin() + half, points.end() }, {} };
  const std::vector<unsigned char> partShades[3] = { { shades.begin(), shades.begin() + coloured },
    { shades.begin() + coloured, shades.end() }, {} }; // the third process has nothing
  vtkNew<vtkPointCloudCleaning> alone;
  const Messages quiet(alone);
  alone->SetController(nullptr);
  alone->SetInputData(WithScanner(WithShades(points, shades), scanner));
  alone->Update();
  vtkSmartPointer<vtkPolyData> found[3];
  vtkIdType stray[3], moved[3], joined[3], twins[3], thick[3], duplicates[3];
  ThreadController::Run(3, [&](vtkMultiProcessController* controller) {
    const int rank = controller->GetLocalProcessId();
    vtkNew<vtkPointCloudCleaning> cleaning;
    const Messages quietToo(cleaning);
    cleaning->SetController(controller);
    cleaning->SetInputData(WithScanner(WithShades(parts[rank], partShades[rank]), scanner));
    cleaning->Update();
    found[rank] = cleaning->GetOutput();
    stray[rank] = cleaning->GetNumberOfStrayPoints();
    moved[rank] = cleaning->GetNumberOfMovedPoints();
    joined[rank] = cleaning->GetNumberOfJoinedPoints();
    twins[rank] = cleaning->GetNumberOfTwinPoints();
    thick[rank] = cleaning->GetNumberOfThickPoints();
    duplicates[rank] = cleaning->GetNumberOfDuplicatePoints();
  });
  CHECK(stray[0] + stray[1] + stray[2] == alone->GetNumberOfStrayPoints());
  CHECK(moved[0] + moved[1] + moved[2] == alone->GetNumberOfMovedPoints());
  CHECK(joined[0] + joined[1] + joined[2] == alone->GetNumberOfJoinedPoints());
  CHECK(twins[0] + twins[1] + twins[2] == alone->GetNumberOfTwinPoints());
  CHECK(thick[0] + thick[1] + thick[2] == alone->GetNumberOfThickPoints());
  CHECK(duplicates[0] + duplicates[1] + duplicates[2] == alone->GetNumberOfDuplicatePoints());
  vtkIdType at = 0;
  double farthest = 0.0;
  int recolored = 0;
  for (const auto& part : found)
  {
    for (vtkIdType i = 0; i < part->GetNumberOfPoints(); ++i, ++at)
    {
      REQUIRE(at < alone->GetOutput()->GetNumberOfPoints());
      Vec a, b;
      part->GetPoint(i, a.data());
      alone->GetOutput()->GetPoint(at, b.data());
      farthest = std::max(farthest, Length(Minus(a, b)));
      vtkDataArray* shade = part->GetPointData()->GetScalars();
      recolored += shade &&
          shade->GetComponent(i, 0) !=
            alone->GetOutput()->GetPointData()->GetScalars()->GetComponent(at, 0)
        ? 1
        : 0;
    }
  }
  CHECK(at == alone->GetOutput()->GetNumberOfPoints());
  CHECK(farthest < 1e-6); // shifts are floats
  CHECK(recolored == 0);
  return alone->GetNumberOfStrayPoints() + alone->GetNumberOfMovedPoints() +
    alone->GetNumberOfJoinedPoints() + alone->GetNumberOfThickPoints();
}
}
