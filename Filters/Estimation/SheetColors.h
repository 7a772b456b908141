// SPDX-License-Identifier: BSD-3-Clause
/**
 * The colours of a point's neighbours on its sheet, and their sums.
 */
#pragma once

#include "Filters/Arrays/PointColors.h"
#include "Filters/Estimation/NearSheet.h"

namespace SurfelGeometry
{
/// Colours minus those of the point, 8 bits. Zero for what is not of the sheet.
struct SheetColors
{
  alignas(32) float Differences[ColorComponents][NearSheet::Capacity];
  alignas(32) float Squares[NearSheet::Capacity]; // sums over the components

  /// @param ids [count] of the sheet
  void Load(const CloudColors& colors, const NearSheet& sheet, int i, const int* ids, int count);
};

/// Sums over the point and its neighbours, relative to the point: places (x, y) in the tangent
/// plane, in spacings, and colours c.
struct ColorMoments
{
  float Count; // the point included
  float X, Y, XX, XY, YY;
  float C[ColorComponents], XC[ColorComponents], YC[ColorComponents];
  float CC; // over the components too
};

ColorMoments SumColors(const NearSheet& sheet, const SheetColors& colors);

/// The mean of the colours under a Gaussian about the point, minus the point's own.
/// @param deviation of the Gaussian, spacings
void MeanColor(
  const NearSheet& sheet, const SheetColors& colors, float deviation, float mean[ColorComponents]);
}
