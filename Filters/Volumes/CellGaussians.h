// SPDX-License-Identifier: BSD-3-Clause
/**
 * A cell of a volume as Gaussians whose moments are those of its extinction.
 */
#pragma once

#include "Filters/Volumes/TransferTable.h"

#include <array>
#include <vector>

namespace SurfelVolumes
{
/// In the coordinates of a cell, which is the unit cube.
struct CellGaussian
{
  double Center[3];
  double Covariance[6]; // XX YY ZZ XY YZ XZ
  double Extinction;    // at the centre, per world unit
  double Color[3];      // 0..1
  double Normal[3];     // mean, world coordinates, length 0..1; 0 without normals of the corners
};

/// x fastest.
struct CellCorners
{
  std::array<double, 8> Scalars; // finite
  /// 0..1; null: those of the transfer table.
  const std::array<std::array<double, 3>, 8>* Colors = nullptr;
  /// Unit normals in world coordinates, or 0; null: the Gaussians have none.
  const std::array<std::array<double, 3>, 8>* Normals = nullptr;
};

struct CellSettings
{
  /// A part may be split into eight so many times.
  int Subdivision = 1;
  /// World units: the cube root of a cell's volume.
  double Size = 1.0;
};

/**
 * Appends the Gaussians of a cell. Scalars are interpolated between its corners and classified
 * afterwards. Mass, mean and colour of a Gaussian are those of the extinction in its part of the
 * cell, so that a surface through a cell stays where it is. Its covariance is three times that of
 * the extinction, so that Gaussians overlap: a thin shell gets flat ones, and the standard
 * deviation of a homogeneous part is half of its length. Along each axis the sum over equal parts
 * is then 1 within 2 exp(-pi^2 / 2) = 1.44 %, everywhere within 4.4 %.
 *
 * Colours of the corners are interpolated, too, and taken as they are.
 *
 * A part is split into eight where one Gaussian cannot stand for it: where opacity or emitted light
 * over the length of the part deviate from their means by more than SplitDeviation.
 *
 * Normals are interpolated between the corners, as VTK's ray caster does with what they reflect.
 * That of a Gaussian is their mean, weighted by the extinction: with normals n = sum of
 * n_abc x^a y^b z^c, a, b, c = 0 or 1, it follows from the moments of the extinction s,
 * sum of n_abc (sum of s x^a y^b z^c) / (sum of s).
 */
void AppendCellGaussians(const CellCorners& corners, const TransferTable& table,
  const CellSettings& settings, std::vector<CellGaussian>& gaussians);

/// Whether a cell with these scalars absorbs nothing.
bool IsEmptyCell(const std::array<double, 8>& scalars, const TransferTable& table);
}
