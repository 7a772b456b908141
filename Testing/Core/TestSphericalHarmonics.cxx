// SPDX-License-Identifier: BSD-3-Clause
/**
 * Core/Surfels/SphericalHarmonics.h against closed forms, as doubles and as vectors of doubles.
 */
#include "Core/Surfels/SphericalHarmonics.h"
#include "Testing/Shared/Check.h"
#include "Testing/Shared/Random.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

using namespace SurfelSplatting;
using SurfelTesting::Random;

namespace
{
constexpr double Pi = 3.14159265358979324;
using Basis = std::array<double, MaxHarmonics>;

Basis At(const std::array<double, 3>& direction, int count = MaxHarmonics)
{
  double basis[MaxHarmonics] = {};
  EvaluateHarmonics<double>({ direction[0], direction[1], direction[2] }, count, basis);
  Basis values;
  std::copy_n(basis, MaxHarmonics, values.begin());
  return values;
}

/// Legendre polynomials of degree 0 to 3.
double Legendre(int degree, double t)
{
  const double values[] = { 1.0, t, (3.0 * t * t - 1.0) / 2.0, (5.0 * t * t * t - 3.0 * t) / 2.0 };
  return values[degree];
}

/// Products of two harmonics have degree 6 at most: four nodes of Gauss and Legendre in z, and
/// eight equal steps about the axis, integrate them exactly.
TEST_CASE("Orthonormal")
{
  const double node[] = { 0.33998104358485626, 0.86113631159405258 },
               weight[] = { 0.65214515486254614, 0.34785484513745386 };
  double product[MaxHarmonics][MaxHarmonics] = {};
  for (int i = 0; i < 4; ++i)
  {
    const double z = (i % 2 ? 1.0 : -1.0) * node[i / 2];
    for (int step = 0; step < 8; ++step)
    {
      const Basis b = At(SurfelTesting::UnitSpherePoint(z, (step + 0.3) * Pi / 4.0));
      for (int j = 0; j < MaxHarmonics; ++j)
      {
        for (int k = 0; k < MaxHarmonics; ++k)
        {
          product[j][k] += weight[i / 2] * Pi / 4.0 * b[j] * b[k];
        }
      }
    }
  }
  for (int j = 0; j < MaxHarmonics; ++j)
  {
    for (int k = 0; k < MaxHarmonics; ++k)
    {
      CAPTURE(j);
      CAPTURE(k);
      CHECK_NEAR(product[j][k], j == k ? 1.0 : 0.0, 1e-14); // rounding of 32 terms up to 1
    }
  }
}

/// sum over m of Y_lm(a) Y_lm(b) = (2 l + 1) / (4 pi) P_l(a.b)
TEST_CASE("Addition theorem")
{
  Random random(5);
  for (int i = 0; i < 1000; ++i)
  {
    const std::array<double, 3> a = random.Direction(), b = random.Direction();
    const Basis atA = At(a), atB = At(b);
    const double cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    for (int degree = 0; degree < 4; ++degree)
    {
      double sum = 0.0;
      for (int k = degree * degree; k < (degree + 1) * (degree + 1); ++k)
      {
        sum += atA[k] * atB[k];
      }
      const double expected = (2 * degree + 1) / (4.0 * Pi) * Legendre(degree, cosine);
      CHECK_NEAR(sum, expected, 1e-14); // rounding
    }
  }
}

/// The signs, which neither of the tests above sees: the published order and constants at axes and
/// diagonals. Values follow from sin and cos of multiples of the angle about z.
TEST_CASE("Signs")
{
  const double c0 = std::sqrt(1.0 / (4.0 * Pi)), c1 = std::sqrt(3.0 / (4.0 * Pi)),
               c2 = std::sqrt(15.0 / (4.0 * Pi)), c20 = std::sqrt(5.0 / (16.0 * Pi)),
               c30 = std::sqrt(7.0 / (16.0 * Pi)), c31 = std::sqrt(21.0 / (32.0 * Pi)),
               c32 = std::sqrt(105.0 / (4.0 * Pi)), c33 = std::sqrt(35.0 / (32.0 * Pi));
  const double h = std::sqrt(0.5), t = std::sqrt(1.0 / 3.0);
  const struct
  {
    std::array<double, 3> Direction;
    Basis Expected;
  } cases[] = {
    { { 1, 0, 0 }, { c0, 0, 0, -c1, 0, 0, -c20, 0, c2 / 2, 0, 0, 0, 0, c31, 0, -c33 } },
    { { 0, 1, 0 }, { c0, -c1, 0, 0, 0, 0, -c20, 0, -c2 / 2, c33, 0, c31, 0, 0, 0, 0 } },
    { { 0, 0, 1 }, { c0, 0, c1, 0, 0, 0, 2 * c20, 0, 0, 0, 0, 0, 2 * c30, 0, 0, 0 } },
    { { h, h, 0 },
      { c0, -c1 * h, 0, -c1 * h, c2 / 2, 0, -c20, 0, 0, -c33 * h, 0, c31 * h, 0, c31 * h, 0,
        c33 * h } },
    { { t, t, t },
      { c0, -c1 * t, c1 * t, -c1 * t, c2 / 3, -c2 / 3, 0, -c2 / 3, 0, -2 * c33 * t / 3, c32 * t / 3,
        -2 * c31 * t / 3, -4 * c30 * t / 3, -2 * c31 * t / 3, 0, 2 * c33 * t / 3 } },
  };
  for (const auto& c : cases)
  {
    const Basis basis = At(c.Direction);
    for (int k = 0; k < MaxHarmonics; ++k)
    {
      CAPTURE(k);
      CHECK_NEAR(basis[k], c.Expected[k], 1e-15); // rounding
    }
  }
}

TEST_CASE("Fewer harmonics")
{
  const std::array<double, 3> direction = Random(2).Direction();
  const Basis whole = At(direction);
  int numbers = 0;
  for (int count = 0; count <= MaxHarmonics + 9; ++count)
  {
    if (!IsNumberOfHarmonics(count))
    {
      continue;
    }
    ++numbers;
    const Basis basis = At(direction, count);
    for (int k = 0; k < MaxHarmonics; ++k)
    {
      CHECK(basis[k] == (k < count ? whole[k] : 0.0));
    }
  }
  CHECK(numbers == 4);
}

TEST_CASE("Colours")
{
  const auto color = [](double first, double second) {
    const double basis[MaxHarmonics] = { 0.5, -0.25 };
    return ColorOfHarmonics(basis, 2, [=](int k) { return k == 0 ? first : second; });
  };
  CHECK(color(1.0, 2.0) == 0.5);
  CHECK(color(8.0, 0.0) == 4.5); // not clamped
  CHECK(color(0.0, 2.0) == 0.0);
  CHECK(color(-1.0, 4.0) == 0.0);
  CHECK(std::isnan(color(std::numeric_limits<double>::quiet_NaN(), 0.0)));
}

/// Each lane is what its double is; the compiler may contract products and sums differently.
TEST_CASE("Lanes")
{
  constexpr int lanes = LaneTypes<VectorReal>::Count;
  Random random(8);
  Vector3Of<VectorReal> directions;
  std::array<double, 3> each[lanes];
  for (int l = 0; l < lanes; ++l)
  {
    each[l] = random.Direction();
    directions.X[l] = each[l][0];
    directions.Y[l] = each[l][1];
    directions.Z[l] = each[l][2];
  }
  VectorReal basis[MaxHarmonics];
  EvaluateHarmonics(directions, MaxHarmonics, basis);
  const VectorReal color =
    ColorOfHarmonics(basis, MaxHarmonics, [](int k) { return Uniform<VectorReal>(k - 7.5); });
  for (int l = 0; l < lanes; ++l)
  {
    const Basis expected = At(each[l]);
    double sum = 0.5;
    for (int k = 0; k < MaxHarmonics; ++k)
    {
      CHECK_NEAR(basis[k][l], expected[k], 1e-15); // rounding
      sum += expected[k] * (k - 7.5);
    }
    CHECK_NEAR(color[l], std::max(0.0, sum), 1e-13); // rounding of 16 terms up to 10
  }
}
}
