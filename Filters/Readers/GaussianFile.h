// SPDX-License-Identifier: BSD-3-Clause
/**
 * A capture of 3D Gaussian splatting, read part by part.
 */
#pragma once

#include "Filters/Readers/FieldCloud.h"
#include "Filters/Readers/GaussianLayout.h"
#include "Filters/Readers/PackedGaussians.h"
#include "Filters/Readers/PointCloudHeader.h"

#include <cstdint>
#include <fstream>
#include <optional>
#include <string>

namespace PointCloud
{
enum class CaptureFormat
{
  None,
  PLY,
  Splat
};

/// The format: .ply by its header, .splat, which has none, by the file's name. None also for .ply
/// files of other things, and if the file cannot be read.
CaptureFormat FindCaptureFormat(const std::string& path);

class GaussianFile
{
public:
  /// Reads and checks the header. Throws std::runtime_error that says what is wrong with the file.
  explicit GaussianFile(const std::string& path);

  std::uint64_t Count() const { return this->Header.Width; }
  const GaussianLayout& Layout() const { return this->Values; }

  /// Number of Gaussians to read at once.
  std::uint64_t PartSize() const;

  /// The next Gaussians, not more than there are. Throws std::runtime_error or std::bad_alloc.
  FieldCloud Read(std::uint64_t count);

private:
  void OpenPLY(std::uint64_t bytes);
  void OpenVertices(const PLYHeader& header, std::uint64_t bytes);
  void OpenSplat(std::uint64_t bytes);

  std::ifstream File;
  GaussianLayout Values;
  PCDHeader Header;       // as if it were a .pcd file: Gaussians are stored as its points are
  bool IsSwapped = false; // the other byte order than the machine's
  std::optional<PackedGaussians> Packed;
  std::uint64_t Done = 0; // Gaussians that were read
};
}
