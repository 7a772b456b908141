// SPDX-License-Identifier: BSD-3-Clause
/**
 * A surfel, the owner of samples, and its neighbours, as its samples see them: where they are, and
 * what their kernels add. All neighbours are related to the owner at once, in SIMD lanes.
 */
#pragma once

#include "Filters/Normalization/SheetKernels.h"
#include "Filters/Normalization/SurfelTable.h"
#include "Filters/Normalization/WeightProblem.h"

#include <cstdint>

namespace SurfelGeometry
{
/// Lengths in units of the owner's spacing, relative to the owner.
class OwnerSheet
{
public:
  static constexpr int Capacity = SheetKernels::Capacity;

  /// The squared distance of neighbours that cannot be on the owner's sheet.
  static constexpr float Elsewhere = 1e30f;

  /// The owner, which is the first, and its neighbours, nearest first, all with their places. Those
  /// that are elsewhere, or whose kernels end before the samples, reach nothing.
  SheetKernels Kernels;
  alignas(64) float Squared[Capacity] = {};
  alignas(64) float AlongU[Capacity] = {}, AlongV[Capacity] = {}, Climbs[Capacity] = {};

  // Of those on the owner's sheet that may be of other sheets, too: in front of the owner along its
  // normal, and behind it.
  SheetKernels InFront, Behind;

  /// How clear it is which of several sheets is in front, [0, 1]: 0 if they have two sides, or are
  /// layers of noise, which fill the space between them.
  float Distinct = 0.0f;

  /// @param own       number of the owner in the table
  /// @param neighbors [count] numbers
  void Load(const SurfelTable& table, std::uint16_t own, const std::uint16_t* neighbors, int count,
    const WeightSettings& settings);

  int Count() const { return this->Kernels.Count; }
  bool Has(int k) const { return this->Squared[k] < Elsewhere; }

  /// What is loaded of each neighbour, in world units.
  struct Row
  {
    alignas(64) float X[Capacity] = {}, Y[Capacity] = {}, Z[Capacity] = {};
    alignas(64) float NX[Capacity] = {}, NY[Capacity] = {}, NZ[Capacity] = {};
    alignas(64) float B1X[Capacity] = {}, B1Y[Capacity] = {}, B1Z[Capacity] = {};
    alignas(64) float B2X[Capacity] = {}, B2Y[Capacity] = {}, B2Z[Capacity] = {};
    alignas(64) float Sigmas[Capacity] = {}, Reaches[Capacity] = {};
    alignas(64) int Alike[Capacity] = {}; // usable, and with as many sides as the owner
  };

  /// What needs a closer look: the kernel is across a fold, or may be of another sheet.
  alignas(64) int Folded[Capacity] = {}, OfOther[Capacity] = {};

private:
  void LoadRow(const SurfelTable& table, bool isTwoSided);
  bool NeedsCloserLook() const;
  void LookCloser(const SurfelTable& table, const WeightSettings& settings, float spacing);

  /// Root of the mean square of the distances, from the owner's plane, of what is on its sheet
  /// only, over the largest there may be: 0.6 of noise that fills it.
  /// @param sigmas NormalOffset
  float Roughness(float sigmas, float spacing) const;

  Row Raw;
};
}
