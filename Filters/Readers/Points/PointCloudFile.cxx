// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Readers/Points/PointCloudFile.h"

#include "Filters/Readers/Points/PCDDecoder.h"
#include "Filters/Readers/Points/PointCloudHeader.h"
#ifdef SURFELSPLATTING_READ_PLY
#include "Filters/Readers/Points/PLYFile.h"
#endif

#include <algorithm>
#include <fstream>
#include <stdexcept>

namespace PointCloud
{
namespace
{
PointCloudFile ReadPCD(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  const PCDHeader header = ReadPCDHeader(file);
  PointCloudFile result;
  result.Cloud = DecodePCD(file, header);
  std::copy_n(header.Viewpoint, 3, result.Viewpoint);
  result.HasViewpoint = header.Height > 1 ||
    std::any_of(header.Viewpoint, header.Viewpoint + 3, [](double v) { return v != 0.0; });
  return result;
}
}

PointCloudFile ReadPointCloudFile(const std::string& path)
{
  if (CheckFile(path) == Format::PCD)
  {
    return ReadPCD(path);
  }
#ifdef SURFELSPLATTING_READ_PLY
  PointCloudFile result;
  result.Cloud = ReadPLY(path);
  return result;
#else
  throw std::runtime_error("a .ply file: open it with ParaView's own PLY reader.");
#endif
}
}
