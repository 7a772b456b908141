// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Readers/Points/PointCloudFields.h"

#include "Filters/Common/ParallelFor.h"

#include "vtkCellArray.h"
#include "vtkDataArray.h"
#include "vtkFloatArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkTypeInt32Array.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace PointCloud
{
namespace
{
using SurfelGeometry::RawVector;
using Triple = std::array<const Field*, 3>;

vtkIdType Count(const FieldCloud& cloud)
{
  return static_cast<vtkIdType>(cloud.Width) * cloud.Height;
}

// @param name in lower case; programs write X, Red and R as well
const Field* Find(const FieldCloud& cloud, const std::string& name)
{
  const auto isSame = [](
                        char a, char b) { return (a >= 'A' && a <= 'Z' ? a - 'A' + 'a' : a) == b; };
  const auto found =
    std::find_if(cloud.Fields.begin(), cloud.Fields.end(), [&](const Field& field) {
      return field.Count > 0 &&
        std::equal(field.Name.begin(), field.Name.end(), name.begin(), name.end(), isSame);
    });
  return found == cloud.Fields.end() ? nullptr : &*found;
}

// Finds all three fields, or returns three null pointers.
Triple FindTriple(const FieldCloud& cloud, const std::array<const char*, 3>& names)
{
  Triple triple = { Find(cloud, names[0]), Find(cloud, names[1]), Find(cloud, names[2]) };
  return triple[0] && triple[1] && triple[2] ? triple : Triple{};
}

int VTKType(const Field& field)
{
  switch (field.Type)
  {
    case Field::INT8:
      return VTK_SIGNED_CHAR;
    case Field::BOOL:
    case Field::UINT8:
      return VTK_UNSIGNED_CHAR;
    case Field::INT16:
      return VTK_SHORT;
    case Field::UINT16:
      return VTK_UNSIGNED_SHORT;
    case Field::INT32:
      return VTK_INT;
    case Field::UINT32:
      return VTK_UNSIGNED_INT;
    case Field::INT64:
      return VTK_LONG_LONG;
    case Field::UINT64:
      return VTK_UNSIGNED_LONG_LONG;
    case Field::FLOAT32:
      return VTK_FLOAT;
    case Field::FLOAT64:
      return VTK_DOUBLE;
    default:
      throw std::runtime_error("the field " + field.Name + " has an unknown type.");
  }
}

// Converts a value of each point, `step` bytes apart, to those that are `stride` values apart.
template <typename In, typename Out>
void ConvertValues(
  const std::uint8_t* from, std::size_t step, vtkIdType points, Out* to, int stride)
{
  for (vtkIdType i = 0; i < points; ++i, from += step, to += stride)
  {
    In value;
    std::memcpy(&value, from, sizeof(In));
    *to = static_cast<Out>(value);
  }
}

// Copies one component from a field of any type.
template <typename Out>
void CopyComponent(const FieldCloud& cloud, const Field& field, Out* to, int stride)
{
  void (*convert)(const std::uint8_t*, std::size_t, vtkIdType, Out*, int) = nullptr;
  switch (VTKType(field))
  {
    vtkTemplateMacro((convert = ConvertValues<VTK_TT, Out>));
  }
  SurfelGeometry::ParallelFor(0, Count(cloud), [&](vtkIdType begin, vtkIdType end) {
    const std::uint8_t* from = cloud.Data.data() + field.Offset + begin * cloud.PointStep;
    convert(from, cloud.PointStep, end - begin, to + begin * stride, stride);
  });
}

// Copies the first `count` values of each point, bit by bit.
template <typename Value>
void CopyValues(const FieldCloud& cloud, const Field& field, int count, void* to)
{
  SurfelGeometry::ParallelFor(0, Count(cloud), [&](vtkIdType point, vtkIdType end) {
    const std::uint8_t* from = cloud.Data.data() + field.Offset + point * cloud.PointStep;
    Value* out = static_cast<Value*>(to) + point * count;
    for (; point < end; ++point, from += cloud.PointStep, out += count)
    {
      for (int i = 0; i < count; ++i)
      {
        std::memcpy(out + i, from + i * sizeof(Value), sizeof(Value));
      }
    }
  });
}

// Copies a field to an array of its own type; only the size of the values matters.
void CopyField(const FieldCloud& cloud, const Field& field, void* to)
{
  const int count = static_cast<int>(field.Count);
  switch (SizeOf(field.Type))
  {
    case 1:
      return CopyValues<std::uint8_t>(cloud, field, count, to);
    case 2:
      return CopyValues<std::uint16_t>(cloud, field, count, to);
    case 4:
      return CopyValues<std::uint32_t>(cloud, field, count, to);
    default:
      return CopyValues<std::uint64_t>(cloud, field, count, to);
  }
}

vtkSmartPointer<vtkPoints> DecodePoints(const FieldCloud& cloud, const Triple& xyz)
{
  // A float does not hold every whole number of four bytes either.
  const bool isDouble = std::any_of(xyz.begin(), xyz.end(), [](const Field* field) {
    return SizeOf(field->Type) > 4 || (SizeOf(field->Type) == 4 && field->Type != Field::FLOAT32);
  });
  auto points = vtkSmartPointer<vtkPoints>::New();
  points->SetDataType(isDouble ? VTK_DOUBLE : VTK_FLOAT);
  points->SetNumberOfPoints(Count(cloud));
  for (int i = 0; i < 3 && Count(cloud) > 0; ++i)
  {
    if (isDouble)
    {
      CopyComponent(
        cloud, *xyz[i], static_cast<double*>(points->GetData()->GetVoidPointer(0)) + i, 3);
    }
    else
    {
      CopyComponent(
        cloud, *xyz[i], static_cast<float*>(points->GetData()->GetVoidPointer(0)) + i, 3);
    }
  }
  return points;
}

vtkSmartPointer<vtkDataArray> DecodeNormals(const FieldCloud& cloud, const Triple& normal)
{
  auto normals = vtkSmartPointer<vtkFloatArray>::New();
  normals->SetName("Normals");
  normals->SetNumberOfComponents(3);
  normals->SetNumberOfTuples(Count(cloud));
  for (int i = 0; i < 3 && Count(cloud) > 0; ++i)
  {
    CopyComponent(cloud, *normal[i], normals->GetPointer(i), 3);
  }
  return normals;
}

// PCL packs a colour into four bytes, 0xAARRGGBB, under a float or an integer type.
RawVector<std::uint32_t> DecodePackedColors(const FieldCloud& cloud, const Field& field)
{
  RawVector<std::uint32_t> packed(Count(cloud));
  CopyValues<std::uint32_t>(cloud, field, 1, packed.data());
  return packed;
}

// Colours above this have 16 bits; resampled bytes overshoot by less.
constexpr float MostOfBytes = 511.f;

// The factor from a colour channel to bytes: 255 for real numbers up to 1, 1/257 for 16 bits,
// else 1. No scan is as dark as 1 of 255, so values tell more than types, which may be wider.
float ScaleToBytes(int type, const std::vector<float>& values)
{
  const bool isReal = type == VTK_FLOAT || type == VTK_DOUBLE;
  const auto larger = [](float largest, float value) {
    return std::isfinite(value) ? std::max(largest, value) : largest;
  };
  const float largest = std::accumulate(values.begin(), values.end(), 0.f, larger);
  return isReal && largest <= 1.f ? 255.f : largest > MostOfBytes ? 1 / 257.f : 1.f;
}

// Channels of colours, each in a field of its own, as bytes plus 0.5; all have one scale.
std::vector<float> DecodeChannels(const FieldCloud& cloud, const Field* const* fields, int count)
{
  std::vector<float> values(count * Count(cloud));
  for (int i = 0; i < count && Count(cloud) > 0; ++i)
  {
    CopyComponent(cloud, *fields[i], values.data() + i, count);
  }
  const float scale = ScaleToBytes(VTKType(*fields[0]), values);
  // The order of the arguments maps NaN to 0.
  std::transform(values.begin(), values.end(), values.begin(),
    [=](float value) { return std::min(255.f, std::max(0.f, value * scale)) + 0.5f; });
  return values;
}

// Colours that are bytes already.
RawVector<std::uint32_t> PackBytes(const FieldCloud& cloud, const Triple& rgb, const Field* alpha)
{
  RawVector<std::uint32_t> packed(Count(cloud));
  SurfelGeometry::ParallelFor(0, Count(cloud), [&](vtkIdType i, vtkIdType end) {
    for (; i < end; ++i)
    {
      const std::uint8_t* point = cloud.Data.data() + i * cloud.PointStep;
      const std::uint32_t a = alpha ? point[alpha->Offset] : 255;
      packed[i] = a << 24 | static_cast<std::uint32_t>(point[rgb[0]->Offset]) << 16 |
        static_cast<std::uint32_t>(point[rgb[1]->Offset]) << 8 | point[rgb[2]->Offset];
    }
  });
  return packed;
}

// Colours in three fields, which have one scale, and alpha in a fourth if it is not null.
RawVector<std::uint32_t> DecodeSeparateColors(
  const FieldCloud& cloud, const Triple& rgb, const Field* alpha)
{
  const auto isByte = [](const Field* field) { return !field || field->Type == Field::UINT8; };
  if (std::all_of(rgb.begin(), rgb.end(), isByte) && isByte(alpha))
  {
    return PackBytes(cloud, rgb, alpha);
  }
  const std::vector<float> colors = DecodeChannels(cloud, rgb.data(), 3);
  const std::vector<float> alphas =
    alpha ? DecodeChannels(cloud, &alpha, 1) : std::vector<float>(Count(cloud), 255.f);
  RawVector<std::uint32_t> packed(Count(cloud));
  for (std::size_t i = 0; i < packed.size(); ++i)
  {
    packed[i] = static_cast<std::uint32_t>(alphas[i]) << 24 |
      static_cast<std::uint32_t>(colors[3 * i]) << 16 |
      static_cast<std::uint32_t>(colors[3 * i + 1]) << 8 |
      static_cast<std::uint32_t>(colors[3 * i + 2]);
  }
  return packed;
}

vtkSmartPointer<vtkDataArray> UnpackColors(
  const RawVector<std::uint32_t>& packed, bool mayHaveAlpha)
{
  const auto alphaIs = [&](std::uint32_t alpha) {
    return std::all_of(
      packed.begin(), packed.end(), [=](std::uint32_t color) { return color >> 24 == alpha; });
  };
  const bool hasAlpha = mayHaveAlpha && !alphaIs(0) && !alphaIs(255);

  auto colors = vtkSmartPointer<vtkUnsignedCharArray>::New();
  colors->SetName(hasAlpha ? "RGBA" : "RGB");
  colors->SetNumberOfComponents(hasAlpha ? 4 : 3);
  colors->SetNumberOfTuples(static_cast<vtkIdType>(packed.size()));
  const int components = hasAlpha ? 4 : 3;
  SurfelGeometry::ParallelFor(
    0, static_cast<vtkIdType>(packed.size()), [&](vtkIdType i, vtkIdType end) {
      unsigned char* to = colors->GetPointer(components * i);
      for (; i < end; ++i, to += components)
      {
        to[0] = static_cast<unsigned char>(packed[i] >> 16);
        to[1] = static_cast<unsigned char>(packed[i] >> 8);
        to[2] = static_cast<unsigned char>(packed[i]);
        if (hasAlpha)
        {
          to[3] = static_cast<unsigned char>(packed[i] >> 24);
        }
      }
    });
  return colors;
}

vtkSmartPointer<vtkDataArray> DecodeOther(const FieldCloud& cloud, const Field& field)
{
  const int components = static_cast<int>(field.Count);
  auto array = vtk::TakeSmartPointer(vtkDataArray::CreateDataArray(VTKType(field)));
  array->SetName(field.Name.c_str());
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(Count(cloud));
  if (Count(cloud) > 0)
  {
    CopyField(cloud, field, array->GetVoidPointer(0));
  }
  return array;
}

// Programs that have no colours leave zeros in them, which are none.
void SetColors(const RawVector<std::uint32_t>& packed, bool mayHaveAlpha, vtkPointData* data)
{
  const auto isBlack = [](std::uint32_t color) { return (color & 0xFFFFFF) == 0; };
  if (packed.empty() || !std::all_of(packed.begin(), packed.end(), isBlack))
  {
    data->SetScalars(UnpackColors(packed, mayHaveAlpha));
  }
}

// Every field must lie inside its point, or the copies above would read past the data.
void CheckFields(const FieldCloud& cloud)
{
  for (const Field& field : cloud.Fields)
  {
    const std::uint64_t end = field.Offset + std::uint64_t(field.Count) * SizeOf(field.Type);
    if (end > cloud.PointStep)
    {
      throw std::runtime_error("the field " + field.Name + " extends past the end of its point.");
    }
  }
}

void AddColors(const FieldCloud& cloud, vtkPointData* data, std::set<const Field*>& used)
{
  const Field* packed = Find(cloud, "rgba") ? Find(cloud, "rgba") : Find(cloud, "rgb");
  Triple separate = FindTriple(cloud, { "red", "green", "blue" });
  for (const auto& names : { std::array<const char*, 3>{ "r", "g", "b" },
         std::array<const char*, 3>{ "diffuse_red", "diffuse_green", "diffuse_blue" } })
  {
    separate = separate[0] ? separate : FindTriple(cloud, names);
  }
  if (packed && SizeOf(packed->Type) == 4)
  {
    SetColors(DecodePackedColors(cloud, *packed), packed == Find(cloud, "rgba"), data);
    used.insert(packed);
  }
  else if (separate[0])
  {
    const Field* alpha = Find(cloud, "alpha");
    SetColors(DecodeSeparateColors(cloud, separate, alpha), alpha != nullptr, data);
    used.insert(separate.begin(), separate.end());
    used.insert(alpha);
  }
}

void AddNormals(const FieldCloud& cloud, vtkPointData* data, std::set<const Field*>& used)
{
  Triple normal = FindTriple(cloud, { "normal_x", "normal_y", "normal_z" });
  if (!normal[0])
  {
    normal = FindTriple(cloud, { "nx", "ny", "nz" });
  }
  if (normal[0])
  {
    data->SetNormals(DecodeNormals(cloud, normal));
    used.insert(normal.begin(), normal.end());
  }
}
}

vtkSmartPointer<vtkCellArray> MakeVertices(int count)
{
  vtkNew<vtkTypeInt32Array> offsets, connectivity;
  offsets->InsertNextValue(0);
  offsets->InsertNextValue(count);
  connectivity->SetNumberOfValues(count);
  int* ids = connectivity->GetPointer(0);
  SurfelGeometry::ParallelFor(0, count,
    [ids](vtkIdType i, vtkIdType end) { std::iota(ids + i, ids + end, static_cast<int>(i)); });
  auto vertices = vtkSmartPointer<vtkCellArray>::New();
  vertices->SetData(offsets, connectivity);
  return vertices;
}

void DecodeFields(const FieldCloud& cloud, vtkPolyData* output)
{
  CheckFields(cloud);
  const Triple xyz = FindTriple(cloud, { "x", "y", "z" });
  if (!xyz[0])
  {
    throw std::runtime_error("not a point cloud: it needs the fields x, y and z.");
  }
  output->SetPoints(DecodePoints(cloud, xyz));

  std::set<const Field*> used(xyz.begin(), xyz.end());
  AddColors(cloud, output->GetPointData(), used);
  AddNormals(cloud, output->GetPointData(), used);
  for (const Field& field : cloud.Fields)
  {
    if (!used.count(&field) && field.Name != "_" && field.Count > 0) // "_" pads
    {
      output->GetPointData()->AddArray(DecodeOther(cloud, field));
    }
  }

  if (cloud.Faces)
  {
    output->SetPolys(cloud.Faces);
  }
  else
  {
    output->SetVerts(MakeVertices(static_cast<int>(Count(cloud))));
  }
}
}
