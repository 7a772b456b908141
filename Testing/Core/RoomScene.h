// SPDX-License-Identifier: BSD-3-Clause
/**
 * A scene in which things hide, surround and cross one another, and views from anywhere.
 */
#pragma once

#include "TestScene.h"

#include <cmath>

namespace SurfelSplatting
{
/// Several balls, a floor and a stack of screens: things in front of, behind and beside each other.
inline TestCloud Room(int count, Random& random)
{
  TestCloud cloud;
  for (int i = 0; i < count; ++i)
  {
    TestSurfel s;
    const int ball = i % 5;
    if (i % 2 == 0)
    {
      const int screen = i / 2 % 6;
      s.Position = { random.Uniform(-2, 0), random.Uniform(-1, 1), -2.0 - 0.3 * screen };
      s.Normal = { 0, 0, 1 };
      s.TwoSided = true;
      s.Area = 4.0 * 12.0 / count * 2.0; // more than its share: opaque
    }
    else if (ball < 3)
    {
      s.Normal = random.Direction();
      for (int c = 0; c < 3; ++c)
      {
        const double centers[3][3] = { { 0, 0, 0 }, { 1.6, 0.4, -1.5 }, { -1.2, -0.3, 1.4 } };
        s.Position[c] = centers[ball][c] + 0.7 * s.Normal[c];
      }
      s.Area = 0.49 * 12.57 / (0.1 * count);
    }
    else
    {
      s.Position = { random.Uniform(-4, 4), -1.0, random.Uniform(-4, 4) };
      s.Normal = { 0, 1, 0 };
      s.TwoSided = i % 4 == 1;
      s.Area = 64.0 / (0.2 * count);
    }
    s.SigmaU = s.SigmaV = 0.55 * std::sqrt(s.Area);
    const float light = static_cast<float>(0.5 + 0.5 * std::sin(6.0 * s.Position[0]));
    s.Color = { { light, 0.6f, 1.0f - light, 1.0f } };
    cloud.Add(s);
  }
  return cloud;
}

/// A view from a point to a point, with any roll.
inline View LookAt(const Vector3& from, const Vector3& to, double roll, int size, double f)
{
  View view = PinholeView(size, size, f);
  const Vector3 z = Normalized(to - from);
  Vector3 u, v;
  Tangents(z, u, v);
  const double c = std::cos(roll), s = std::sin(roll);
  view.WorldToCamera.L = { c * u + s * v, c * v - s * u, z };
  for (int i = 0; i < 3; ++i)
  {
    view.WorldToCamera.T[i] = -Dot(view.WorldToCamera.L[i], from);
  }
  view.Near = 1e-6;
  return view;
}

/// Inside the cloud, at it, behind it and far away; pinholes and lenses.
inline SplatContext RandomContext(Random& random, int number)
{
  SplatContext context;
  const double distances[] = { 0.3, 1.0, 3.0, 8.0, 40.0 };
  const double distance = distances[number % 5];
  const Vector3 d = random.Direction(), a = random.Direction();
  const Vector3 to{ 1.5 * a[0], 0.5 * a[1], 1.5 * a[2] };
  const Vector3 from{ to[0] + distance * d[0], to[1] + distance * d[1], to[2] + distance * d[2] };
  context.Camera = LookAt(from, to, random.Uniform(0, 6.28), 96, random.Uniform(40, 200));
  context.Optics.FocalDistance = distance * random.Uniform(0.5, 2.0);
  context.Optics.Radius = number % 3 == 0 ? 0.0 : distance * random.Uniform(0.01, 0.2);
  return context;
}
}
