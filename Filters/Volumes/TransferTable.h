// SPDX-License-Identifier: BSD-3-Clause
/**
 * The transfer functions of a volume: what a scalar absorbs and emits, also as a mean over scalars.
 */
#pragma once

#include <array>
#include <vector>

class vtkVolumeProperty;

namespace SurfelVolumes
{
/// Gaussians with less optical depth are left out: a thousand of them take 1 % of the light.
constexpr double LeastOpticalDepth = 1e-5;

/// Scalars beyond this count as not finite: differences of them must be.
constexpr double LargestScalar = 1e300;

/// What a place absorbs, and the light that it emits.
struct Medium
{
  double Extinction = 0.0;                      // s, per world unit
  std::array<double, 3> Emission{ 0., 0., 0. }; // s times red, green, blue, each 0..1
};

/**
 * Extinction s = -ln(1 - o) / u of the first component's opacity o and the unit distance u. It is
 * tabulated as integrals over the scalar, so that means over intervals are exact for whatever the
 * table resolves: a narrow peak is not missed between two samples (pre-integration; Engel, Kraus
 * and Ertl, High-Quality Pre-Integrated Volume Rendering, 2001).
 */
class TransferTable
{
public:
  /// o counts up to this: at most 11 per unit distance, as much as 16 bits tell from opaque.
  static constexpr double LargestOpacity = 1.0 - 1.0 / 65536.0;
  /// As many as 14 bits: CT has 12, and the means over steps are exact anyway.
  static constexpr int Steps = 1 << 14;

  /// @param range of the scalars, range[0] <= range[1]; ends beyond LargestScalar are moved there
  /// @param unitDistance world units, > 0 by so much that extinctions fit into floats
  TransferTable(vtkVolumeProperty* property, const double range[2], double unitDistance);

  /// Leaves scalars out beyond which neither colour nor opacity changes, so that the table resolves
  /// the others.
  /// @param range of the scalars, range[0] <= range[1] before and after
  static void LimitToFunctions(vtkVolumeProperty* property, double range[2]);

  /// Mean over the scalars from `scalar - reach` to `scalar + reach`, at least over one step of the
  /// table; scalars beyond the range count as its ends.
  Medium Mean(double scalar, double reach) const;

  /// Whether no scalar from low to high absorbs anything; on the safe side by a step of the table.
  bool IsEmpty(double low, double high) const;

private:
  double Position(double scalar) const;
  Medium Integral(double position) const;

  double Low, StepsPerScalar;
  std::vector<Medium> Integrals; // from the table's begin to each step, in steps
  Medium First, Last;            // at the ends of the table
};
}
