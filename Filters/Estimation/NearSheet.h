// SPDX-License-Identifier: BSD-3-Clause
/**
 * The nearest neighbours of a point on its sheet of surface, in its tangent plane, as a structure
 * of arrays for SIMD loops. Lengths in spacings of the point.
 */
#pragma once

#include "Filters/Common/VectorMath.h"
#include "Filters/Estimation/PlaneFit.h"
#include "Filters/Neighbors/NeighborGraph.h"

namespace SurfelGeometry
{
struct NearSheet
{
  static constexpr int Lanes = 8;
  static constexpr int Capacity = (KeptNeighbors + Lanes - 1) / Lanes * Lanes;

  Vector3 U, V; // of the tangent plane, unit
  /// Places on the unrolled surface (SurfaceFold.h), so that far points of a thin tube do not come
  /// too near. Zero for what is neither of the sheet nor across a fold.
  alignas(32) float X[Capacity], Y[Capacity];
  alignas(32) float OfSheet[Capacity]; // 1 or 0
  alignas(32) float Folded[Capacity];  // 1 behind a fold, or 0
  alignas(32) float Cosines[Capacity]; // n.m, n and m the normals of point and neighbour
  alignas(32) float Heights[Capacity]; // d.(n + m) / 2, d from the point to the neighbour

  /// Loads neighbours of point i, whose spacing is not 0.
  /// @param ids [count] at most Capacity
  /// @param foldReach distance of both points from a fold, spacings; 0: without what is across
  /// folds
  void Load(const OrientedCloud& oriented, const PlaneFits& fits, int i, const int* ids, int count,
    float foldReach = 0.0f);

  /// What is loaded of each neighbour. Differences are exact in float where neighbours are near
  /// each other. Lanes without one have no normal and are of no sheet.
  struct Raw
  {
    alignas(32) float DX[Capacity] = {}, DY[Capacity] = {}, DZ[Capacity] = {};
    alignas(32) float NX[Capacity] = {}, NY[Capacity] = {}, NZ[Capacity] = {};
    alignas(32) int EitherTwoSided[Capacity] = {};
  };

private:
  Raw Neighbors;  // to clear all lanes for each point would take a third of the time to load them
  int Loaded = 0; // lanes
};

/// Sum over all lanes of an array.
inline float LaneSum(const float* a)
{
  float sums[NearSheet::Lanes];
  for (int k = 0; k < NearSheet::Lanes; ++k)
  {
    sums[k] = a[k];
    for (int j = NearSheet::Lanes + k; j < NearSheet::Capacity; j += NearSheet::Lanes)
    {
      sums[k] += a[j];
    }
  }
  return ((sums[0] + sums[4]) + (sums[1] + sums[5])) + ((sums[2] + sums[6]) + (sums[3] + sums[7]));
}

/// Sum of the products of two arrays.
inline float LaneDot(const float* a, const float* b)
{
  alignas(32) float products[NearSheet::Capacity];
  for (int k = 0; k < NearSheet::Capacity; ++k)
  {
    products[k] = a[k] * b[k];
  }
  return LaneSum(products);
}
}
