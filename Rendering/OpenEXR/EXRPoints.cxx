// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenEXR/EXRPoints.h"

#include "Core/Surfels/SurfelArrays.h"
#include "vtkCellArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkIdList.h"
#include "vtkImageData.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"

#include <array>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
/// Computes positions from pixels and distances.
class Unprojection
{
public:
  Unprojection(vtkImageData* image, double pixelAspectRatio)
    : Width(image->GetDimensions()[0])
  {
    vtkDataArray* matrix = image->GetFieldData()->GetArray(Arrays::WorldToCamera);
    vtkDataArray* window = image->GetFieldData()->GetArray(Arrays::ScreenWindow);
    if (!matrix || !window)
    {
      return;
    }
    this->CameraToWorld->DeepCopy(matrix->GetTuple(0));
    const double volume = this->CameraToWorld->Determinant();
    this->HasCamera = std::isfinite(volume) && volume != 0.0;
    this->CameraToWorld->Invert();
    this->PixelWidth = window->GetComponent(0, 2) / this->Width;
    this->PixelHeight = this->PixelWidth / pixelAspectRatio;
    this->Left = window->GetComponent(0, 0) - 0.5 * this->Width * this->PixelWidth;
    this->Bottom = window->GetComponent(0, 1) - 0.5 * image->GetDimensions()[1] * this->PixelHeight;
  }

  std::array<double, 4> Place(vtkIdType pixel, double depth) const
  {
    const double x = pixel % this->Width + 0.5, y = pixel / this->Width + 0.5;
    if (!this->HasCamera)
    {
      return { x, y, depth, 1.0 };
    }
    // The camera looks along -z.
    std::array<double, 4> p{ (this->Left + x * this->PixelWidth) * depth,
      (this->Bottom + y * this->PixelHeight) * depth, -depth, 1.0 };
    this->CameraToWorld->MultiplyPoint(p.data(), p.data());
    return p;
  }

private:
  vtkIdType Width;
  vtkNew<vtkMatrix4x4> CameraToWorld;
  bool HasCamera = false;
  double PixelWidth = 1.0, PixelHeight = 1.0; // at distance 1, world units
  double Left = 0.0, Bottom = 0.0;
};

void AddDeepPoints(vtkImageData* image, const Unprojection& camera, vtkPolyData* output)
{
  vtkDataArray* counts = image->GetPointData()->GetArray(Arrays::SampleCount);
  auto* samples = vtkFloatArray::SafeDownCast(image->GetFieldData()->GetArray(Arrays::DeepSamples));
  vtkNew<vtkFloatArray> color, depth;
  color->SetName("Color");
  color->SetNumberOfComponents(4);
  color->Resize(samples->GetNumberOfTuples());
  depth->SetName("Depth");
  depth->Resize(samples->GetNumberOfTuples());
  output->GetPoints()->Resize(samples->GetNumberOfTuples());
  const vtkIdType components = samples->GetNumberOfComponents();
  vtkIdType sample = 0;
  for (vtkIdType pixel = 0; pixel < counts->GetNumberOfTuples(); ++pixel)
  {
    const vtkIdType end = sample + static_cast<vtkIdType>(counts->GetComponent(pixel, 0));
    for (; sample < end; ++sample)
    {
      const float* values = samples->GetPointer(components * sample);
      const float back = values[components - 1]; // or the same as Z
      const float middle = std::isfinite(back) ? 0.5f * (values[4] + back) : values[4];
      if (std::isfinite(middle))
      {
        output->GetPoints()->InsertNextPoint(camera.Place(pixel, middle).data());
        color->InsertNextTypedTuple(values);
        depth->InsertNextValue(middle);
      }
    }
  }
  output->GetPointData()->AddArray(color);
  output->GetPointData()->AddArray(depth);
}

void AddFlatPoints(vtkImageData* image, const Unprojection& camera, vtkPolyData* output)
{
  vtkDataArray* depth = image->GetPointData()->GetArray("Depth");
  vtkNew<vtkIdList> pixels;
  for (vtkIdType pixel = 0; depth && pixel < depth->GetNumberOfTuples(); ++pixel)
  {
    const double distance = depth->GetComponent(pixel, 0);
    if (distance > 0.0 && std::isfinite(distance))
    {
      pixels->InsertNextId(pixel);
    }
  }
  output->GetPoints()->SetNumberOfPoints(pixels->GetNumberOfIds());
  for (vtkIdType i = 0; i < pixels->GetNumberOfIds(); ++i)
  {
    const vtkIdType pixel = pixels->GetId(i);
    output->GetPoints()->SetPoint(i, camera.Place(pixel, depth->GetComponent(pixel, 0)).data());
  }
  for (int i = 0; i < image->GetPointData()->GetNumberOfArrays(); ++i)
  {
    vtkDataArray* from = image->GetPointData()->GetArray(i);
    vtkNew<vtkFloatArray> to;
    to->SetName(from->GetName());
    to->SetNumberOfComponents(from->GetNumberOfComponents());
    to->SetNumberOfTuples(pixels->GetNumberOfIds());
    from->GetTuples(pixels, to);
    output->GetPointData()->AddArray(to);
  }
}

void AddVertices(vtkPolyData* output)
{
  const vtkIdType size = output->GetNumberOfPoints();
  vtkNew<vtkCellArray> vertices;
  vertices->AllocateExact(size, size);
  for (vtkIdType i = 0; i < size; ++i)
  {
    vertices->InsertNextCell(1, &i);
  }
  output->SetVerts(vertices);
}
}

void MakePoints(vtkImageData* image, double pixelAspectRatio, vtkPolyData* points)
{
  vtkNew<vtkPoints> positions;
  positions->SetDataTypeToDouble();
  points->SetPoints(positions);
  const Unprojection camera(image, pixelAspectRatio);
  if (image->GetFieldData()->HasArray(Arrays::DeepSamples))
  {
    AddDeepPoints(image, camera, points);
  }
  else
  {
    AddFlatPoints(image, camera, points);
  }
  points->GetPointData()->SetActiveScalars("Color");
  AddVertices(points);
}
}
