// SPDX-License-Identifier: BSD-3-Clause
#include "SampledSurfaces.h"

#include <cmath>

namespace SurfelTesting
{
namespace
{
constexpr double GoldenAngle = 2.39996322972865332;
}

void Sampled::Add(const Vec& p, const Vec& n)
{
  this->Points.push_back(p);
  this->Normals.push_back(n);
}

void Sampled::Append(const Sampled& other)
{
  this->Points.insert(this->Points.end(), other.Points.begin(), other.Points.end());
  this->Normals.insert(this->Normals.end(), other.Normals.begin(), other.Normals.end());
}

void Sampled::Shift(const Vec& by)
{
  for (Vec& p : this->Points)
  {
    p = { p[0] + by[0], p[1] + by[1], p[2] + by[2] };
  }
}

Sampled FibonacciSphere(const Vec& center, double radius, int count)
{
  Sampled result;
  for (int i = 0; i < count; ++i)
  {
    // The baselines were drawn with this angle; GoldenAngle * i is rounded differently.
    const Vec n = UnitSpherePoint(1.0 - (2.0 * i + 1.0) / count, i * Pi * (3.0 - std::sqrt(5.0)));
    result.Add(
      { center[0] + radius * n[0], center[1] + radius * n[1], center[2] + radius * n[2] }, n);
  }
  return result;
}

Sampled MakeSphere(double radius, int count, Random random)
{
  Sampled result;
  for (int i = 0; i < count; ++i)
  {
    const double z = 1.0 - 2.0 * (i + random()) / count;
    const Vec n = UnitSpherePoint(z, GoldenAngle * i + 0.02 * random());
    result.Add({ radius * n[0], radius * n[1], radius * n[2] }, n);
  }
  return result;
}

Sampled MakeRectangle(const Vec& corner, const Vec& u, double a, const Vec& v, double b,
  double pitch, double jitter, Random random)
{
  const Vec n{ u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0] };
  const int columns = static_cast<int>(std::lround(a / pitch));
  const int rows = static_cast<int>(std::lround(b / pitch));
  Sampled result;
  for (int row = 0; row < rows; ++row)
  {
    for (int column = 0; column < columns; ++column)
    {
      const double x = a * (column + 0.5 + jitter * (random() - 0.5)) / columns;
      const double y = b * (row + 0.5 + jitter * (random() - 0.5)) / rows;
      result.Add({ corner[0] + x * u[0] + y * v[0], corner[1] + x * u[1] + y * v[1],
                   corner[2] + x * u[2] + y * v[2] },
        n);
    }
  }
  return result;
}

Sampled MakeBallAndWall(int count, double z, double pitch)
{
  Sampled scene = MakeSphere(1.0, count, Random(1));
  scene.Append(MakeRectangle({ -2, -2, z }, { 1, 0, 0 }, 4, { 0, 1, 0 }, 4, pitch, 1.0, Random(2)));
  return scene;
}

Sampled MakeTube(double radius, double length, double pitch, bool caps, Random random)
{
  Sampled result;
  const int around = static_cast<int>(std::lround(2.0 * Pi * radius / pitch));
  const int along = static_cast<int>(std::lround(length / pitch));
  for (int i = 0; i < along; ++i)
  {
    for (int j = 0; j < around; ++j)
    {
      const double angle = 2.0 * Pi * (j + random()) / around;
      const Vec n{ std::cos(angle), std::sin(angle), 0.0 };
      result.Add({ radius * n[0], radius * n[1], length * (i + random()) / along }, n);
    }
  }
  const int capCount = caps ? static_cast<int>(Pi * radius * radius / (pitch * pitch)) : 0;
  for (const double side : { 0.0, 1.0 })
  {
    for (int i = 0; i < capCount; ++i)
    {
      const double r = radius * std::sqrt((i + random()) / capCount);
      const double angle = GoldenAngle * i;
      result.Add({ r * std::cos(angle), r * std::sin(angle), side * length },
        { 0.0, 0.0, 2.0 * side - 1.0 });
    }
  }
  return result;
}

Sampled MakeBox(double a, double b, double c, double pitch, Random random)
{
  const Vec x{ 1, 0, 0 }, y{ 0, 1, 0 }, z{ 0, 0, 1 };
  const double jitter = 0.9;
  Sampled box = MakeRectangle({ 0, 0, c }, x, a, y, b, pitch, jitter, random);
  box.Append(MakeRectangle({ 0, 0, 0 }, y, b, x, a, pitch, jitter, random));
  box.Append(MakeRectangle({ a, 0, 0 }, y, b, z, c, pitch, jitter, random));
  box.Append(MakeRectangle({ 0, 0, 0 }, z, c, y, b, pitch, jitter, random));
  box.Append(MakeRectangle({ 0, b, 0 }, z, c, x, a, pitch, jitter, random));
  box.Append(MakeRectangle({ 0, 0, 0 }, x, a, z, c, pitch, jitter, random));
  return box;
}
}
