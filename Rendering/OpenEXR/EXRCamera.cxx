// SPDX-License-Identifier: BSD-3-Clause
#include "EXRCamera.h"

#include "SurfelArrays.h"
#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"

#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfStandardAttributes.h>

namespace SurfelSplatting
{
void AddCamera(vtkImageData* image, Imf::Header& header)
{
  vtkDataArray* matrix = image->GetFieldData()->GetArray(Arrays::WorldToCamera);
  if (matrix && matrix->GetNumberOfValues() == 16)
  {
    // OpenEXR's vectors are rows.
    Imath::M44f transposed;
    for (int i = 0; i < 16; ++i)
    {
      transposed[i % 4][i / 4] = static_cast<float>(matrix->GetVariantValue(i).ToDouble());
    }
    Imf::addWorldToCamera(header, transposed);
  }
  vtkDataArray* lens = image->GetFieldData()->GetArray(Arrays::CameraLens);
  if (lens && lens->GetNumberOfValues() == 3)
  {
    const auto value = [lens](
                         int i) { return static_cast<float>(lens->GetVariantValue(i).ToDouble()); };
    header.insert("focalLengthPixels", Imf::FloatAttribute(value(0)));
    header.insert("lensDiameter", Imf::FloatAttribute(value(1)));
    Imf::addFocus(header, value(2));
  }
}
}
