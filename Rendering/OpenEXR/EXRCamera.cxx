// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenEXR/EXRCamera.h"

#include "Core/Surfels/SurfelArrays.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"

#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfStandardAttributes.h>

#include <cmath>
#include <vector>

namespace SurfelSplatting
{
namespace
{
// The standard attribute is in floats, which resolve half a unit at UTM coordinates.
constexpr const char* ExactWorldToCamera = "worldToCameraDouble";
constexpr const char* FocalLength = "focalLengthPixels";
constexpr const char* LensDiameter = "lensDiameter";

/// The values of a field data array; empty if there is no array with that many values.
std::vector<double> Values(vtkImageData* image, const char* name, int size)
{
  vtkDataArray* array = image->GetFieldData()->GetArray(name);
  std::vector<double> values;
  for (int i = 0; array && array->GetNumberOfValues() == size && i < size; ++i)
  {
    values.push_back(array->GetVariantValue(i).ToDouble());
  }
  return values;
}

void AddValues(vtkFieldData* data, const char* name, const std::vector<double>& values)
{
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(static_cast<int>(values.size()));
  array->InsertNextTuple(values.data());
  data->AddArray(array);
}

bool HasNoScreenWindow(const Imf::Header& header)
{
  return header.screenWindowCenter() == Imath::V2f(0.0f, 0.0f) &&
    header.screenWindowWidth() == 1.0f;
}

void AddScreenWindow(
  const std::vector<double>& window, double pixelAspectRatio, Imf::Header& header)
{
  header.screenWindowCenter() =
    Imath::V2f(static_cast<float>(window[0]), static_cast<float>(window[1]));
  header.screenWindowWidth() = static_cast<float>(window[2]);
  header.pixelAspectRatio() = static_cast<float>(pixelAspectRatio);
  if (HasNoScreenWindow(header))
  {
    header.screenWindowWidth() = std::nextafter(1.0f, 2.0f);
  }
}

void ReadWorldToCamera(const Imf::Header& header, vtkFieldData* data)
{
  Imath::M44d transposed(Imf::worldToCamera(header));
  const auto* exact = header.findTypedAttribute<Imf::M44dAttribute>(ExactWorldToCamera);
  if (exact && Imath::M44f(exact->value()) == Imf::worldToCamera(header))
  {
    transposed = exact->value();
  }
  std::vector<double> matrix(16);
  for (int i = 0; i < 16; ++i)
  {
    matrix[i] = transposed[i % 4][i / 4];
  }
  if (vtkMatrix4x4::Determinant(matrix.data()) < 0.0)
  {
    // A left-handed camera, as in OpenEXR and others, looks along +z.
    for (int i = 8; i < 12; ++i)
    {
      matrix[i] = -matrix[i];
    }
  }
  AddValues(data, Arrays::WorldToCamera, matrix);
}

/// OpenEXR's screen window belongs to the display window, ours to the data window.
void ReadScreenWindow(const Imf::Header& header, vtkFieldData* data)
{
  const Imath::Box2i &pixels = header.dataWindow(), &display = header.displayWindow();
  const double pixelWidth =
    header.screenWindowWidth() / (double(display.max.x) - display.min.x + 1.0);
  const double pixelHeight = pixelWidth / header.pixelAspectRatio();
  const auto shift = [&](int i) {
    return 0.5 *
      (double(pixels.min[i]) + pixels.max[i] - (double(display.min[i]) + display.max[i]));
  };
  AddValues(data, Arrays::ScreenWindow,
    { header.screenWindowCenter().x + shift(0) * pixelWidth,
      header.screenWindowCenter().y - shift(1) * pixelHeight,
      pixelWidth * (double(pixels.max.x) - pixels.min.x + 1.0) });
}
}

void WriteCamera(vtkImageData* image, Imf::Header& header)
{
  const std::vector<double> matrix = Values(image, Arrays::WorldToCamera, 16);
  if (!matrix.empty())
  {
    // OpenEXR multiplies row vectors.
    Imath::M44d transposed;
    for (int i = 0; i < 16; ++i)
    {
      transposed[i % 4][i / 4] = matrix[i];
    }
    Imf::addWorldToCamera(header, Imath::M44f(transposed));
    header.insert(ExactWorldToCamera, Imf::M44dAttribute(transposed));
  }
  const std::vector<double> lens = Values(image, Arrays::CameraLens, 3);
  if (!lens.empty())
  {
    header.insert(FocalLength, Imf::FloatAttribute(static_cast<float>(lens[0])));
    header.insert(LensDiameter, Imf::FloatAttribute(static_cast<float>(lens[1])));
    Imf::addFocus(header, static_cast<float>(lens[2]));
  }
  const std::vector<double> window = Values(image, Arrays::ScreenWindow, 3);
  if (!window.empty())
  {
    AddScreenWindow(
      window, lens.empty() ? 1.0 : lens[0] * window[2] / image->GetDimensions()[0], header);
  }
}

void ReadCamera(const Imf::Header& header, vtkFieldData* data)
{
  if (Imf::hasWorldToCamera(header))
  {
    ReadWorldToCamera(header, data);
  }
  const auto* length = header.findTypedAttribute<Imf::FloatAttribute>(FocalLength);
  const auto* diameter = header.findTypedAttribute<Imf::FloatAttribute>(LensDiameter);
  if (length && diameter && Imf::hasFocus(header))
  {
    AddValues(data, Arrays::CameraLens, { length->value(), diameter->value(), Imf::focus(header) });
  }
  if (!HasNoScreenWindow(header))
  {
    ReadScreenWindow(header, data);
  }
}
}
