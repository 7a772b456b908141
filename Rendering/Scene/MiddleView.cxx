// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/MiddleView.h"

#include "Core/Picture/MiddleFront.h"

#include <vtkCamera.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
constexpr int MiddleViewHeight = 120;     // px
constexpr double WidestMiddleView = 16.0; // width over height
constexpr float LeastAlpha = 0.02f;       // of what is seen, as of a volume

vtkFloatArray* FloatsOf(vtkImageData* picture, const char* name)
{
  return vtkFloatArray::SafeDownCast(picture->GetPointData()->GetArray(name));
}
}

MiddleView::MiddleView(const SceneView& whole)
{
  this->Camera->DeepCopy(whole.Camera);
  this->Camera->SetWindowCenter(0.0, 0.0); // the tiles of a poster have one focus
  this->View.Camera = this->Camera;
  this->View.Lights = whole.Lights;
  this->View.Aspect = std::min(WidestMiddleView, whole.Aspect); // of strips, the middle
  this->View.Size[0] =
    std::max(1, static_cast<int>(std::lround(MiddleViewHeight * this->View.Aspect)));
  this->View.Size[1] = MiddleViewHeight;
  std::copy_n(whole.ClippingRange, 2, this->View.ClippingRange);
}

bool HaveVolume(const std::vector<SceneItem>& items)
{
  return std::any_of(items.begin(), items.end(), [](const SceneItem& item) {
    vtkPolyData* data = item.Mapper->GetInput();
    return data && data->GetPointData()->HasArray("GaussianExtinction");
  });
}

double FrontOf(vtkImageData* picture)
{
  vtkFloatArray* color = FloatsOf(picture, "Color");
  vtkFloatArray* median = FloatsOf(picture, "MedianDepth");
  vtkFloatArray* depth = median ? median : FloatsOf(picture, "Depth");
  if (!color || !depth || depth->GetNumberOfValues() == 0)
  {
    return 0.0;
  }
  const float* begin = depth->GetPointer(0);
  std::vector<float> depths(begin, begin + depth->GetNumberOfValues());
  const float* rgba = color->GetPointer(0);
  for (std::size_t i = 0; median && i < depths.size(); ++i)
  {
    depths[i] = rgba[4 * i + 3] < LeastAlpha ? 0.0f : depths[i];
  }
  int size[3] = { 0, 0, 0 };
  picture->GetDimensions(size);
  return MiddleFront(depths.data(), size[0], size[1]);
}
}
