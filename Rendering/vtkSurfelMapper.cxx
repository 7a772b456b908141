// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelMapper.h"

#include "Core/Base/LinearLight.h"
#include "Core/Surfels/GaussianMass.h"
#include "Core/Surfels/SurfelArrays.h"
#include "Rendering/Scene/CloudAdapter.h"
#include "Rendering/Scene/HierarchyCache.h"
#include "Rendering/Scene/SurfelBounds.h"

#include <vtkActor.h>
#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkHardwareSelector.h>
#include <vtkMath.h>
#include <vtkMatrix4x4.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkPointGaussianMapper.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkSMPTools.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace Arrays = SurfelSplatting::Arrays;

vtkStandardNewMacro(vtkSurfelMapper);

vtkSurfelMapper::vtkSurfelMapper()
  : HierarchyCache(new SurfelSplatting::HierarchyCache)
{
  this->PreviewActor->SetUserMatrix(this->PreviewMatrix);
}

vtkSurfelMapper::~vtkSurfelMapper()
{
  this->SetPointIdArrayName(nullptr);
  this->SetCompositeIdArrayName(nullptr);
  this->ReleasePreview();
}

int vtkSurfelMapper::CanUseTextureMapForColoring(vtkDataObject*)
{
  return 0;
}

void vtkSurfelMapper::GetOrigin(double origin[3])
{
  SurfelSplatting::ReadOrigin(this->GetInput(), origin);
}

vtkDataArray* vtkSurfelMapper::GetFrameColors(bool linearLight)
{
  vtkPolyData* input = this->GetInput();
  if (!input || input->GetNumberOfPoints() == 0)
  {
    return nullptr;
  }
  if (vtkFloatArray* colors = this->GetDirectColors())
  {
    return colors;
  }
  vtkUnsignedCharArray* bytes = this->AreColorsTooLong() ? nullptr : this->MapScalars(1.0);
  if (!bytes || bytes->GetNumberOfComponents() != 4 ||
    bytes->GetNumberOfTuples() != input->GetNumberOfPoints())
  {
    return nullptr;
  }
  return linearLight ? static_cast<vtkDataArray*>(this->GetLinearColors(bytes)) : bytes;
}

/// Whether the scalars would be colours as they are, but have more components than a colour, with
/// which VTK 9.1 crashes. Warns once.
bool vtkSurfelMapper::AreColorsTooLong()
{
  constexpr int mostComponents = 4;
  if (!this->ScalarVisibility)
  {
    return false;
  }
  int cellFlag = 0;
  auto* scalars = vtkDataArray::SafeDownCast(vtkAbstractMapper::GetAbstractScalars(this->GetInput(),
    this->ScalarMode, this->ArrayAccessMode, this->ArrayId, this->ArrayName, cellFlag));
  const bool areDirect = this->ColorMode == VTK_COLOR_MODE_DIRECT_SCALARS ||
    (this->ColorMode == VTK_COLOR_MODE_DEFAULT && vtkUnsignedCharArray::SafeDownCast(scalars));
  const int components = scalars && areDirect ? scalars->GetNumberOfComponents() : 0;
  if (components > mostComponents && !this->HasWarnedOfColors)
  {
    this->HasWarnedOfColors = true;
    vtkWarningMacro("The scalars have "
      << components
      << " components, a colour at most 4: the "
         "surfels take the property's colour. Choose other scalars, or map these: "
         "SetColorModeToMapScalars().");
  }
  return components > mostComponents;
}

/// Point scalars of type float or double with 3 or 4 components, as linear RGBA. Null unless the
/// mapper is in direct scalar mode and has such scalars.
vtkFloatArray* vtkSurfelMapper::GetDirectColors()
{
  vtkPolyData* input = this->GetInput();
  if (!input || !this->ScalarVisibility || this->ColorMode != VTK_COLOR_MODE_DIRECT_SCALARS)
  {
    return nullptr;
  }
  int cellFlag = 0;
  auto* scalars = vtkDataArray::SafeDownCast(vtkAbstractMapper::GetAbstractScalars(
    input, this->ScalarMode, this->ArrayAccessMode, this->ArrayId, this->ArrayName, cellFlag));
  const int components = scalars && cellFlag == 0 ? scalars->GetNumberOfComponents() : 0;
  if ((components != 3 && components != 4) ||
    (scalars->GetDataType() != VTK_FLOAT && scalars->GetDataType() != VTK_DOUBLE) ||
    scalars->GetNumberOfTuples() != input->GetNumberOfPoints())
  {
    return nullptr;
  }
  if (components == 4 && scalars->GetDataType() == VTK_FLOAT)
  {
    return vtkFloatArray::SafeDownCast(scalars);
  }
  if (this->DirectColorsSource == scalars && this->DirectColorsTime > scalars->GetMTime())
  {
    return this->DirectColors;
  }
  const vtkIdType count = scalars->GetNumberOfTuples();
  this->DirectColors = vtkSmartPointer<vtkFloatArray>::New();
  this->DirectColors->SetNumberOfComponents(4);
  this->DirectColors->SetNumberOfTuples(count);
  for (int c = 0; c < components; ++c)
  {
    this->DirectColors->CopyComponent(c, scalars, c);
  }
  if (components == 3)
  {
    this->DirectColors->FillComponent(3, 1.0);
  }
  this->DirectColorsSource = scalars;
  this->DirectColorsTime.Modified();
  return this->DirectColors;
}

/// The light of byte colours, which are sRGB codes; kept until they change.
vtkFloatArray* vtkSurfelMapper::GetLinearColors(vtkUnsignedCharArray* bytes)
{
  if (this->LinearColorsSource == bytes && this->LinearColorsTime > bytes->GetMTime())
  {
    return this->LinearColors;
  }
  float light[256];
  for (int code = 0; code < 256; ++code)
  {
    light[code] = static_cast<float>(SurfelSplatting::LightOfCode(code / 255.0));
  }
  this->LinearColors = vtkSmartPointer<vtkFloatArray>::New();
  this->LinearColors->SetNumberOfComponents(4);
  this->LinearColors->SetNumberOfTuples(bytes->GetNumberOfTuples());
  const unsigned char* from = bytes->GetPointer(0);
  float* to = this->LinearColors->GetPointer(0);
  vtkSMPTools::For(0, bytes->GetNumberOfTuples(), [&](vtkIdType begin, vtkIdType end) {
    for (vtkIdType i = begin; i < end; ++i)
    {
      for (vtkIdType c = 4 * i; c < 4 * i + 3; ++c)
      {
        to[c] = light[from[c]];
      }
      to[4 * i + 3] = from[4 * i + 3] / 255.0f;
    }
  });
  this->LinearColorsSource = bytes;
  this->LinearColorsTime.Modified();
  return this->LinearColors;
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
  if (SurfelSplatting::FindSurfelBounds(input, this->Bounds))
  {
    double origin[3];
    this->GetOrigin(origin);
    for (int i = 0; i < 6; ++i)
    {
      this->Bounds[i] += origin[i / 2];
    }
  }
  else
  {
    vtkMath::UninitializeBounds(this->Bounds);
  }
  this->BoundsTime.Modified();
}

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
    const double area = SurfelSplatting::MeanKernelArea(
      SurfelSplatting::Symmetric3{ s[0], s[1], s[2], s[3], s[4], s[5] });
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
}

double vtkSurfelMapper::MeanSpacing()
{
  vtkPolyData* input = this->GetInput();
  if (this->SpacingTime > input->GetMTime() && this->SpacingTime > this->GetMTime())
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

void vtkSurfelMapper::ReleasePreview()
{
  // vtkPointGaussianMapper does not bind its OpenGL objects to their window: released while another
  // context is current, they would delete objects of that context. If their own context is gone,
  // the mapper is leaked instead.
  this->PreviewActor->SetMapper(nullptr);
  if (this->Preview && this->PreviewWindow)
  {
    this->PreviewWindow->PushContext();
    this->Preview = nullptr;
    this->PreviewWindow->PopContext();
  }
  else if (this->Preview)
  {
    this->Preview->Register(nullptr);
    this->Preview = nullptr;
  }
  this->PreviewWindow = nullptr;
}

void vtkSurfelMapper::UpdatePreview(vtkRenderer* renderer, double scale)
{
  auto* window = vtkOpenGLRenderWindow::SafeDownCast(renderer->GetRenderWindow());
  if (this->PreviewWindow != window)
  {
    this->ReleasePreview();
  }
  const bool fresh = !this->Preview;
  if (fresh)
  {
    this->PreviewWindow = window;
    this->Preview = vtkSmartPointer<vtkPointGaussianMapper>::New();
    this->Preview->EmissiveOff();
    // An opaque disc instead of a Gaussian, so that dots hide what is behind them.
    this->Preview->SetSplatShaderCode(
      "//VTK::Color::Impl\n"
      "if (dot(offsetVCVSOutput.xy, offsetVCVSOutput.xy) > 1.0) discard;\n");
    this->PreviewActor->SetMapper(this->Preview);
  }
  if (fresh || this->GetMTime() > this->PreviewTime ||
    this->GetInput()->GetMTime() > this->PreviewTime)
  {
    this->Preview->ShallowCopy(this); // input, scalars, lookup table, clipping planes
    this->MovePreview();
    // A texture of colours, for which dots have no coordinates: VTK 9.3 crashes.
    this->Preview->InterpolateScalarsBeforeMappingOff();
    this->PreviewTime.Modified();
  }
  this->Preview->SetScalarVisibility(this->ScalarVisibility && !this->AreColorsTooLong());
  // Dots of the mean area, wide enough to close the gaps between neighbours; of Gaussians, which
  // overlap, nearly as wide as their deviation. Their size is in world units, independent of the
  // actor's matrix.
  this->Preview->SetScaleFactor(0.8 * this->MeanSpacing() * scale);
}

/// Points far from the origin, in double precision, would lose theirs in vertex buffers: dots are
/// drawn of copies about the cloud's centre.
void vtkSurfelMapper::MovePreview()
{
  vtkPolyData* input = this->GetInput();
  std::fill_n(this->PreviewOrigin, 3, 0.0);
  if (input->GetPoints()->GetDataType() != VTK_DOUBLE)
  {
    return;
  }
  double origin[3];
  this->GetOrigin(origin);
  this->GetCenter(this->PreviewOrigin); // without invalid points
  vtkMath::Subtract(this->PreviewOrigin, origin, this->PreviewOrigin);
  const vtkIdType count = input->GetNumberOfPoints();
  vtkNew<vtkPoints> near;
  near->SetNumberOfPoints(count);
  for (vtkIdType i = 0; i < count; ++i)
  {
    double p[3];
    input->GetPoint(i, p);
    vtkMath::Subtract(p, this->PreviewOrigin, p);
    near->SetPoint(i, p);
  }
  vtkNew<vtkPolyData> moved;
  moved->ShallowCopy(input);
  moved->SetPoints(near);
  this->Preview->SetInputData(moved);
}

/// A picture of dots, unlike a selection, is hardly what was meant.
void vtkSurfelMapper::WarnOfDots(vtkRenderer* renderer)
{
  if (!this->HasWarnedOfDots && !renderer->GetPass() && !renderer->GetSelector())
  {
    this->HasWarnedOfDots = true;
    vtkWarningMacro("The surfels are drawn as dots, since their renderer has no pass that splats "
                    "them: call SetPass() of the vtkRenderer with a vtkSurfelSplattingPass.");
  }
}

void vtkSurfelMapper::RenderPiece(vtkRenderer* renderer, vtkActor* actor)
{
  if (this->Splatted)
  {
    return;
  }
  if (!this->Static && this->GetInputAlgorithm())
  {
    this->GetInputAlgorithm()->Update();
  }
  vtkPolyData* input = this->GetInput();
  if (!input || input->GetNumberOfPoints() == 0)
  {
    return;
  }
  this->WarnOfDots(renderer);
  vtkNew<vtkMatrix4x4> matrix;
  actor->GetMatrix(matrix);
  this->UpdatePreview(renderer, std::cbrt(std::abs(matrix->Determinant())));
  // The origins go into the matrix, in double precision. Adding them to the points would lose
  // detail in the single precision of vertex buffers.
  double origin[3];
  this->GetOrigin(origin);
  vtkMath::Add(origin, this->PreviewOrigin, origin);
  double moved[4] = { origin[0], origin[1], origin[2], 1.0 };
  matrix->MultiplyPoint(moved, moved);
  for (int i = 0; i < 3; ++i)
  {
    matrix->SetElement(i, 3, moved[i]);
  }
  if (!std::equal(matrix->GetData(), matrix->GetData() + 16, this->PreviewMatrix->GetData()))
  {
    this->PreviewMatrix->DeepCopy(matrix);
  }
  this->PreviewActor->SetProperty(actor->GetProperty());
  this->PreviewActor->SetPropertyKeys(actor->GetPropertyKeys());
  this->Preview->Render(renderer, this->PreviewActor);
}

void vtkSurfelMapper::ProcessSelectorPixelBuffers(
  vtkHardwareSelector* selector, std::vector<unsigned int>& pixeloffsets, vtkProp* prop)
{
  if (this->Preview)
  {
    this->Preview->ProcessSelectorPixelBuffers(selector, pixeloffsets, prop);
    this->RenamePoints(selector, pixeloffsets);
  }
}

/// Replaces the ids of the input's points, or the index of a block, by those of an array, in the
/// pixels of a selection. In a cloud of vertices each cell is a point.
void vtkSurfelMapper::RenamePoints(
  vtkHardwareSelector* selector, const std::vector<unsigned int>& pixeloffsets)
{
  const int pass = selector->GetCurrentPass();
  const bool isIndex = pass == vtkHardwareSelector::COMPOSITE_INDEX_PASS;
  const char* array = isIndex ? this->CompositeIdArrayName : this->PointIdArrayName;
  vtkDataArray* ids =
    array && this->GetInput() ? this->GetInput()->GetPointData()->GetArray(array) : nullptr;
  int lowPass = -1;
  for (const int low : { vtkHardwareSelector::CELL_ID_LOW24, vtkHardwareSelector::POINT_ID_LOW24 })
  {
    const bool isRead =
      isIndex ? selector->GetRawPixelBuffer(low) != nullptr : pass == low || pass == low + 1;
    lowPass = isRead ? low : lowPass;
  }
  if (!ids || lowPass < 0)
  {
    return;
  }
  // Each pass holds three bytes of an id. There is no high pass if all ids are small.
  const unsigned char* low = selector->GetRawPixelBuffer(lowPass);
  const unsigned char* high = selector->GetRawPixelBuffer(lowPass + 1);
  unsigned char* to = selector->GetPixelBuffer(pass);
  for (const unsigned int at : pixeloffsets)
  {
    vtkIdType id = 0;
    for (int byte = 0; byte < 3; ++byte)
    {
      id |= low ? static_cast<vtkIdType>(low[at + byte]) << (8 * byte) : 0;
      id |= high ? static_cast<vtkIdType>(high[at + byte]) << (24 + 8 * byte) : 0;
    }
    if (id >= ids->GetNumberOfTuples())
    {
      continue;
    }
    const auto name =
      static_cast<vtkIdType>(ids->GetComponent(id, 0)) >> (pass == lowPass + 1 ? 24 : 0);
    for (int byte = 0; byte < 3; ++byte)
    {
      to[at + byte] = static_cast<unsigned char>(name >> (8 * byte));
    }
  }
}

void vtkSurfelMapper::ReleaseGraphicsResources(vtkWindow* window)
{
  this->ReleasePreview();
  this->Superclass::ReleaseGraphicsResources(window);
}

void vtkSurfelMapper::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Splatted: " << this->Splatted << "\n";
  os << indent << "CompositeIdArrayName: "
     << (this->CompositeIdArrayName ? this->CompositeIdArrayName : "(none)") << "\n";
  os << indent
     << "PointIdArrayName: " << (this->PointIdArrayName ? this->PointIdArrayName : "(none)")
     << "\n";
}
