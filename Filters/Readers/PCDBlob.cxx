// SPDX-License-Identifier: BSD-3-Clause
// PointCloudBlob.h without PCL: .pcd files alone.
#include "Filters/Readers/PCDData.h"
#include "Filters/Readers/PointCloudBlob.h"
#include "Filters/Readers/PointCloudHeader.h"

#include <algorithm>
#include <fstream>
#include <stdexcept>

namespace PointCloud
{
Blob ReadBlob(const std::string& path)
{
  if (CheckFile(path) != Format::PCD)
  {
    throw std::runtime_error("a .ply file: open it with ParaView's own PLY reader.");
  }
  std::ifstream file(path, std::ios::binary);
  const PCDHeader header = ReadPCDHeader(file);
  Blob blob;
  blob.Cloud = ReadPCDData(file, header);
  std::copy_n(header.Viewpoint, 3, blob.Viewpoint);
  blob.HasViewpoint = header.Height > 1 ||
    std::any_of(header.Viewpoint, header.Viewpoint + 3, [](double v) { return v != 0.0; });
  return blob;
}
}
