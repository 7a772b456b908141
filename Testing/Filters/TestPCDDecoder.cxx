// SPDX-License-Identifier: BSD-3-Clause
// The .pcd decoder gives what pcl_io gives, byte by byte: for pcl_io's own files in all three
// forms, with every type, several values in a field, padding and NaN. Damaged data gives errors.
#include "Filters/Readers/Points/PCDDecoder.h"
#include "Filters/Readers/Points/PointCloudHeader.h"
#include "SurfelTesting.h"

#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

using namespace SurfelTesting;

namespace
{
const char* const Path = "TestPCDDecoder.pcd";

/// Removes the file when a test ends.
struct TemporaryFile
{
  ~TemporaryFile() { std::remove(Path); }
};

/// Positions, a colour, a normal and an integer; some of it alike, so that it can be packed.
using Points = pcl::PointCloud<pcl::PointXYZRGBNormal>;
Points MakeCloud(int count)
{
  Random random(1);
  Points cloud;
  for (int i = 0; i < count; ++i)
  {
    pcl::PointXYZRGBNormal p;
    p.x = static_cast<float>(random());
    p.y = i % 3 == 0 ? 0.25f : static_cast<float>(1e6 * random());
    p.z = i % 7 == 0 ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(i / 50);
    p.r = static_cast<std::uint8_t>(i);
    p.normal_z = 1.0f;
    p.curvature = static_cast<float>(1e-9 * random());
    cloud.push_back(p);
  }
  cloud.sensor_origin_ = Eigen::Vector4f(1.5f, -2.0f, 3.0f, 0.0f);
  return cloud;
}

/// With bytes between the fields, as they are in memory.
pcl::PCLPointCloud2 MakePaddedCloud(int count)
{
  pcl::PointCloud<pcl::PointXYZI> cloud;
  for (int i = 0; i < count; ++i)
  {
    pcl::PointXYZI p;
    p.x = p.y = p.z = static_cast<float>(i);
    p.intensity = static_cast<float>(i % 10);
    cloud.push_back(p);
  }
  pcl::PCLPointCloud2 blob;
  pcl::toPCLPointCloud2(cloud, blob);
  return blob;
}

PointCloud::FieldCloud Read()
{
  PointCloud::CheckFile(Path);
  std::ifstream file(Path, std::ios::binary);
  const PointCloud::PCDHeader header = PointCloud::ReadPCDHeader(file);
  return PointCloud::DecodePCD(file, header);
}

/// Whether a float or double is a NaN; there are many bit patterns of NaN.
bool IsNaN(const std::uint8_t* value, std::size_t bytes)
{
  float single = 0.0f;
  double real = 0.0;
  std::memcpy(&single, value, bytes == sizeof(single) ? bytes : 0);
  std::memcpy(&real, value, bytes == sizeof(real) ? bytes : 0);
  return std::isnan(single) || std::isnan(real);
}

void CompareWithPCL()
{
  const PointCloud::FieldCloud own = Read();
  pcl::PCLPointCloud2 expected;
  CHECK(pcl::PCDReader().read(Path, expected) == 0);
  CHECK(own.Width == expected.width);
  CHECK(own.Height == expected.height);
  std::size_t next = 0;
  for (const pcl::PCLPointField& field : expected.fields)
  {
    while (next < own.Fields.size() && own.Fields[next].Name != field.name)
    {
      ++next; // padding, which pcl_io drops
    }
    CHECK(next < own.Fields.size());
    const PointCloud::Field& ownField = own.Fields[next++];
    const std::size_t bytes = ownField.Count * PointCloud::SizeOf(ownField.Type);
    CHECK(ownField.Count == field.count);
    CHECK(SizeOf(ownField.Type) == pcl::getFieldSize(field.datatype));
    bool same = true;
    for (std::size_t i = 0; i < std::size_t(own.Width) * own.Height; ++i)
    {
      const auto* a = own.Data.data() + i * own.PointStep + ownField.Offset;
      const auto* b = expected.data.data() + i * expected.point_step + field.offset;
      same = same && (std::memcmp(a, b, bytes) == 0 || (IsNaN(a, bytes) && IsNaN(b, bytes)));
    }
    CHECK(same);
  }
}

TEST_CASE_FIXTURE(TemporaryFile, "Files of PCL")
{
  pcl::PCDWriter writer;
  const pcl::PCLPointCloud2 padded = MakePaddedCloud(3000);
  writer.writeASCII(Path, padded);
  CompareWithPCL();
  writer.writeBinary(Path, padded);
  CompareWithPCL();
  writer.writeBinaryCompressed(Path, padded);
  CompareWithPCL();
  const Points cloud = MakeCloud(5000);
  writer.writeASCII(Path, cloud, 9);
  CompareWithPCL();
  writer.writeBinary(Path, cloud);
  CompareWithPCL();
  writer.writeBinaryCompressed(Path, cloud);
  CompareWithPCL();
  std::ifstream file(Path, std::ios::binary);
  const PointCloud::PCDHeader header = PointCloud::ReadPCDHeader(file);
  CHECK_NEAR(header.Viewpoint[0], 1.5, 0.0);
  CHECK_NEAR(header.Viewpoint[1], -2.0, 0.0);
  CHECK_NEAR(header.Viewpoint[2], 3.0, 0.0);
}

void Write(const std::string& text)
{
  std::ofstream(Path, std::ios::binary) << text;
}

const std::string Head = "VERSION 0.7\nFIELDS x y z a b c\nSIZE 4 8 4 1 8 2\nTYPE F F F I U U\n"
                         "COUNT 1 1 1 2 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n";
const std::string Integers = "VERSION 0.7\nFIELDS a b c\nSIZE 1 4 8\nTYPE U U U\nCOUNT 1 1 1\n"
                             "WIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n";

TEST_CASE_FIXTURE(TemporaryFile, "Types")
{
  Write(Head + "1 -2.5e3 inf -128 127 1234567890123 65535\n0.1 nan 3 1.0 2 9 0\n");
  CompareWithPCL();
  // Whole numbers with a decimal point, up to the largest; negative ones in unsigned fields.
  Write(Head + "1 2 3 127.0 -128.0 9 65535.0\n1 2 3 4 5 -6 -1\n");
  CompareWithPCL();
  Write(Integers + "255.0 -1 -9223372036854775808\n255 4294967295.0 4611686018427387904\n");
  CompareWithPCL();
  Write(Integers + "255.0 1 18446744073709551615\n255 1 -1\n"); // pcl_io rounds the large one
  const auto points = Read().Data;
  CHECK(points[0] == 255);
  CHECK(std::equal(points.begin(), points.begin() + 13, points.begin() + 13));
}

TEST_CASE_FIXTURE(TemporaryFile, "Lines")
{
  const std::string first = "1 2 3 4 5 6 7", second = "8 9 10 11 12 13 14";
  for (const std::string& data : { first + "\n" + second, first + "\n\n" + second + "\n",
         first + "\r\n" + second + "\r\n", "\n \t" + first + " \t\n" + second + " \n" })
  {
    Write(Head + data);
    CompareWithPCL();
  }
  // pcl_io takes a line of white space for a damaged point.
  const auto expected = Read().Data;
  for (const char* const end : { "\n \t\n", "\r\n\r\n" })
  {
    Write(Head + first + end + second + end);
    CHECK(Read().Data == expected);
  }
}

TEST_CASE_FIXTURE(TemporaryFile, "Padding")
{
  Write("VERSION 0.7\nFIELDS x _ y _\nSIZE 4 1 4 4\nTYPE F U F U\nCOUNT 1 3 1 1\nWIDTH 2\n"
        "HEIGHT 1\nPOINTS 2\nDATA ascii\n1 nan nan nan 2 nan\n3 0 1 2 4 -\n");
  CompareWithPCL();
}

std::string ErrorOf(const std::string& text)
{
  Write(text);
  try
  {
    Read();
  }
  catch (const std::runtime_error& error)
  {
    return error.what();
  }
  return std::string();
}

/// What a header promises beyond the file's size takes no memory.
TEST_CASE_FIXTURE(TemporaryFile, "Fields of many values")
{
  std::string head = Head;
  head.replace(head.find("1 1 1 2"), 7, "1 1 65536 2");
  CHECK(ErrorOf(head + "1 2 3 4 5 6 7\n1 2 3 4 5 6 7\n").find("promises 2 points") !=
    std::string::npos);
  constexpr int count = 100;
  pcl::PCDWriter().writeBinaryCompressed(Path, MakePaddedCloud(count));
  const auto expected = Read().Data;
  std::ifstream file(Path, std::ios::binary);
  std::string text{ std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>() };
  for (const auto& [line, padding] : { std::pair<std::string, std::string>{ "FIELDS", " _" },
         { "SIZE", " 8" }, { "TYPE", " F" }, { "COUNT", " 65536" } })
  {
    text.insert(text.find('\n', text.find("\n" + line) + 1), padding);
  }
  CHECK(ErrorOf(text).empty());
  CHECK(Read().Fields.size() == 4);
  CHECK(Read().Data == expected);
}

TEST_CASE_FIXTURE(TemporaryFile, "Lines of the wrong length")
{
  const std::string line = "1 2 3 4 5 6 7\n";
  CHECK(
    ErrorOf(Head + "1 2 3 4 5 6 7 8 9 0 1 2 3 4\n") == "line 10 has 14 values, but a point has 7.");
  CHECK(ErrorOf(Head + line + "1 2 3 4 5 6\n") == "line 11 has 6 values, but a point has 7.");
  CHECK(ErrorOf(Head + "\n1 2 3 4 5 6\n7\n" + line) == "line 11 has 6 values, but a point has 7.");
  CHECK(ErrorOf("# by hand\n\n" + Head + "1 2 3 4 5 6 7 8\r\n" + line) ==
    "line 12 has 8 values, but a point has 7.");
  CHECK(ErrorOf(Head + line + "            \n\n") == "the data ends after 1 points.");
}

TEST_CASE_FIXTURE(TemporaryFile, "Damage")
{
  CHECK(ErrorOf(Head + "1 2 3 4 5 6 7       \n1 2 3").find("ends after 1") != std::string::npos);
  CHECK(ErrorOf(Head + "1 2 3 4 5 6 7\n1 two 3 4 5 6 7\n").find("line 11, field y") !=
    std::string::npos);
  CHECK(ErrorOf(Head + "+1 1e-60 1e-60 +4 5 6 7\n1 2 3 4 5 6 7\n").empty());
  CHECK(ErrorOf(Head + "1 2 3 999 5 6 7\n1 2 3 4 5 6 7\n").find("999") != std::string::npos);
  CHECK(ErrorOf(Integers + "256 1 1\n1 1 1\n").find("256") != std::string::npos);
  CHECK(ErrorOf(Integers + "256.0 1 1\n1 1 1\n").find("256.0") != std::string::npos);
  CHECK(ErrorOf(Integers + "-129 1 1\n1 1 1\n").find("-129") != std::string::npos);
  CHECK(ErrorOf(Integers + "1 1 1\n1 1 -9223372036854775809\n").find("-92") != std::string::npos);
  // Every byte of a packed file changed, or the end missing: an error or other numbers, no crash.
  pcl::PCDWriter().writeBinaryCompressed(Path, MakeCloud(40));
  std::ifstream file(Path, std::ios::binary);
  const std::string intact{ std::istreambuf_iterator<char>(file),
    std::istreambuf_iterator<char>() };
  CHECK(ErrorOf(intact).empty());
  const std::size_t begin = intact.find("compressed\n") + 11;
  int errors = 0;
  for (std::size_t i = begin; i < intact.size(); ++i)
  {
    for (const char change : { '\x00', '\xff', '\x25' })
    {
      std::string bad = intact;
      bad[i] = change;
      errors += ErrorOf(bad).empty() ? 0 : 1;
    }
    CHECK(!ErrorOf(intact.substr(0, i)).empty());
  }
  CHECK(errors > 0);
}
}
