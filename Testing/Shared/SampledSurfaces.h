// SPDX-License-Identifier: BSD-3-Clause
/**
 * Points on surfaces whose normals are known.
 */
#pragma once

#include "Testing/Shared/Random.h"

#include <array>
#include <vector>

namespace SurfelTesting
{
using Vec = std::array<double, 3>;

constexpr double Pi = 3.14159265358979323846;

/// Points on a surface with the true outward normals.
struct Sampled
{
  std::vector<Vec> Points;
  std::vector<Vec> Normals;

  void Add(const Vec& p, const Vec& n);
  void Append(const Sampled& other);
  void Shift(const Vec& by);
};

/// Fibonacci points on a sphere about `center`.
Sampled FibonacciSphere(const Vec& center, double radius, int count);

/// Sphere about 0, `count` points spread evenly with some jitter (a stratified sample).
Sampled MakeSphere(double radius, int count, Random random);

/// Rectangle [0, a] x [0, b] spanned by two axes from a corner; jittered cells of side `pitch`.
Sampled MakeRectangle(const Vec& corner, const Vec& u, double a, const Vec& v, double b,
  double pitch, double jitter, Random random);

/// Unit sphere about 0 and the square [-2, 2]^2 at a height z with jittered cells of side `pitch`.
Sampled MakeBallAndWall(int count, double z, double pitch);

/// Tube about the z axis from z = 0 to `length`, with caps if wanted.
Sampled MakeTube(double radius, double length, double pitch, bool caps, Random random);

/// Closed box [0, a] x [0, b] x [0, c].
Sampled MakeBox(double a, double b, double c, double pitch, Random random);
}
