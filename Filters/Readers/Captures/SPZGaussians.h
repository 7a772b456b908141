// SPDX-License-Identifier: BSD-3-Clause
/**
 * Captures in Niantic's .spz files, versions 2 to 4: a header, and one column after another, each
 * with the values of all Gaussians. Little-endian throughout. In versions 2 and 3 all of it is a
 * gzip stream. In version 4 only columns are compressed, each as a zstd stream; before them is a
 * table with the 8 bytes of the compressed and the 8 of the unpacked size of each column that is
 * not empty.
 *
 * | header, bytes     | value                                                                |
 * |-------------------|----------------------------------------------------------------------|
 * | 4, 4              | NGSP, version                                                        |
 * | 4, 1              | number of Gaussians; degree of the harmonics                         |
 * | 1, 1, 1           | fractional bits of positions; flags; version 4: number of streams    |
 * | 4, 12             | version 4: where in the file the table begins; reserved              |
 *
 * | column            | bytes of a Gaussian, values                                          |
 * |-------------------|----------------------------------------------------------------------|
 * | positions         | 3 x 3, signed: over 2^(fractional bits)                              |
 * | opacities         | 1: b / 255                                                           |
 * | colours           | 3: harmonics of degree 0, (b / 255 - 0.5) / 0.15                     |
 * | scales            | 3: logarithms, b / 16 - 10                                           |
 * | rotations         | version 2: 3, x y z, b / 127.5 - 1, and w is not negative            |
 * |                   | from version 3 on: 4, from the highest bit: 2 bits which of x y z w is | |
 * | largest; of the others a sign and 9 bits from 0 to 1 / sqrt(2)       | | harmonics         |
 * red, green, blue of each from degree 1 on: (b - 128) / 128           |
 *
 * Flag 1: trained with antialiasing. Flag 2: extensions follow the columns, or in version 4 the
 * header, each with 4 bytes of type, 4 of length, and its content; 0xADBE0003 names the axes (4
 * bytes), all others are skipped.
 * Axes are right, up, back unless that says otherwise, and become right, down, front, as .ply files
 * have them.
 *
 * After the public description of the format (github.com/nianticlabs/spz, README.md).
 */
#pragma once

#include "Filters/Readers/Captures/CompressedStream.h"
#include "Filters/Readers/Captures/GaussianLayout.h"

#include <cstdint>
#include <functional>
#include <istream>
#include <memory>
#include <vector>

namespace PointCloud
{
class SPZGaussians
{
public:
  /// Whether a file begins as .spz files of any version do. The file is then at its beginning.
  static bool Has(std::istream& file);

  /// Reads and checks the header; the file is at its beginning.
  /// @param bytes of the whole file
  /// @throw std::runtime_error that says what is wrong with the file
  SPZGaussians(std::istream& file, std::uint64_t bytes);

  std::uint64_t Count() const { return this->Gaussians; }
  GaussianLayout Layout() const { return LayoutOfUnpacked(1 + this->Rest); }
  bool IsAntialiased() const { return this->Flags & 1; }

  /// Inflates the columns. Gives the finished fraction to `proceed`, and stops where it says false.
  /// Returns whether they are complete. Throws std::runtime_error or std::bad_alloc.
  bool Inflate(std::istream& file, const std::function<bool(double)>& proceed);

  /// Unpacks Gaussians from one on, of complete columns. Throws std::bad_alloc.
  FieldCloud Read(std::uint64_t first, std::uint64_t count) const;

private:
  void CheckVersion(bool isPlain) const;
  void ReadPlain(std::istream& file, unsigned streams);
  void CheckTable(std::istream& file, std::uint64_t at, unsigned streams) const;
  void CheckHeader() const;
  void CheckMemory() const;
  std::uint64_t RotationBytes() const { return this->Version == 2 ? 3 : 4; }
  std::uint64_t Size() const
  {
    return this->Gaussians * (16 + this->RotationBytes() + 3 * this->Rest);
  }
  bool InflateColumns(std::istream& file, const std::function<bool(double)>& proceed);
  void SetExtensions(const std::vector<std::uint8_t>& bytes);
  void SetAxes(std::uint32_t axes);
  template <typename Store>
  void Unpack(std::uint64_t i, const Store& store) const;

  std::unique_ptr<CompressedStream> Stream;
  std::uint64_t FileBytes;
  std::uint64_t Gaussians = 0;
  std::uint32_t Version = 0;
  int Degree = 0;
  int Rest = 0; ///< harmonics from degree 1 on
  int FractionalBits = 0;
  unsigned Flags = 0;
  double Signs[3] = { 1.0, -1.0, -1.0 }; ///< from the file's axes to right, down, front
  double HarmonicSigns[15] = {};         ///< the same of harmonics from degree 1 on
  SurfelGeometry::RawVector<std::uint8_t> Columns;
};
}
