// SPDX-License-Identifier: BSD-3-Clause
/**
 * The kernels around a surfel and what they add to a sample of its cell.
 */
#pragma once

#include "Filters/Neighbors/AngularGap.h"
#include "Filters/Normalization/WeightProblem.h"

#include <cstdint>

namespace SurfelGeometry
{
/// A kernel's peak as FindKernels() returns it.
constexpr float KernelPeak = 65535.0f;

/// Distances from a kernel's plane, in its sigma, at which it covers samples.
struct ClimbRange
{
  float First, Last;
};

/// Those kernels of one or several sheets that may reach a sample of the owner, as a structure of
/// arrays for SIMD loops. Beyond Count the arrays are padded to full vectors with kernels that
/// reach nothing.
struct SheetKernels
{
  static constexpr int Lanes = 16;
  static constexpr int Capacity = Directions::Capacity + Lanes;

  int Count;
  std::uint16_t Numbers[Capacity]; // in the table
  alignas(64) float X[Capacity] = {};
  alignas(64) float Y[Capacity] = {};
  alignas(64) float Z[Capacity] = {};
  alignas(64) float B1X[Capacity] = {};
  alignas(64) float B1Y[Capacity] = {};
  alignas(64) float B1Z[Capacity] = {};
  alignas(64) float B2X[Capacity] = {};
  alignas(64) float B2Y[Capacity] = {};
  alignas(64) float B2Z[Capacity] = {};
  alignas(64) float NX[Capacity] = {};
  alignas(64) float NY[Capacity] = {};
  alignas(64) float NZ[Capacity] = {};
  alignas(64) float LeastClimb[Capacity] = {}; // from the kernel's plane: from here on
  alignas(64) float Climb[Capacity] = {};      // up to here

  int Padded() const { return (this->Count + Lanes - 1) / Lanes * Lanes; }

  /// @param at in units of `spacing`, which is in world units
  void Add(std::uint16_t number, const Float3& at, const WeightedKernel& kernel, float spacing,
    const ClimbRange& climb)
  {
    const int k = this->Count++;
    this->Numbers[k] = number;
    this->X[k] = at.X;
    this->Y[k] = at.Y;
    this->Z[k] = at.Z;
    this->SetRows(k, kernel, spacing);
    this->NX[k] = kernel.Normal.X;
    this->NY[k] = kernel.Normal.Y;
    this->NZ[k] = kernel.Normal.Z;
    this->LeastClimb[k] = climb.First * kernel.Sigma / spacing;
    this->Climb[k] = climb.Last * kernel.Sigma / spacing;
  }

  /// Sets what of a kernel lies in its plane.
  void SetRows(int k, const WeightedKernel& kernel, float spacing)
  {
    this->B1X[k] = spacing * kernel.B1.X;
    this->B1Y[k] = spacing * kernel.B1.Y;
    this->B1Z[k] = spacing * kernel.B1.Z;
    this->B2X[k] = spacing * kernel.B2.X;
    this->B2Y[k] = spacing * kernel.B2.Y;
    this->B2Z[k] = spacing * kernel.B2.Z;
  }

  /// Pads to full vectors; call after the last Add.
  void Pad()
  {
    for (int k = this->Count; k < this->Padded(); ++k)
    {
      this->Climb[k] = 0.0f; // the rest is of other kernels, and all are finite
    }
  }
};

/// The kernels at a sample, their peaks KernelPeak; 0 of those whose exponent |B y|^2 / 2 is
/// beyond the support, and of those whose plane is not within their ClimbRange.
/// @param kernels [SheetKernels::Capacity]
void FindKernels(const SheetKernels& s, const Float3& at, float support, int* kernels);
}
