// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Arrays/PointColors.h"

#include "Core/Surfels/SurfelArrays.h"
#include "Filters/Arrays/SurfelOutput.h"
#include "Filters/Common/Intrinsics.h"
#include "Filters/Common/ParallelFor.h"

#include "vtkFloatArray.h"
#include "vtkPointData.h"
#include "vtkPointSet.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>

namespace SurfelGeometry
{
namespace
{
/// So many points ahead, colours start to load: in the other order they are not in the caches.
constexpr vtkIdType ColorsAhead = 16;

/// The array as direct colours of `count` points, or null.
vtkUnsignedCharArray* AsColors(vtkAbstractArray* array, vtkIdType count)
{
  auto* colors = vtkUnsignedCharArray::SafeDownCast(array);
  const int components = colors ? colors->GetNumberOfComponents() : 0;
  const bool isColor = components == ColorComponents || components == ColorComponents + 1;
  return isColor && colors->GetNumberOfTuples() == count && !IsOfSurfels(colors->GetName())
    ? colors
    : nullptr;
}

/// The colours of the cloud's points in an array whose values are already 0 to 255.
template <typename Array>
CloudColors Gather(Array* array, const LocalCloud& cloud)
{
  CloudColors colors(ColorComponents * cloud.InputIds.size());
  const int components = array->GetNumberOfComponents();
  const vtkIdType last = cloud.Size() - 1;
  ParallelFor(0, cloud.Size(), [&](vtkIdType i, vtkIdType end) {
    for (; i < end; ++i)
    {
      const size_t next = static_cast<size_t>(std::min(i + ColorsAhead, last));
      SURFEL_PREFETCH(array->GetPointer(components * vtkIdType{ cloud.InputIds[next] }));
      const auto* from = array->GetPointer(components * vtkIdType{ cloud.InputIds[i] });
      for (int c = 0; c < ColorComponents; ++c)
      {
        colors[ColorComponents * i + c] = static_cast<unsigned char>(from[c]);
      }
    }
  });
  return colors;
}
}

vtkDataArray* FindColors(vtkPointSet* points)
{
  vtkPointData* data = points->GetPointData();
  const vtkIdType count = points->GetNumberOfPoints();
  vtkDataArray* found = AsColors(data->GetScalars(), count);
  for (int i = 0; i < data->GetNumberOfArrays() && !found; ++i)
  {
    found =
      data->GetAbstractArray(i)->GetName() ? AsColors(data->GetAbstractArray(i), count) : nullptr;
  }
  return found ? found : data->GetArray(FetchedColorsArray);
}

vtkDataArray* FindColorsToInterpolate(vtkPointSet* points)
{
  const bool areSurfels = points->GetPointData()->HasArray(SurfelSplatting::Arrays::Covariance);
  return areSurfels ? nullptr : FindColors(points);
}

CloudColors GatherColors(vtkPointSet* points, const LocalCloud& cloud)
{
  vtkDataArray* array = FindColors(points);
  if (auto* bytes = vtkUnsignedCharArray::SafeDownCast(array))
  {
    return Gather(bytes, cloud);
  }
  auto* fetched = vtkFloatArray::SafeDownCast(array);
  return fetched ? Gather(fetched, cloud) : CloudColors();
}

vtkSmartPointer<vtkUnsignedCharArray> NewColorsLike(vtkDataArray* colors, vtkIdType count)
{
  auto copy = vtkSmartPointer<vtkUnsignedCharArray>::New();
  copy->SetName(colors->GetName());
  copy->SetNumberOfComponents(colors->GetNumberOfComponents());
  copy->CopyComponentNames(colors);
  copy->SetNumberOfTuples(count);
  return copy;
}

void ReplaceColors(vtkUnsignedCharArray* colors, vtkPointSet* points)
{
  vtkPointData* data = points->GetPointData();
  if (FindColors(points) == data->GetScalars())
  {
    data->SetScalars(colors);
  }
  else
  {
    data->AddArray(colors); // in place of the one of this name
  }
}

void WriteColors(const CloudColors& colors, const std::vector<int>& order, vtkPointSet* points)
{
  vtkDataArray* old = FindColors(points);
  const auto count = static_cast<vtkIdType>(order.size());
  const auto written = NewColorsLike(old, count);
  const int components = old->GetNumberOfComponents();
  if (components > ColorComponents)
  {
    written->DeepCopy(old); // its opacities
  }
  ParallelFor(0, count, [&](vtkIdType i, vtkIdType end) {
    for (; i < end; ++i)
    {
      const int next = order[static_cast<size_t>(std::min(i + ColorsAhead, count - 1))];
      SURFEL_PREFETCH(colors.data() + ColorComponents * static_cast<size_t>(next));
      const unsigned char* from = colors.data() + ColorComponents * static_cast<size_t>(order[i]);
      std::copy_n(from, ColorComponents, written->GetPointer(components * i));
    }
  });
  ReplaceColors(written, points);
}
}
