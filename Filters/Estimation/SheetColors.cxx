// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/SheetColors.h"

#include "Core/Simd/Multiversion.h"

#include <algorithm>
#include <cstddef>

namespace SurfelGeometry
{
namespace
{
SURFEL_MULTIVERSION void MaskColors(const NearSheet& sheet, SheetColors& colors)
{
  for (int k = 0; k < NearSheet::Capacity; ++k)
  {
    float squares = 0.0f;
    for (int c = 0; c < ColorComponents; ++c)
    {
      colors.Differences[c][k] *= sheet.OfSheet[k];
      squares += colors.Differences[c][k] * colors.Differences[c][k];
    }
    colors.Squares[k] = squares;
  }
}

SURFEL_MULTIVERSION void SumLanes(
  const NearSheet& sheet, const SheetColors& colors, ColorMoments& sums)
{
  sums.Count = 1.0f + LaneSum(sheet.OfSheet);
  sums.X = LaneSum(sheet.X);
  sums.Y = LaneSum(sheet.Y);
  sums.XX = LaneDot(sheet.X, sheet.X);
  sums.XY = LaneDot(sheet.X, sheet.Y);
  sums.YY = LaneDot(sheet.Y, sheet.Y);
  for (int c = 0; c < ColorComponents; ++c)
  {
    sums.C[c] = LaneSum(colors.Differences[c]);
    sums.XC[c] = LaneDot(sheet.X, colors.Differences[c]);
    sums.YC[c] = LaneDot(sheet.Y, colors.Differences[c]);
  }
  sums.CC = LaneSum(colors.Squares);
}

/// The Gaussian is (1 - x^2 / (20 s^2))^8, which is as high in the middle, has the variance s^2 in
/// each direction, and ends.
SURFEL_MULTIVERSION void MixColors(
  const NearSheet& sheet, const SheetColors& colors, float deviation, float* mean)
{
  constexpr float reach = 20.0f;
  const float inverse = 1.0f / (reach * deviation * deviation);
  alignas(32) float weights[NearSheet::Capacity];
  for (int k = 0; k < NearSheet::Capacity; ++k)
  {
    const float rest = 1.0f - inverse * (sheet.X[k] * sheet.X[k] + sheet.Y[k] * sheet.Y[k]);
    const float bounded = rest > 0.0f ? rest : 0.0f;
    const float second = bounded * bounded, fourth = second * second;
    weights[k] = sheet.OfSheet[k] * fourth * fourth;
  }
  const float scale = 1.0f / (1.0f + LaneSum(weights));
  for (int c = 0; c < ColorComponents; ++c)
  {
    mean[c] = scale * LaneDot(weights, colors.Differences[c]);
  }
}
}

void SheetColors::Load(
  const CloudColors& colors, const NearSheet& sheet, int i, const int* ids, int count)
{
  const unsigned char* own = colors.data() + ColorComponents * static_cast<size_t>(i);
  for (int k = 0; k < count; ++k)
  {
    const unsigned char* color = colors.data() + ColorComponents * static_cast<size_t>(ids[k]);
    for (int c = 0; c < ColorComponents; ++c)
    {
      this->Differences[c][k] = static_cast<float>(color[c] - own[c]);
    }
  }
  for (int c = 0; c < ColorComponents; ++c)
  {
    std::fill(this->Differences[c] + count, this->Differences[c] + NearSheet::Capacity, 0.0f);
  }
  MaskColors(sheet, *this);
}

ColorMoments SumColors(const NearSheet& sheet, const SheetColors& colors)
{
  ColorMoments sums;
  SumLanes(sheet, colors, sums);
  return sums;
}

void MeanColor(
  const NearSheet& sheet, const SheetColors& colors, float deviation, float mean[ColorComponents])
{
  MixColors(sheet, colors, deviation, mean);
}
}
