// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelMapper.h"

#include "Core/Base/LinearLight.h"
#include "Rendering/OpenGL/SurfelDots.h"
#include "Rendering/Scene/HierarchyCache.h"
#include "Rendering/Scene/SurfelBounds.h"
#include "SurfelData/SurfelCloudSource.h"

#include <vtkActor.h>
#include <vtkDataArray.h>
#include <vtkFloatArray.h>
#include <vtkHardwareSelector.h>
#include <vtkMath.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkRenderer.h>
#include <vtkSMPTools.h>
#include <vtkUnsignedCharArray.h>

#include <string>
#include <vector>

vtkStandardNewMacro(vtkSurfelMapper);

vtkSurfelMapper::vtkSurfelMapper()
  : HierarchyCache(new SurfelSplatting::HierarchyCache)
  , Dots(new SurfelSplatting::SurfelDots)
{
}

vtkSurfelMapper::~vtkSurfelMapper()
{
  this->SetPointIdArrayName(nullptr);
  this->SetCompositeIdArrayName(nullptr);
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
  vtkUnsignedCharArray* bytes = this->HasWrongScalars() ? nullptr : this->MapScalars(1.0);
  if (!bytes || bytes->GetNumberOfComponents() != 4 ||
    bytes->GetNumberOfTuples() != input->GetNumberOfPoints())
  {
    return nullptr;
  }
  if (bytes->GetMTime() > this->NaNTime)
  {
    this->NaNTime.Modified();
    this->WarnOfNaN();
  }
  return linearLight ? static_cast<vtkDataArray*>(this->GetLinearColors(bytes)) : bytes;
}

vtkDataArray* vtkSurfelMapper::GetChosenScalars(int& cellFlag)
{
  cellFlag = 0;
  return vtkDataArray::SafeDownCast(vtkAbstractMapper::GetAbstractScalars(this->GetInput(),
    this->ScalarMode, this->ArrayAccessMode, this->ArrayId, this->ArrayName, cellFlag));
}

/// Warns once of scalars that are NaN everywhere: the surfels have one colour.
void vtkSurfelMapper::WarnOfNaN()
{
  int cellFlag;
  vtkDataArray* scalars = this->GetChosenScalars(cellFlag);
  if (!this->ScalarVisibility || !scalars || this->HasWarnedOfNaN)
  {
    return;
  }
  const int components = scalars->GetNumberOfComponents();
  for (vtkIdType i = 0; i < scalars->GetNumberOfTuples() * components; ++i)
  {
    const auto component = static_cast<int>(i % components);
    if (!vtkMath::IsNan(scalars->GetComponent(i / components, component)))
    {
      return;
    }
  }
  this->HasWarnedOfNaN = true;
  vtkWarningMacro("The scalars " << (scalars->GetName() ? scalars->GetName() : "")
                                 << " are NaN everywhere: all surfels have one colour, that of "
                                    "NaN in the lookup table. Choose other scalars.");
}

/// Whether the scalars cannot colour the surfels: those that are colours as they are, with more
/// components than a colour, make VTK 9.1 crash, and of those that are too few it would read more
/// than there are. Warns once.
bool vtkSurfelMapper::HasWrongScalars()
{
  constexpr int mostComponents = 4;
  int cellFlag;
  vtkDataArray* scalars = this->GetChosenScalars(cellFlag);
  if (!this->ScalarVisibility || !scalars)
  {
    return false;
  }
  const bool areDirect = this->ColorMode == VTK_COLOR_MODE_DIRECT_SCALARS ||
    (this->ColorMode == VTK_COLOR_MODE_DEFAULT && vtkUnsignedCharArray::SafeDownCast(scalars));
  const int components = scalars->GetNumberOfComponents();
  const vtkIdType values = scalars->GetNumberOfTuples();
  const vtkIdType surfels = this->GetInput()->GetNumberOfPoints();
  const bool isLong = areDirect && components > mostComponents;
  if ((isLong || values != surfels) && !this->HasWarnedOfScalars)
  {
    this->HasWarnedOfScalars = true;
    const std::string problem = isLong
      ? std::to_string(components) + " components, a colour at most 4"
      : std::to_string(values) + " values for " + std::to_string(surfels) + " surfels";
    vtkWarningMacro("The scalars "
      << (scalars->GetName() ? scalars->GetName() : "") << " have " << problem
      << ": the surfels take the property's colour. Choose other "
         "scalars"
      << (isLong ? ", or map these: SetColorModeToMapScalars()." : "."));
  }
  return isLong || values != surfels;
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
  int cellFlag;
  vtkDataArray* scalars = this->GetChosenScalars(cellFlag);
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
  this->Dots->Render(this, this->ScalarVisibility && !this->HasWrongScalars(), renderer, actor);
}

void vtkSurfelMapper::ProcessSelectorPixelBuffers(
  vtkHardwareSelector* selector, std::vector<unsigned int>& pixeloffsets, vtkProp* prop)
{
  if (this->Dots->ProcessSelectorPixelBuffers(selector, pixeloffsets, prop))
  {
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

void vtkSurfelMapper::ShallowCopy(vtkAbstractMapper* mapper)
{
  if (vtkSurfelMapper* other = vtkSurfelMapper::SafeDownCast(mapper))
  {
    this->SetShowBacks(other->ShowBacks);
    this->SetPointIdArrayName(other->PointIdArrayName);
    this->SetCompositeIdArrayName(other->CompositeIdArrayName);
  }
  this->Superclass::ShallowCopy(mapper);
}

void vtkSurfelMapper::ReleaseGraphicsResources(vtkWindow* window)
{
  this->Dots->Release(window);
  this->Superclass::ReleaseGraphicsResources(window);
}

void vtkSurfelMapper::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Splatted: " << this->Splatted << "\n";
  os << indent << "CompositeIdArrayName: "
     << (this->CompositeIdArrayName ? this->CompositeIdArrayName : "(none)") << "\n";
  os << indent << "ShowBacks: " << this->ShowBacks << "\n"
     << indent
     << "PointIdArrayName: " << (this->PointIdArrayName ? this->PointIdArrayName : "(none)")
     << "\n";
}
