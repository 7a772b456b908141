// SPDX-License-Identifier: BSD-3-Clause
/**
 * Where a Gaussian of a capture has its values, and how they are stored.
 */
#pragma once

#include "Filters/Readers/Points/FieldCloud.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace PointCloud
{
/// One number of a Gaussian.
struct GaussianValue
{
  std::size_t Offset = 0;                           ///< in the Gaussian, bytes
  double (*Load)(const std::uint8_t* at) = nullptr; ///< as it is stored
  double (*Decode)(double stored) = nullptr;        ///< from that to what it means

  double operator()(const std::uint8_t* gaussian) const
  {
    return this->Decode(this->Load(gaussian + this->Offset));
  }
};

struct GaussianLayout
{
  std::vector<Field> Fields;
  std::size_t Step = 0;                 ///< bytes from one Gaussian to the next
  GaussianValue Position[3];            ///< world units
  GaussianValue Scale[3];               ///< standard deviations, world units
  GaussianValue Rotation[4];            ///< quaternion w x y z of any length but 0
  GaussianValue Opacity;                ///< 0..1
  std::vector<GaussianValue> Harmonics; ///< 3 K: red, green, blue of each of K = 1, 4, 9 or 16
  std::size_t Color = 0;                ///< without harmonics: offset of bytes R G B
  bool HasDoublePositions = false;      ///< a float would round them
};

/// The field of a name, or nullptr.
const Field* FindField(const std::vector<Field>& fields, const std::string& name);

/// Number of harmonics, from that of the fields f_rest_0, f_rest_1, ... Throws std::runtime_error
/// if no degree has so many.
int CountHarmonics(const std::vector<Field>& fields);

/// Whether the vertices of a .ply file with these fields are Gaussians, perhaps incomplete ones.
bool IsCapture(const std::vector<Field>& fields);

/**
 * The layout of the reference implementation's .ply files: f_dc_i and f_rest_i, channel by channel,
 * opacity as logit, scale_i as logarithms, rot_i. Other fields are ignored.
 * Throws std::runtime_error if fields are missing.
 */
GaussianLayout LayoutOfPLY(const std::vector<Field>& fields, std::size_t step);

/// The layout of PackedGaussians.h, in floats: position, logarithms of scales, rotation, opacity,
/// and red, green, blue of each of so many harmonics.
GaussianLayout LayoutOfUnpacked(int harmonics);

/// The layout of .splat files: 3 floats position, 3 floats scale, RGBA, (b - 128) / 128 rotation.
GaussianLayout LayoutOfSplat();
}
