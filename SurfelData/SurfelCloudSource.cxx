// SPDX-License-Identifier: BSD-3-Clause
#include "SurfelData/SurfelCloudSource.h"

#include "Core/Surfels/SurfelArrays.h"

#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkUnsignedCharArray.h>
#include <vtkVariant.h>

#include <algorithm>

namespace SurfelSplatting
{
namespace
{
void SetPositions(vtkPoints* points, SurfelCloudSource& source)
{
  if (points && points->GetDataType() == VTK_FLOAT)
  {
    source.Cloud.PositionsFloat = source.Keep<vtkFloatArray>(points->GetData());
  }
  else if (points)
  {
    source.Cloud.PositionsDouble = source.Keep<vtkDoubleArray>(points->GetData());
  }
}

void SetGaussians(vtkPointData* data, SurfelCloudSource& source)
{
  SurfelCloud& cloud = source.Cloud;
  vtkDataArray* extinction = data->GetArray(Arrays::GaussianExtinction);
  cloud.Kind = extinction ? CloudKind::Volume : CloudKind::Capture;
  cloud.Covariances = source.Keep<vtkFloatArray>(data->GetArray(Arrays::GaussianCovariance));
  cloud.Densities =
    source.Keep<vtkFloatArray>(extinction ? extinction : data->GetArray(Arrays::GaussianOpacity));
  cloud.Normals =
    extinction ? source.Keep<vtkFloatArray>(data->GetArray(Arrays::GaussianNormal)) : nullptr;
}
}

void SetSurfels(vtkPolyData* surfels, SurfelCloudSource& source)
{
  SurfelCloud& cloud = source.Cloud;
  vtkPointData* data = surfels->GetPointData();
  cloud.NumberOfSurfels = static_cast<std::size_t>(surfels->GetNumberOfPoints());
  SetPositions(surfels->GetPoints(), source);
  if (data->GetArray(Arrays::GaussianCovariance))
  {
    SetGaussians(data, source);
    return;
  }
  cloud.Covariances = source.Keep<vtkFloatArray>(data->GetArray(Arrays::Covariance));
  cloud.AreaVectors = source.Keep<vtkFloatArray>(data->GetArray(Arrays::AreaVector));
  cloud.TwoSided = source.Keep<vtkUnsignedCharArray>(data->GetArray(Arrays::TwoSided));
  cloud.Overlaps = source.Keep<vtkUnsignedCharArray>(data->GetArray(Arrays::Overlap));
  cloud.Opacities = source.Keep<vtkFloatArray>(data->GetArray(Arrays::Opacity));
}

void ReadOrigin(vtkPointSet* surfels, double origin[3])
{
  std::fill_n(origin, 3, 0.0);
  vtkDataArray* array = surfels ? surfels->GetFieldData()->GetArray(Arrays::Origin) : nullptr;
  for (int i = 0; array && array->GetNumberOfValues() == 3 && i < 3; ++i)
  {
    origin[i] = array->GetVariantValue(i).ToDouble();
  }
}
}
