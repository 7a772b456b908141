// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace SurfelTesting
{
/// A point of the unit sphere by its height and its angle about the z axis.
inline std::array<double, 3> UnitSpherePoint(double z, double angle)
{
  const double r = std::sqrt(1.0 - z * z);
  return { r * std::cos(angle), r * std::sin(angle), z };
}

/// SplitMix64: the same numbers everywhere, unlike the standard library's distributions.
class Random
{
public:
  explicit Random(std::uint64_t seed)
    : State(seed)
  {
  }

  std::uint64_t Bits()
  {
    std::uint64_t z = this->State += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
  }

  /// Uniform in [0, 1).
  double operator()() { return static_cast<double>(this->Bits() >> 11) * 0x1p-53; }

  double Uniform(double low, double high) { return low + (high - low) * (*this)(); }

  /// Both ends included.
  int Integer(int low, int high)
  {
    return low + static_cast<int>(this->Bits() % static_cast<std::uint64_t>(high - low + 1));
  }

  /// Unit length, uniform on the sphere.
  std::array<double, 3> Direction()
  {
    const double z = this->Uniform(-1.0, 1.0);
    return UnitSpherePoint(z, this->Uniform(0.0, 6.283185307179586));
  }

private:
  std::uint64_t State;
};
}
