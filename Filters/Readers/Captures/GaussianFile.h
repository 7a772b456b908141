// SPDX-License-Identifier: BSD-3-Clause
/**
 * A capture of 3D Gaussian splatting, read part by part.
 */
#pragma once

#include "Filters/Readers/Captures/GaussianLayout.h"
#include "Filters/Readers/Captures/PackedGaussians.h"
#include "Filters/Readers/Captures/SPZGaussians.h"
#include "Filters/Readers/Points/FieldCloud.h"
#include "Filters/Readers/Points/PointCloudHeader.h"

#include <cstdint>
#include <fstream>
#include <functional>
#include <optional>
#include <string>

namespace PointCloud
{
enum class CaptureFormat
{
  None,
  PLY,
  SPZ,
  Splat
};

/// The format: .ply and .spz by their headers, .splat, which has none, by the file's name. None
/// also for .ply files of other things, and if the file cannot be read. SPZ also for versions that
/// cannot be read: the reader tells them.
CaptureFormat FindCaptureFormat(const std::string& path);

class GaussianFile
{
public:
  /// Reads and checks the header. Throws std::runtime_error that says what is wrong with the file.
  explicit GaussianFile(const std::string& path);

  std::uint64_t Count() const { return this->Header.Width; }
  const GaussianLayout& Layout() const { return this->Values; }

  /// Whether the file says that the capture was trained with antialiasing.
  bool IsAntialiased() const { return this->Columns && this->Columns->IsAntialiased(); }

  /// The share of the time that Load takes, 0..1.
  double LoadShare() const { return this->Columns ? 0.35 : 0.0; }

  /// Reads what must be in memory before the first Gaussian: of .spz files all columns. To be
  /// called once. Gives the finished fraction to `proceed`, and stops where it says false. Returns
  /// whether it is complete. Throws as Read does.
  bool Load(const std::function<bool(double)>& proceed);

  /// Number of Gaussians to read at once.
  std::uint64_t PartSize() const;

  /// The next Gaussians, not more than there are. Throws std::runtime_error or std::bad_alloc.
  FieldCloud Read(std::uint64_t count);

private:
  void OpenPLY(std::uint64_t bytes);
  void OpenVertices(const PLYHeader& header, std::uint64_t bytes);
  void OpenSplat(std::uint64_t bytes);
  void OpenSPZ(std::uint64_t bytes);

  std::ifstream File;
  GaussianLayout Values;
  PCDHeader Header;       // as if it were a .pcd file: Gaussians are stored as its points are
  bool IsSwapped = false; // the other byte order than the machine's
  std::optional<PackedGaussians> Packed;
  std::optional<SPZGaussians> Columns;
  std::uint64_t Done = 0; // Gaussians that were read
};
}
