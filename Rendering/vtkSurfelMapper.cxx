// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelMapper.h"

#include "SurfelArrays.h"

#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkMath.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkPointGaussianMapper.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkTrivialProducer.h>

#include <algorithm>
#include <cmath>

namespace Arrays = SurfelSplatting::Arrays;

vtkStandardNewMacro(vtkSurfelMapper);

vtkSurfelMapper::vtkSurfelMapper()
{
  this->Preview->EmissiveOff();
  // An opaque disc instead of a Gaussian: dots that hide what is behind them.
  this->Preview->SetSplatShaderCode("//VTK::Color::Impl\n"
                                    "if (dot(offsetVCVSOutput.xy, offsetVCVSOutput.xy) > 1.0) discard;\n");
  this->Preview->SetInputConnection(this->PreviewInput->GetOutputPort());
}

vtkSurfelMapper::~vtkSurfelMapper() = default;

int vtkSurfelMapper::CanUseTextureMapForColoring(vtkDataObject*)
{
  return 0;
}

void vtkSurfelMapper::GetOrigin(double origin[3])
{
  std::fill_n(origin, 3, 0.0);
  vtkPolyData* input = this->GetInput();
  vtkDataArray* array = input ? input->GetFieldData()->GetArray(Arrays::Origin) : nullptr;
  if (array && array->GetNumberOfValues() == 3)
  {
    for (int i = 0; i < 3; ++i)
    {
      origin[i] = array->GetVariantValue(i).ToDouble();
    }
  }
}

void vtkSurfelMapper::ComputeBounds()
{
  vtkPolyData* input = this->GetInput();
  if (!input || input->GetNumberOfPoints() == 0)
  {
    vtkMath::UninitializeBounds(this->Bounds);
    return;
  }
  if (this->BoundsTime > input->GetMTime() && this->BoundsTime > this->GetMTime())
  {
    return;
  }
  double origin[3];
  this->GetOrigin(origin);
  double largest = 0.0;
  if (vtkDataArray* covariance = input->GetPointData()->GetArray(Arrays::Covariance))
  {
    for (vtkIdType i = 0; covariance->GetNumberOfComponents() == 6 && i < covariance->GetNumberOfTuples(); ++i)
    {
      const double trace = covariance->GetComponent(i, 0) + covariance->GetComponent(i, 1) +
        covariance->GetComponent(i, 2);
      largest = std::isfinite(trace) ? std::max(largest, trace) : largest;
    }
  }
  input->GetPoints()->GetBounds(this->Bounds);
  for (int i = 0; i < 3; ++i)
  {
    this->Bounds[2 * i] += origin[i] - std::sqrt(largest);
    this->Bounds[2 * i + 1] += origin[i] + std::sqrt(largest);
  }
  this->BoundsTime.Modified();
}

void vtkSurfelMapper::UpdatePreview()
{
  vtkPolyData* input = this->GetInput();
  if (this->PreviewTime > input->GetMTime())
  {
    return;
  }
  // The inner mapper knows no local origin.
  double origin[3];
  this->GetOrigin(origin);
  vtkNew<vtkPolyData> shown;
  shown->ShallowCopy(input);
  if (vtkMath::Norm(origin) > 0.0)
  {
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    points->SetNumberOfPoints(input->GetNumberOfPoints());
    for (vtkIdType i = 0; i < input->GetNumberOfPoints(); ++i)
    {
      double p[3];
      input->GetPoint(i, p);
      points->SetPoint(i, p[0] + origin[0], p[1] + origin[1], p[2] + origin[2]);
    }
    shown->SetPoints(points);
  }
  // Dots of the mean area, wide enough to close the gaps between neighbours.
  double sum = 0.0;
  vtkDataArray* area = input->GetPointData()->GetArray(Arrays::AreaVector);
  for (vtkIdType i = 0; area && i < area->GetNumberOfTuples(); ++i)
  {
    const double length = vtkMath::Norm(area->GetTuple3(i));
    sum += std::isfinite(length) ? std::sqrt(length) : 0.0;
  }
  const vtkIdType n = input->GetNumberOfPoints();
  this->Preview->SetScaleFactor(n > 0 && sum > 0.0 ? 0.8 * sum / n : 0.0);
  this->PreviewInput->SetOutput(shown);
  this->PreviewTime.Modified();
}

void vtkSurfelMapper::RenderPiece(vtkRenderer* renderer, vtkActor* actor)
{
  if (this->Splatted)
  {
    return;
  }
  if (!this->Static)
  {
    this->GetInputAlgorithm()->Update();
  }
  vtkPolyData* input = this->GetInput();
  if (!input || input->GetNumberOfPoints() == 0)
  {
    return;
  }
  this->UpdatePreview();
  this->Preview->ShallowCopy(this); // scalars, lookup table, clipping planes
  this->Preview->SetInputConnection(this->PreviewInput->GetOutputPort());
  this->Preview->RenderPiece(renderer, actor);
}

void vtkSurfelMapper::ProcessSelectorPixelBuffers(
  vtkHardwareSelector* selector, std::vector<unsigned int>& pixeloffsets, vtkProp* prop)
{
  this->Preview->ProcessSelectorPixelBuffers(selector, pixeloffsets, prop);
}

void vtkSurfelMapper::ReleaseGraphicsResources(vtkWindow* window)
{
  this->Preview->ReleaseGraphicsResources(window);
  this->Superclass::ReleaseGraphicsResources(window);
}

void vtkSurfelMapper::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Splatted: " << this->Splatted << "\n";
}
