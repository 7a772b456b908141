// SPDX-License-Identifier: BSD-3-Clause
/**
 * Surfels of points with normals that are spread evenly over a surface. The VTK filters
 * (vtkPointsToSurfels) also take scans, whose spacing varies and which may lack normals.
 */
#pragma once

#include "Core/Surfels/SurfelCloud.h"

#include <cstddef>
#include <vector>

namespace SurfelSplatting
{
/// Owns the covariances and area vectors that its cloud points to.
class RoundSurfels
{
public:
  /**
   * Each surfel stands for a square of the tangent plane with the spacing d as its side: area d^2,
   * standard deviation d / 2.
   * @param positions [count][3] the caller's memory, which must outlive the cloud; world units
   * @param normals   [count][3] outward, of any length above 0
   * @param spacing   distance between neighbours, world units, > 0
   */
  RoundSurfels(std::size_t count, const float* positions, const float* normals, double spacing);

  /// One-sided and white. Set its colours, material and transform before it is rendered.
  SurfelCloud Cloud() const&;
  SurfelCloud Cloud() const&& = delete; // it would outlive the arrays

private:
  std::size_t Count;
  const float* Positions;
  std::vector<float> Covariances; // [count][6]
  std::vector<float> AreaVectors; // [count][3]
};
}
