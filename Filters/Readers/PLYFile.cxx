// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Readers/PLYFile.h"

#include <pcl/PCLPointCloud2.h>
#include <pcl/console/print.h>
#include <pcl/io/ply_io.h>

#include <cstdint>
#include <stdexcept>
#include <utility>

namespace PointCloud
{
namespace
{
/// Keeps PCL from writing to stderr: errors go through VTK's error macros.
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

Field::Types TypeOf(std::uint8_t datatype)
{
  switch (datatype)
  {
    case pcl::PCLPointField::BOOL:
      return Field::BOOL;
    case pcl::PCLPointField::INT8:
      return Field::INT8;
    case pcl::PCLPointField::UINT8:
      return Field::UINT8;
    case pcl::PCLPointField::INT16:
      return Field::INT16;
    case pcl::PCLPointField::UINT16:
      return Field::UINT16;
    case pcl::PCLPointField::INT32:
      return Field::INT32;
    case pcl::PCLPointField::UINT32:
      return Field::UINT32;
    case pcl::PCLPointField::INT64:
      return Field::INT64;
    case pcl::PCLPointField::UINT64:
      return Field::UINT64;
    case pcl::PCLPointField::FLOAT32:
      return Field::FLOAT32;
    case pcl::PCLPointField::FLOAT64:
      return Field::FLOAT64;
    default:
      return Field::UNKNOWN;
  }
}

/// Moves the data out of `cloud`.
FieldCloud ToFieldCloud(pcl::PCLPointCloud2& cloud)
{
  FieldCloud result;
  result.Width = cloud.width;
  result.Height = cloud.height;
  result.PointStep = cloud.point_step;
  for (const pcl::PCLPointField& field : cloud.fields)
  {
    result.Fields.push_back({ field.name, field.offset, TypeOf(field.datatype), field.count });
  }
  result.Data = std::move(cloud.data);
  return result;
}
}

//------------------------------------------------------------------------------
FieldCloud ReadPLY(const std::string& path)
{
  QuietPCL quiet;
  pcl::PCLPointCloud2 cloud;
  Eigen::Vector4f origin = Eigen::Vector4f::Zero();
  Eigen::Quaternionf orientation = Eigen::Quaternionf::Identity();
  int version = 0;
  const int status = pcl::PLYReader().read(path, cloud, origin, orientation, version);
  const auto points = static_cast<std::uint64_t>(cloud.width) * cloud.height;
  if (status < 0 || cloud.data.size() < points * cloud.point_step)
  {
    throw std::runtime_error(
      "the header or the data is damaged or cut short (pcl_io cannot read it).");
  }
  return ToFieldCloud(cloud);
}
}
