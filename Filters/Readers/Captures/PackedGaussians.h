// SPDX-License-Identifier: BSD-3-Clause
/**
 * Captures in the compressed .ply files of PlayCanvas and SuperSplat: 16 bytes for each Gaussian,
 * and the ranges of its values for each chunk of 256 Gaussians.
 *
 * | vertex, uint    | bits, from the highest  | value                                             |
 * |-----------------|-------------------------|---------------------------------------------------|
 * | packed_position | 11 x, 10 y, 11 z        | from min_x to max_x of the chunk, and so on       |
 * | packed_rotation | 2 largest, 3 of 10 bits | quaternion w x y z: the others, -1 to 1 / sqrt(2) |
 * | packed_scale    | 11 x, 10 y, 11 z        | logarithms, min_scale_x to max_scale_x            |
 * | packed_color    | 8 each: R G B, opacity  | min_r to max_r, or 0 to 1; opacity 0 to 1         |
 *
 * An element sh, if there is one, has harmonics from degree 1 on as bytes f_rest_i from -4 to 4,
 * channel by channel. The colour is that of the harmonic of degree 0.
 */
#pragma once

#include "Filters/Readers/Captures/GaussianLayout.h"
#include "Filters/Readers/Points/PointCloudHeader.h"

#include <cstdint>
#include <istream>
#include <vector>

namespace PointCloud
{
class PackedGaussians
{
public:
  /// Whether a .ply file with this header is such a capture, perhaps an incomplete one.
  static bool Has(const PLYHeader& header);

  /// Checks the header and reads the chunks. The file is where its data begins.
  /// @param bytes of the whole file
  /// @throw std::runtime_error that says what is wrong with the file
  PackedGaussians(const PLYHeader& header, std::istream& file, std::uint64_t bytes);

  std::uint64_t Count() const { return this->Vertices.Count; }
  GaussianLayout Layout() const { return LayoutOfUnpacked(1 + this->Rest / 3); }

  /// Unpacks Gaussians from one on. Throws std::runtime_error or std::bad_alloc.
  FieldCloud Read(std::istream& file, std::uint64_t first, std::uint64_t count) const;

private:
  /// An element whose entries have one size.
  struct Block
  {
    std::uint64_t Begin = 0; ///< in the file, bytes
    std::uint64_t Count = 0;
    std::size_t Step = 0;
  };

  /// Smallest and largest values of a chunk: position, logarithm of the scale, colour.
  struct Chunk
  {
    double Least[9], Most[9];
  };

  static Block FindBlock(const PLYHeader& header, const char* name, std::uint64_t begin);
  void ReadChunks(const PLYElement& element, std::istream& file, const Block& block);
  template <typename Store>
  void Unpack(std::uint64_t i, const std::uint8_t* packed, const std::uint8_t* rest,
    const Store& store) const;

  Block Vertices, Harmonics;
  std::size_t Packed[4] = {}; ///< offsets of position, rotation, scale and colour
  int Rest = 0;               ///< number of f_rest_i
  std::vector<std::size_t> RestOffsets;
  std::vector<Chunk> Chunks;
};
}
