// SPDX-License-Identifier: BSD-3-Clause
#include "VolumeGaussians.h"

#include "vtkVolumeSplatting.h"

#include <vtkDataArray.h>
#include <vtkDataObject.h>
#include <vtkDiscretizableColorTransferFunction.h>
#include <vtkFieldData.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkMapper.h>
#include <vtkNew.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkTrivialProducer.h>
#include <vtkUnsignedCharArray.h>
#include <vtkVolumeProperty.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace SurfelViews
{
namespace
{
constexpr const char* Mark = "SurfelVolume"; // field array of clouds of volumes

/// Of the image of which this process may have a piece.
std::array<int, 6> WholeExtent(vtkInformation* input, vtkImageData* image)
{
  std::array<int, 6> extent;
  image->GetExtent(extent.data());
  if (input->Has(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT()))
  {
    input->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent.data());
  }
  return extent;
}

/// Of the whole image, so that all processes have the same.
double UnitDistance(vtkImageData* image, const std::array<int, 6>& extent)
{
  double square = 0.0, cells = 1.0;
  for (int k = 0; k < 3; ++k)
  {
    const double count = std::max(1, extent[2 * k + 1] - extent[2 * k]);
    square += std::pow(count * image->GetSpacing()[k], 2);
    cells *= count;
  }
  return std::sqrt(square) / std::cbrt(cells);
}
}

VolumeColors::VolumeColors(vtkInformation* array, vtkMapper* mapper)
{
  auto* functions = vtkDiscretizableColorTransferFunction::SafeDownCast(mapper->GetLookupTable());
  vtkPiecewiseFunction* opacity = functions ? functions->GetScalarOpacityFunction() : nullptr;
  const bool isOfPoints = array && array->Has(vtkDataObject::FIELD_NAME()) &&
    array->Get(vtkDataObject::FIELD_ASSOCIATION()) == vtkDataObject::FIELD_ASSOCIATION_POINTS;
  const char* name = isOfPoints ? array->Get(vtkDataObject::FIELD_NAME()) : nullptr;
  if (opacity && name && *name)
  {
    this->Array = name;
    this->Functions = functions;
    // Not the table's time: it is made anew when something is drawn.
    this->Time = std::max(functions->vtkObject::GetMTime(), opacity->GetMTime());
  }
}

vtkSmartPointer<vtkPolyData> MakeVolumeGaussians(
  vtkInformation* input, const VolumeColors& colors, bool shade)
{
  vtkImageData* image = vtkImageData::GetData(input);
  if (!image || !colors.Functions)
  {
    return nullptr;
  }
  const int* size = image->GetDimensions();
  vtkDataArray* scalars = image->GetPointData()->GetArray(colors.Array.c_str());
  if (std::min({ size[0], size[1], size[2] }) < 2 || !scalars ||
    scalars->GetNumberOfComponents() != 1)
  {
    return nullptr;
  }
  const std::array<int, 6> whole = WholeExtent(input, image);
  vtkNew<vtkVolumeProperty> property;
  property->SetColor(colors.Functions);
  property->SetScalarOpacity(colors.Functions->GetScalarOpacityFunction());
  property->SetScalarOpacityUnitDistance(UnitDistance(image, whole));
  property->SetShade(shade);
  vtkNew<vtkTrivialProducer> producer; // says which faces of a piece are those of the whole
  producer->SetOutput(image);
  producer->SetWholeExtent(whole[0], whole[1], whole[2], whole[3], whole[4], whole[5]);
  vtkNew<vtkVolumeSplatting> splatting;
  splatting->SetInputConnection(producer->GetOutputPort());
  splatting->SetInputArrayToProcess(
    0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, colors.Array.c_str());
  splatting->SetVolumeProperty(property);
  splatting->Update();
  vtkNew<vtkUnsignedCharArray> mark;
  mark->SetName(Mark);
  mark->InsertNextValue(1);
  splatting->GetOutput()->GetFieldData()->AddArray(mark);
  return splatting->GetOutput();
}

bool IsOfVolume(vtkPolyData* cloud)
{
  return cloud && cloud->GetFieldData()->HasArray(Mark);
}
}
