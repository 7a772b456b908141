// SPDX-License-Identifier: BSD-3-Clause
#include "PointCloudBlob.h"

#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>

#include <cstdint>
#include <fstream>
#include <limits>
#include <sstream>
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

struct Header
{
  std::uint64_t Points = 0;
  bool Compressed = false;
};

// What the header declares, without building anything of that size.
Header ReadHeader(const std::string& path, Format format)
{
  Header header;
  std::ifstream file(path, std::ios::binary);
  std::string line;
  while (std::getline(file, line))
  {
    std::istringstream words(line);
    std::string key, kind;
    words >> key;
    if (format == Format::PLY && key == "element" && words >> kind && kind == "vertex")
    {
      words >> header.Points;
    }
    else if (format == Format::PCD && key == "POINTS")
    {
      words >> header.Points;
    }
    else if (key == "DATA")
    {
      header.Compressed = words >> kind && kind == "binary_compressed";
      break;
    }
    else if (key == "end_header")
    {
      break;
    }
  }
  return header;
}

// A wrong count would make PCL reserve, and search for, all that it promises: a point takes at
// least three bytes unless it is compressed, and VTK's dimensions are int.
void CheckHeader(const std::string& path, Format format)
{
  const Header header = ReadHeader(path, format);
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const auto bytes = static_cast<std::uint64_t>(file.tellg());
  if ((!header.Compressed && header.Points > bytes / 3) ||
    header.Points > static_cast<std::uint64_t>(std::numeric_limits<int>::max()))
  {
    throw std::runtime_error("the header announces " + std::to_string(header.Points) +
      " points, the file has only " + std::to_string(bytes) +
      " bytes; it is cut short or its header is wrong.");
  }
}
}

//------------------------------------------------------------------------------
Format FindFormat(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  std::string line;
  // A .pcd file may begin with comments; a binary file of another kind has no short lines.
  for (int number = 0; number < 64 && std::getline(file, line) && line.size() < 4096; ++number)
  {
    std::string key;
    std::istringstream(line) >> key;
    if (number == 0 && key == "ply")
    {
      return Format::PLY;
    }
    if (key == "VERSION" || key == "FIELDS" || key == "COLUMNS")
    {
      return Format::PCD;
    }
    if (!key.empty() && key[0] != '#')
    {
      return Format::Unknown;
    }
  }
  return Format::Unknown;
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
