// SPDX-License-Identifier: BSD-3-Clause
/**
 * What the tests of colours and of kernels along them share: a sheet of random or jittered points,
 * and its surfels.
 */
#pragma once

#include "SurfelTesting.h"

#include "vtkPointsToSurfels.h"
#include "vtkSurfelEstimation.h"

namespace SurfelTesting
{
constexpr double Spacing = 0.02;

inline std::vector<Vec> MakeSheet(double jitter)
{
  return MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, Spacing, jitter, Random(3))
    .Points;
}

inline vtkSmartPointer<vtkPolyData> MakeSurfels(
  vtkPolyData* data, bool interpolates, int kernels = vtkSurfelEstimation::CELL)
{
  vtkNew<vtkPointsToSurfels> filter;
  const Messages quiet(filter);
  filter->CleanPointsOff();
  filter->BuildHierarchyOff();
  filter->GetEstimation()->SetInterpolateColors(interpolates);
  filter->GetEstimation()->SetKernelMode(kernels);
  filter->SetInputData(data);
  filter->Update();
  return filter->GetOutput();
}
}
