// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Scanners/ScanPhase.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
namespace
{
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double TwoPi = 6.283185307179586;

/// The least number of jumps, and their least mean cosine of the phase. (From scanners it is 0.96
/// and more, from beside them less, and from elsewhere 0.2.)
constexpr std::size_t LeastPhased = 10;
constexpr double LeastPhaseCosine = 0.4;

/// Jumps are off across their lines by less than this. (Weighted as in ScanSteps.cxx.)
constexpr double MostOffLine = 1.0;

/// A step of the search, as a part of a phase, and the most steps on either side.
constexpr double SearchStep = 0.1, MostPhaseSteps = 500.0;

/// A jump, as seen from about its scanner.
struct PhasedJump
{
  Vector3d Before, Behind, Along;
  double Unit;

  /// How much its angle changes with the place, across the line of sight.
  double Slope(const Vector3d& place) const
  {
    return std::abs(1.0 / (this->Before - place).norm() - 1.0 / (this->Behind - place).norm());
  }
  double Cosine(const Vector3d& place) const
  {
    const Vector3d step = (this->Behind - place).normalized() - (this->Before - place).normalized();
    return std::cos(TwoPi * step.dot(this->Along) / this->Unit);
  }
};

std::vector<PhasedJump> SeeJumps(
  const std::vector<const ScanWindow*>& windows, const Vector3d& place)
{
  std::vector<PhasedJump> jumps;
  for (const ScanWindow* window : windows)
  {
    const SeenSteps seen = SeenFrom(place, *window, Steps::Multiples);
    if (seen.IsValid && SeenFrom(place, *window, Steps::Aligned).Agree(MostOffLine))
    {
      jumps.push_back({ window->Before(), window->Behind(), seen.Along, seen.Unit });
    }
  }
  return jumps;
}

/// Along the normals of the jumps' lines their offsets across tell the place; these are weighted by
/// how much they do.
Vector3d FindAxis(const std::vector<PhasedJump>& jumps, const Vector3d& place, int axis)
{
  Matrix3d sum = Matrix3d::Zero();
  for (const PhasedJump& jump : jumps)
  {
    const Vector3d normal =
      jump.Slope(place) * (jump.Before - place).cross(jump.Along).normalized();
    sum += normal * normal.transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Matrix3d>(sum).eigenvectors().col(axis);
}
}

bool FindPhase(
  const std::vector<const ScanWindow*>& windows, int axis, double reach, Vector3d& place)
{
  const std::vector<PhasedJump> jumps = SeeJumps(windows, place);
  double slopes = 0.0;
  for (const PhasedJump& jump : jumps)
  {
    slopes += jump.Slope(place) / jump.Unit;
  }
  if (jumps.size() < LeastPhased || !(slopes > 0.0))
  {
    return false;
  }
  const auto count = static_cast<double>(jumps.size());
  const double length = SearchStep * count / slopes;
  const Vector3d step = length * FindAxis(jumps, place, axis);
  const int steps = static_cast<int>(std::min(reach / length, MostPhaseSteps));
  double most = -count;
  int best = 0;
  for (int i = -steps; i <= steps; ++i)
  {
    double sum = 0.0;
    for (const PhasedJump& jump : jumps)
    {
      sum += jump.Cosine(place + i * step);
    }
    if (sum > most)
    {
      most = sum;
      best = i;
    }
  }
  place += best * step;
  return most > LeastPhaseCosine * count;
}
}
