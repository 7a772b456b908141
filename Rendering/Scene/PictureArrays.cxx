// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/PictureArrays.h"

#include "Core/Picture/DeepImage.h"
#include "Core/Splats/SplatContext.h"
#include "Core/Surfels/SurfelArrays.h"

#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkUnsignedIntArray.h>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace SurfelSplatting
{
vtkSmartPointer<vtkFloatArray> NewPixelArray(const char* name, int components, vtkIdType pixels)
{
  vtkSmartPointer<vtkFloatArray> array = vtkSmartPointer<vtkFloatArray>::New();
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(pixels);
  return array;
}

void AddDeepSamples(const DeepImage& deep, vtkImageData* output)
{
  const std::vector<std::uint64_t>& offsets = deep.Offsets();
  const auto pixels = static_cast<vtkIdType>(offsets.size()) - 1;
  vtkNew<vtkUnsignedIntArray> counts;
  counts->SetName(Arrays::SampleCount);
  counts->SetNumberOfTuples(pixels);
  for (vtkIdType p = 0; p < pixels; ++p)
  {
    counts->SetValue(p, static_cast<unsigned int>(offsets[p + 1] - offsets[p]));
  }
  output->GetPointData()->AddArray(counts);
  const auto& samples = deep.Samples();
  const bool haveExtents = std::any_of(
    samples.begin(), samples.end(), [](const DeepSample& s) { return s.Back > s.Depth; });
  const int components = haveExtents ? 6 : 5;
  vtkSmartPointer<vtkFloatArray> values =
    NewPixelArray(Arrays::DeepSamples, components, static_cast<vtkIdType>(samples.size()));
  float* to = values->GetPointer(0);
  for (const DeepSample& s : samples)
  {
    const float numbers[] = { s.Red, s.Green, s.Blue, s.Alpha, s.Depth, s.Back };
    to = std::copy_n(numbers, components, to);
  }
  output->GetFieldData()->AddArray(values);
}

void AddCameraArrays(const SplatContext& context, vtkImageData* output)
{
  vtkNew<vtkDoubleArray> matrix, lens;
  matrix->SetName(Arrays::WorldToCamera);
  matrix->SetNumberOfComponents(16);
  double rows[16] = { 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1 };
  const Affine3& m = context.Camera.WorldToCamera;
  for (int i = 0; i < 3; ++i)
  {
    const double sign = i == 2 ? -1.0 : 1.0; // the core's camera looks along +z, VTK's along -z
    for (int j = 0; j < 3; ++j)
    {
      rows[4 * i + j] = sign * m.L[i][j];
    }
    rows[4 * i + 3] = sign * m.T[i];
  }
  matrix->InsertNextTuple(rows);
  lens->SetName(Arrays::CameraLens);
  lens->SetNumberOfComponents(3);
  lens->InsertNextTuple3(
    context.Camera.Fy, 2.0 * context.Optics.Radius, context.Optics.FocalDistance);
  output->GetFieldData()->AddArray(matrix);
  output->GetFieldData()->AddArray(lens);
  const View& view = context.Camera;
  if (!view.Parallel)
  {
    vtkNew<vtkDoubleArray> window;
    window->SetName(Arrays::ScreenWindow);
    window->SetNumberOfComponents(3);
    window->InsertNextTuple3((0.5 * view.Width - view.Cx) / view.Fx,
      (0.5 * view.Height - view.Cy) / view.Fy, view.Width / view.Fx);
    output->GetFieldData()->AddArray(window);
  }
}
}
