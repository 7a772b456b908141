// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Readers/Captures/GaussianLayout.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <stdexcept>
#include <string>

namespace PointCloud
{
namespace
{
template <typename T>
double Load(const std::uint8_t* at)
{
  T value;
  std::memcpy(&value, at, sizeof value);
  return static_cast<double>(value);
}

double (*LoadOf(Field::Types type))(const std::uint8_t*)
{
  switch (type)
  {
    case Field::INT8:
      return Load<std::int8_t>;
    case Field::UINT8:
      return Load<std::uint8_t>;
    case Field::INT16:
      return Load<std::int16_t>;
    case Field::UINT16:
      return Load<std::uint16_t>;
    case Field::INT32:
      return Load<std::int32_t>;
    case Field::UINT32:
      return Load<std::uint32_t>;
    case Field::FLOAT32:
      return Load<float>;
    default:
      return Load<double>; // all other types of .ply files
  }
}

double Itself(double x)
{
  return x;
}

/// Infinite logits of converters mean 0 and 1.
double Sigmoid(double logit)
{
  return 1.0 / (1.0 + std::exp(-logit));
}

double FromByte(double x)
{
  return x / 255.0;
}

double FromSignedByte(double x)
{
  return (x - 128.0) / 128.0;
}

GaussianValue ValueOf(
  const std::vector<Field>& fields, const std::string& name, double (*decode)(double))
{
  const Field* field = FindField(fields, name);
  if (!field)
  {
    throw std::runtime_error("its Gaussians have no property " + name +
      "; a capture has x y z, f_dc_0 to f_dc_2, opacity, scale_0 to scale_2 and rot_0 to rot_3.");
  }
  return { field->Offset, LoadOf(field->Type), decode };
}

/// Adds a field behind the others.
GaussianValue AddValue(GaussianLayout& layout, Field::Types type, double (*decode)(double))
{
  layout.Fields.push_back({ std::string(), layout.Step, type, 1 });
  layout.Step += SizeOf(type);
  return { layout.Fields.back().Offset, LoadOf(type), decode };
}
}

const Field* FindField(const std::vector<Field>& fields, const std::string& name)
{
  const auto found = std::find_if(
    fields.begin(), fields.end(), [&](const Field& field) { return field.Name == name; });
  return found == fields.end() ? nullptr : &*found;
}

int CountHarmonics(const std::vector<Field>& fields)
{
  const auto rest = std::count_if(fields.begin(), fields.end(),
    [](const Field& field) { return field.Name.rfind("f_rest_", 0) == 0; });
  const auto harmonics = static_cast<int>(rest / 3 + 1);
  if (rest != 0 && rest != 9 && rest != 24 && rest != 45)
  {
    throw std::runtime_error("its Gaussians have " + std::to_string(rest) +
      " properties f_rest_; captures have 0, 9, 24 or 45 of them, for harmonics of degree 0 to 3.");
  }
  return harmonics;
}

bool IsCapture(const std::vector<Field>& fields)
{
  return FindField(fields, "scale_0") && FindField(fields, "rot_0") && FindField(fields, "opacity");
}

GaussianLayout LayoutOfPLY(const std::vector<Field>& fields, std::size_t step)
{
  GaussianLayout layout;
  layout.Fields = fields;
  layout.Step = step;
  const int rest = CountHarmonics(fields) - 1;
  for (int i = 0; i < 3; ++i)
  {
    const std::string axis(1, static_cast<char>('x' + i));
    layout.Position[i] = ValueOf(fields, axis, Itself);
    layout.HasDoublePositions =
      layout.HasDoublePositions || FindField(fields, axis)->Type != Field::FLOAT32;
    layout.Scale[i] = ValueOf(fields, "scale_" + std::to_string(i), std::exp);
    layout.Harmonics.push_back(ValueOf(fields, "f_dc_" + std::to_string(i), Itself));
  }
  for (int k = 0; k < rest; ++k)
  {
    for (int c = 0; c < 3; ++c)
    {
      layout.Harmonics.push_back(ValueOf(fields, "f_rest_" + std::to_string(c * rest + k), Itself));
    }
  }
  for (int i = 0; i < 4; ++i)
  {
    layout.Rotation[i] = ValueOf(fields, "rot_" + std::to_string(i), Itself);
  }
  layout.Opacity = ValueOf(fields, "opacity", Sigmoid);
  return layout;
}

GaussianLayout LayoutOfUnpacked(int harmonics)
{
  GaussianLayout layout;
  const auto add = [&layout] { return AddValue(layout, Field::FLOAT32, Itself); };
  std::generate_n(layout.Position, 3, add);
  std::generate_n(layout.Scale, 3, [&] { return AddValue(layout, Field::FLOAT32, std::exp); });
  std::generate_n(layout.Rotation, 4, add);
  layout.Opacity = add();
  std::generate_n(std::back_inserter(layout.Harmonics), 3 * harmonics, add);
  return layout;
}

GaussianLayout LayoutOfSplat()
{
  GaussianLayout layout;
  const auto addFloat = [&layout] { return AddValue(layout, Field::FLOAT32, Itself); };
  std::generate_n(layout.Position, 3, addFloat);
  std::generate_n(layout.Scale, 3, addFloat);
  layout.Color = layout.Step;
  for (int c = 0; c < 3; ++c)
  {
    AddValue(layout, Field::UINT8, FromByte);
  }
  layout.Opacity = AddValue(layout, Field::UINT8, FromByte);
  std::generate_n(
    layout.Rotation, 4, [&] { return AddValue(layout, Field::UINT8, FromSignedByte); });
  return layout;
}
}
