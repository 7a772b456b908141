// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Readers/PointCloudFile.h"

#include "Filters/Readers/PCDDecoder.h"
#include "Filters/Readers/PLYFile.h"
#include "Filters/Readers/PointCloudHeader.h"

#include <algorithm>
#include <fstream>

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
  PointCloudFile result;
  result.Cloud = ReadPLY(path);
  return result;
}
}
