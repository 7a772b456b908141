// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenGL/SurfelDots.h"

#include "Core/Surfels/GaussianMass.h"
#include "Core/Surfels/SurfelArrays.h"
#include "SurfelData/SurfelCloudSource.h"

#include <vtkActor.h>
#include <vtkDataArray.h>
#include <vtkMath.h>
#include <vtkMatrix4x4.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkPointData.h>
#include <vtkPointGaussianMapper.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace SurfelSplatting
{
namespace
{
/// Mean over surfels of the root of their area, world units; 0 if none is finite.
double MeanRootOfAreas(vtkDataArray* areas)
{
  double sum = 0.0;
  vtkIdType count = 0;
  for (vtkIdType i = 0; i < areas->GetNumberOfTuples(); ++i)
  {
    double a[3];
    areas->GetTuple(i, a);
    const double length = vtkMath::Norm(a);
    if (std::isfinite(length))
    {
      sum += std::sqrt(length);
      ++count;
    }
  }
  return count > 0 ? sum / count : 0.0;
}

/// Median standard deviation of Gaussians as seen from all sides, world units; 0 if none is finite.
/// The mean would be that of a few stray ones, which are huge.
double MedianDeviation(vtkDataArray* covariances)
{
  std::vector<double> deviations;
  for (vtkIdType i = 0; i < covariances->GetNumberOfTuples(); ++i)
  {
    double s[6];
    covariances->GetTuple(i, s);
    const double area = MeanKernelArea(Symmetric3{ s[0], s[1], s[2], s[3], s[4], s[5] });
    if (std::isfinite(area))
    {
      deviations.push_back(std::sqrt(area));
    }
  }
  if (deviations.empty())
  {
    return 0.0;
  }
  const auto middle = deviations.begin() + static_cast<std::ptrdiff_t>(deviations.size() / 2);
  std::nth_element(deviations.begin(), middle, deviations.end());
  return *middle;
}

/// Points about a centre.
vtkSmartPointer<vtkPoints> PointsAbout(const double (&center)[3], vtkPoints* points)
{
  const vtkIdType count = points->GetNumberOfPoints();
  auto near = vtkSmartPointer<vtkPoints>::New();
  near->SetNumberOfPoints(count);
  for (vtkIdType i = 0; i < count; ++i)
  {
    double p[3];
    points->GetPoint(i, p);
    vtkMath::Subtract(p, center, p);
    near->SetPoint(i, p);
  }
  return near;
}
}

SurfelDots::SurfelDots()
{
  this->Actor->SetUserMatrix(this->Matrix);
}

SurfelDots::~SurfelDots()
{
  this->Release();
}

void SurfelDots::Release(vtkWindow* releasing)
{
  // vtkPointGaussianMapper does not bind its OpenGL objects to their window: released while another
  // context is current, they would delete objects of that context. If their own context is gone,
  // the mapper is leaked instead, without its input. A window that is being deleted has its context
  // still, but weak pointers to it are null.
  this->Actor->SetMapper(nullptr);
  if (this->Mapper && this->Window)
  {
    this->Window->PushContext();
    this->Mapper = nullptr;
    this->Window->PopContext();
  }
  else if (this->Mapper && (!releasing || releasing != this->Owner))
  {
    this->Mapper->RemoveAllInputs();
    this->Mapper->Register(nullptr);
  }
  this->Mapper = nullptr;
  this->Window = nullptr;
  this->Owner = nullptr;
}

void SurfelDots::Update(
  vtkPolyDataMapper* mapper, bool isColored, vtkRenderer* renderer, double scale)
{
  auto* window = vtkOpenGLRenderWindow::SafeDownCast(renderer->GetRenderWindow());
  if (this->Window != window)
  {
    this->Release();
  }
  const bool fresh = !this->Mapper;
  if (fresh)
  {
    this->Window = window;
    this->Owner = window;
    this->Mapper = vtkSmartPointer<vtkPointGaussianMapper>::New();
    this->Mapper->EmissiveOff();
    // An opaque disc instead of a Gaussian, so that dots hide what is behind them.
    this->Mapper->SetSplatShaderCode(
      "//VTK::Color::Impl\n"
      "if (dot(offsetVCVSOutput.xy, offsetVCVSOutput.xy) > 1.0) discard;\n");
    this->Actor->SetMapper(this->Mapper);
  }
  if (fresh || mapper->GetMTime() > this->Time || mapper->GetInput()->GetMTime() > this->Time)
  {
    this->Mapper->ShallowCopy(mapper); // input, scalars, lookup table, clipping planes
    this->CopyInput(mapper);
    // A texture of colours, for which dots have no coordinates: VTK 9.3 crashes.
    this->Mapper->InterpolateScalarsBeforeMappingOff();
    this->Time.Modified();
  }
  this->Mapper->SetScalarVisibility(isColored);
  // Dots of the mean area, wide enough to close the gaps between neighbours; of Gaussians, which
  // overlap, nearly as wide as their deviation. Their size is in world units, independent of the
  // actor's matrix.
  this->Mapper->SetScaleFactor(0.8 * this->MeanSpacing(mapper) * scale);
}

/// Gives the dots a copy of a mapper's input. A pipeline that both shared would stay in memory
/// where VTK's garbage collector frees the mapper. Points in double precision, maybe far from the
/// origin, would lose it in vertex buffers: the copy has them about the cloud's centre.
void SurfelDots::CopyInput(vtkPolyDataMapper* mapper)
{
  vtkPolyData* input = mapper->GetInput();
  vtkNew<vtkPolyData> copy;
  copy->ShallowCopy(input);
  std::fill_n(this->Origin, 3, 0.0);
  if (input->GetPoints()->GetDataType() == VTK_DOUBLE)
  {
    double origin[3];
    ReadOrigin(input, origin);
    mapper->GetCenter(this->Origin); // without invalid points
    vtkMath::Subtract(this->Origin, origin, this->Origin);
    copy->SetPoints(PointsAbout(this->Origin, input->GetPoints()));
  }
  this->Mapper->SetInputData(copy);
}

/// World units; kept until the input changes.
double SurfelDots::MeanSpacing(vtkPolyDataMapper* mapper)
{
  vtkPolyData* input = mapper->GetInput();
  if (this->SpacingTime > input->GetMTime() && this->SpacingTime > mapper->GetMTime())
  {
    return this->Spacing;
  }
  vtkDataArray* gaussians = input->GetPointData()->GetArray(Arrays::GaussianCovariance);
  vtkDataArray* areas = input->GetPointData()->GetArray(Arrays::AreaVector);
  this->Spacing = 0.0;
  if (gaussians && gaussians->GetNumberOfComponents() == 6)
  {
    this->Spacing = MedianDeviation(gaussians);
  }
  else if (areas && areas->GetNumberOfComponents() == 3)
  {
    this->Spacing = MeanRootOfAreas(areas);
  }
  this->SpacingTime.Modified();
  return this->Spacing;
}

void SurfelDots::Render(
  vtkPolyDataMapper* mapper, bool isColored, vtkRenderer* renderer, vtkActor* actor)
{
  vtkNew<vtkMatrix4x4> matrix;
  actor->GetMatrix(matrix);
  this->Update(mapper, isColored, renderer, std::cbrt(std::abs(matrix->Determinant())));
  // The origins go into the matrix, in double precision. Adding them to the points would lose
  // detail in the single precision of vertex buffers.
  double origin[3];
  ReadOrigin(mapper->GetInput(), origin);
  vtkMath::Add(origin, this->Origin, origin);
  double moved[4] = { origin[0], origin[1], origin[2], 1.0 };
  matrix->MultiplyPoint(moved, moved);
  for (int i = 0; i < 3; ++i)
  {
    matrix->SetElement(i, 3, moved[i]);
  }
  if (!std::equal(matrix->GetData(), matrix->GetData() + 16, this->Matrix->GetData()))
  {
    this->Matrix->DeepCopy(matrix);
  }
  this->Actor->SetProperty(actor->GetProperty());
  this->Actor->SetPropertyKeys(actor->GetPropertyKeys());
  this->Mapper->Render(renderer, this->Actor);
}

bool SurfelDots::ProcessSelectorPixelBuffers(
  vtkHardwareSelector* selector, std::vector<unsigned int>& pixeloffsets, vtkProp* prop)
{
  if (!this->Mapper)
  {
    return false;
  }
  this->Mapper->ProcessSelectorPixelBuffers(selector, pixeloffsets, prop);
  return true;
}
}
