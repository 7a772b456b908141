// SPDX-License-Identifier: BSD-3-Clause
#include "PointCloudBlob.h"

#include "PointCloudHeader.h"

#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <stdexcept>

namespace PointCloud
{
namespace
{
// PCL writes its findings to stderr; ours go through VTK's error macros.
class QuietPCL
{
public:
  QuietPCL()
    : Level(pcl::console::getVerbosityLevel())
  {
    pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  }
  ~QuietPCL() { pcl::console::setVerbosityLevel(this->Level); }
  QuietPCL(const QuietPCL&) = delete;
  QuietPCL& operator=(const QuietPCL&) = delete;

private:
  pcl::console::VERBOSITY_LEVEL Level;
};
}

//------------------------------------------------------------------------------
Blob ReadBlob(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  if (!file || file.peek() == std::ifstream::traits_type::eof())
  {
    throw std::runtime_error(
      file.is_open() ? "the file is empty." : "the file cannot be opened; check name and rights.");
  }
  const Format format = FindFormat(path);
  if (format == Format::Unknown)
  {
    throw std::runtime_error("neither a .ply nor a .pcd file by its first bytes.");
  }
  CheckHeader(path, format);

  QuietPCL quiet;
  Blob blob;
  Eigen::Vector4f origin = Eigen::Vector4f::Zero();
  Eigen::Quaternionf orientation = Eigen::Quaternionf::Identity();
  int version = 0;
  const int status = format == Format::PLY
    ? pcl::PLYReader().read(path, blob.Cloud, origin, orientation, version)
    : pcl::PCDReader().read(path, blob.Cloud, origin, orientation, version);
  const auto points = static_cast<std::uint64_t>(blob.Cloud.width) * blob.Cloud.height;
  if (status < 0 || blob.Cloud.data.size() < points * blob.Cloud.point_step)
  {
    throw std::runtime_error("the header or the data is broken or cut short (pcl_io gave up).");
  }
  if (format == Format::PCD)
  {
    std::copy_n(origin.data(), 3, blob.Viewpoint);
    blob.HasViewpoint = blob.Cloud.height > 1 || !origin.head<3>().isZero();
  }
  return blob;
}
}
