// SPDX-License-Identifier: BSD-3-Clause
/**
 * Files of arrays: what was written is there, every damage is found, and wild values that no
 * checksum has stopped do not stop a frame.
 */
#include "Core/Files/ArrayFileWriter.h"
#include "Core/Files/Checksum.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <unistd.h>

using namespace SurfelSplatting;

namespace
{
/// A path of this process that is removed at the end.
class TemporaryPath
{
public:
  TemporaryPath()
    : Path((std::filesystem::temp_directory_path() /
        ("ArrayFile." + std::to_string(getpid()) + ".surfels"))
             .string())
  {
  }
  ~TemporaryPath() { std::remove(this->Path.c_str()); }

  const std::string Path;
};

StoredArray Stored(
  const char* name, ArrayRole role, ArrayType type, std::uint32_t components, std::uint64_t tuples)
{
  StoredArray array;
  array.Name = name;
  array.Role = role;
  array.Type = type;
  array.Components = components;
  array.Tuples = tuples;
  return array;
}

/// Three arrays: 999 points, 999 bytes, none.
void WriteExample(const std::string& path)
{
  ArrayFileWriter writer(path,
    { Stored("Points", ArrayRole::Points, ArrayType::Float32, 3, 999),
      Stored("side", ArrayRole::PointData, ArrayType::UInt8, 1, 999),
      Stored("nothing", ArrayRole::FieldData, ArrayType::Float64, 2, 0) });
  for (int i = 0; i < 999; ++i)
  {
    writer.Data<float>(0)[3 * i] = static_cast<float>(i);
    writer.Data<unsigned char>(1)[i] = static_cast<unsigned char>(i % 251);
  }
  writer.Finish(ThreadExecutor(2));
}

std::string ReadAll(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(file), {});
}

void WriteAll(const std::string& path, const std::string& content)
{
  std::remove(path.c_str()); // a file that is cut to nothing waits for the disk when it is closed
  std::ofstream(path, std::ios::binary | std::ios::trunc) << content;
}

/// What is wrong with a file; empty: nothing.
std::string ProblemOf(const std::string& path)
{
  try
  {
    ArrayFile(path, SerialExecutor());
    return std::string();
  }
  catch (const std::exception& problem)
  {
    return problem.what();
  }
}

TEST_CASE("Checksum")
{
  CHECK(Checksum("123456789", 9) == 0xe3069283u); // the check value of CRC-32C
  CHECK(Checksum("", 0) == 0u);
  const std::string text = "in parts, or as a whole, it is the same";
  CHECK(Checksum(text.data() + 7, text.size() - 7, Checksum(text.data(), 7)) ==
    Checksum(text.data(), text.size()));
  CHECK(ChecksumByTable(text.data(), text.size()) == Checksum(text.data(), text.size()));
}

TEST_CASE("Round trip")
{
  const TemporaryPath file;
  WriteExample(file.Path);
  const std::string content = ReadAll(file.Path);
  const ArrayFile read(file.Path, SerialExecutor());
  REQUIRE(read.Arrays().size() == 3);
  const StoredArray& points = read.Arrays()[0];
  CHECK(points.Name == "Points");
  CHECK(points.Role == ArrayRole::Points);
  CHECK(points.Type == ArrayType::Float32);
  CHECK(points.Components == 3);
  CHECK(points.Tuples == 999);
  CHECK(points.Begin % FilePage == 0);
  CHECK(read.Arrays()[2].Bytes() == 0);
  auto* positions = reinterpret_cast<float*>(read.Data(points));
  CHECK(positions[3 * 998] == 998.0f);
  CHECK(read.Data(read.Arrays()[1])[500] == 500 % 251);
  CHECK(read.Contains(positions));
  CHECK(!read.Contains(&file));
  positions[0] = 7.0f; // stays in this process
  CHECK(ReadAll(file.Path) == content);
}

TEST_CASE("An unfinished file is none")
{
  const TemporaryPath file;
  WriteAll(file.Path, "before");
  {
    ArrayFileWriter writer(
      file.Path, { Stored("Points", ArrayRole::Points, ArrayType::Float32, 3, 10) });
  }
  CHECK(ReadAll(file.Path) == "before");
  CHECK(!std::filesystem::exists(file.Path + "." + std::to_string(getpid()) + ".part"));
  CHECK_THROWS(ArrayFileWriter("/no/such/folder/file.surfels", {}));
}

/// Any byte that differs is found, wherever it is; so is any other length.
TEST_CASE("Damage")
{
  const TemporaryPath file;
  WriteExample(file.Path);
  const std::string whole = ReadAll(file.Path);
  CHECK(ProblemOf(file.Path).empty());
  Random random(1);
  for (int i = 0; i < 250; ++i)
  {
    std::string content = whole;
    const bool inHeader = i % 2 == 0;
    const auto place = static_cast<std::size_t>(
      random.Integer(0, inHeader ? 64 + 3 * 128 - 1 : static_cast<int>(whole.size()) - 1));
    // Between the records and the first page nothing is read.
    const bool isRead = place < 64 + 3 * 128 || place >= FilePage;
    content[place] = static_cast<char>(content[place] ^ 1 << random.Integer(0, 7));
    WriteAll(file.Path, content);
    CHECK(ProblemOf(file.Path).empty() == !isRead);
    WriteAll(file.Path,
      whole.substr(
        0, static_cast<std::size_t>(random.Integer(0, static_cast<int>(whole.size()) - 1))));
    CHECK(!ProblemOf(file.Path).empty());
  }
  WriteAll(file.Path, whole + "more");
  CHECK(ProblemOf(file.Path).find("instead of") != std::string::npos);
}

/// Their values mean something else: the extents of version 1 would draw too many splats, and a
/// program of version 1 would draw too few of these.
TEST_CASE("Files of another version")
{
  const TemporaryPath file;
  WriteExample(file.Path);
  std::string content = ReadAll(file.Path);
  REQUIRE(content[12] == 2);
  for (const char version : { 1, 3 })
  {
    content[12] = version;
    WriteAll(file.Path, content);
    CHECK(ProblemOf(file.Path) ==
      "its format is version " + std::to_string(version) +
        ", and this program reads 2 only; make it again from its points, or read it with the "
        "program that wrote it");
  }
}

/// Records with a right checksum and any values, as somebody might make them on purpose.
TEST_CASE("Forged headers")
{
  const TemporaryPath file;
  WriteExample(file.Path);
  const std::string whole = ReadAll(file.Path);
  Random random(2);
  int read = 0;
  for (int i = 0; i < 250; ++i)
  {
    std::string content = whole;
    const auto place = static_cast<std::size_t>(random.Integer(16, 64 + 3 * 128 - 8));
    const std::uint64_t wild = i % 3 == 0 ? random.Bits()
      : i % 3 == 1                        ? static_cast<std::uint64_t>(random.Integer(0, 9))
                                          : ~std::uint64_t{ 0 } >> random.Integer(0, 63);
    std::memcpy(&content[place], &wild, static_cast<std::size_t>(random.Integer(1, 8)));
    std::memset(&content[44], 0, 4);
    const std::uint32_t sum = Checksum(content.data(), 64 + 3 * 128);
    std::memcpy(&content[44], &sum, 4);
    WriteAll(file.Path, content);
    try
    {
      const ArrayFile forged(file.Path, SerialExecutor());
      ++read;
      for (const StoredArray& array : forged.Arrays())
      {
        // All of it is there.
        CHECK(Checksum(forged.Data(array), array.Bytes()) <= 0xffffffffu);
      }
    }
    catch (const std::runtime_error&)
    {
    }
  }
  CHECK(read > 20); // names, for example, may be any
  CHECK(read < 230);
}

/// VTK's arrays are found by the places of their values: two at one place would be released twice.
TEST_CASE("Two arrays at one place")
{
  const TemporaryPath file;
  WriteExample(file.Path);
  std::string content = ReadAll(file.Path);
  constexpr std::size_t begin = 120; // in a record
  std::memcpy(&content[64 + 128 + begin], &content[64 + begin], 8);
  std::memset(&content[44], 0, 4);
  const std::uint32_t sum = Checksum(content.data(), 64 + 3 * 128);
  std::memcpy(&content[44], &sum, 4);
  WriteAll(file.Path, content);
  CHECK(ProblemOf(file.Path).find("side") != std::string::npos);
}

/// The arrays of a large file are checked page by page, where they are needed.
TEST_CASE("Large files")
{
  const TemporaryPath file;
  constexpr std::uint64_t count = 40 << 20;
  {
    ArrayFileWriter writer(
      file.Path, { Stored("Points", ArrayRole::Points, ArrayType::UInt8, 1, count) });
    std::memset(writer.Data<unsigned char>(0), 3, count);
    writer.Finish(ThreadExecutor(2));
  }
  {
    std::fstream damaged(file.Path, std::ios::binary | std::ios::in | std::ios::out);
    damaged.seekp(FilePage + 5 * FilePage + 17);
    damaged.put(4);
  }
  const ArrayFile read(file.Path, SerialExecutor());
  const unsigned char* data = read.Data(read.Arrays()[0]);
  read.Need(data, 5 * FilePage);
  read.Need(data + 6 * FilePage, count - 6 * FilePage);
  read.Need(&file, 1); // another memory
  CHECK_THROWS_AS(read.Need(data + 6 * FilePage - 1, 1), DamagedMemory);
  CHECK_THROWS_AS(read.Need(data + 5 * FilePage - 1, 2), DamagedMemory);
  CHECK_THROWS_AS(read.CheckAll(ThreadExecutor(2)), DamagedMemory);
}

TestCloud Ball(int count, Random& random)
{
  TestCloud cloud;
  for (int i = 0; i < count; ++i)
  {
    TestSurfel s;
    s.Normal = random.Direction();
    s.Position = { s.Normal[0], s.Normal[1], 4.0 + s.Normal[2] };
    s.Area = 14.0 / count;
    s.SigmaU = s.SigmaV = 0.5 * std::sqrt(s.Area);
    s.TwoSided = i % 3 == 0;
    s.Color = { { static_cast<float>(random()), 0.5f, 0.2f, 1.0f } };
    cloud.Add(s);
  }
  return cloud;
}

SplatContext LensContext()
{
  SplatContext context;
  context.Camera = PinholeView(64, 64, 90.0);
  context.Optics.FocalDistance = 3.0;
  context.Optics.Radius = 0.1;
  return context;
}

/// Bounds of clusters from a file give the frame of those that were computed; a frame with damage
/// ends with an exception, at any number of threads.
TEST_CASE("Frames from a file")
{
  Random random(3);
  const TestHierarchy hierarchy(Ball(20000, random));
  const HierarchyLayout& layout = hierarchy.Order.Layout;
  const std::size_t entries = ClusterBounds::NumberOfEntries(layout);
  SurfelCloud cloud = hierarchy.Get();
  const TemporaryPath path;
  {
    ArrayFileWriter writer(path.Path,
      { Stored("nodes", ArrayRole::PointData, ArrayType::UInt8, sizeof(HierarchyNode),
          hierarchy.Nodes.size()),
        Stored(
          "clusters", ArrayRole::PointData, ArrayType::UInt8, sizeof(ClusterBounds::Node), entries),
        Stored("extents", ArrayRole::PointData, ArrayType::UInt8,
          ClusterBounds::LevelsBelow * sizeof(NodeExtent), entries),
        Stored(
          "more", ArrayRole::PointData, ArrayType::UInt8, 1, 33 << 20) }); // not checked at once
    std::copy(hierarchy.Nodes.begin(), hierarchy.Nodes.end(), writer.Data<HierarchyNode>(0));
    ClusterBounds::Fill(cloud, layout, ThreadExecutor(2), writer.Data<ClusterBounds::Node>(1),
      writer.Data<NodeExtent>(2));
    writer.Finish(ThreadExecutor(2));
  }
  const auto draw = [&](const Executor& executor) {
    const ArrayFile file(path.Path, executor);
    const auto at = [&file](int i) { return file.Data(file.Arrays()[i]); };
    const ClusterBounds bounds(layout, reinterpret_cast<const ClusterBounds::Node*>(at(1)),
      reinterpret_cast<const NodeExtent*>(at(2)));
    SurfelCloud mapped = cloud;
    mapped.Nodes = reinterpret_cast<const HierarchyNode*>(at(0));
    mapped.Clusters = &bounds;
    mapped.Guard = &file;
    return RenderPicture(LensContext(), { mapped }, executor);
  };
  CHECK(Same(draw(ThreadExecutor(2)), RenderPicture(LensContext(), { cloud })));
  for (const std::uint64_t array : { 0, 1, 2 })
  {
    std::uint64_t begin = 0, bytes = 0;
    {
      const ArrayFile file(path.Path, SerialExecutor());
      begin = file.Arrays()[array].Begin;
      bytes = file.Arrays()[array].Bytes();
    }
    const std::string whole = ReadAll(path.Path);
    std::string content = whole;
    for (std::uint64_t i = 0; i < bytes; i += FilePage)
    {
      content[begin + i] = static_cast<char>(content[begin + i] ^ 1);
    }
    WriteAll(path.Path, content);
    CHECK_THROWS_AS(draw(SerialExecutor()), DamagedMemory);
    CHECK_THROWS_AS(draw(ThreadExecutor(4)), DamagedMemory);
    WriteAll(path.Path, whole);
  }
}

/// Sets some values of an array to bits that mean something else, and to the worst floats.
template <typename Value>
void Spoil(std::vector<Value>& values, Random& random)
{
  auto* bytes = reinterpret_cast<unsigned char*>(values.data());
  const int words = static_cast<int>(values.size() * sizeof(Value) / 4);
  const std::uint32_t floats[] = { 0x7fc00000u, 0x7f800000u, 0xff800000u, 0x7f7fffffu, 0x00000001u,
    0xffffffffu, 0xbf800000u, 0u };
  for (int i = 0; i < words / 50 + 1; ++i)
  {
    const std::uint32_t value =
      i % 2 ? static_cast<std::uint32_t>(random.Bits()) : floats[random.Integer(0, 7)];
    std::memcpy(bytes + 4 * static_cast<std::size_t>(random.Integer(0, words - 1)), &value, 4);
  }
}

TEST_CASE("Wild values")
{
  Random random(4);
  const TestCloud ball = Ball(3000, random);
  TestHierarchy whole(ball);
  const HierarchyLayout& layout = whole.Order.Layout;
  const std::size_t entries = ClusterBounds::NumberOfEntries(layout);
  std::vector<ClusterBounds::Node> clusters(entries);
  std::vector<NodeExtent> extents(ClusterBounds::LevelsBelow * entries);
  ClusterBounds::Fill(whole.Get(), layout, SerialExecutor(), clusters.data(), extents.data());
  int drawn = 0;
  for (int i = 0; i < 200; ++i)
  {
    std::vector<HierarchyNode> nodes = whole.Nodes;
    std::vector<NodeColor> colors = whole.Colors;
    std::vector<ClusterBounds::Node> wildClusters = clusters;
    std::vector<NodeExtent> wildExtents = extents;
    std::vector<float> positions = whole.Positions, covariances = whole.Covariances;
    Spoil(nodes, random);
    Spoil(colors, random);
    Spoil(positions, random);
    Spoil(covariances, random);
    if (i % 2)
    {
      Spoil(wildClusters, random);
      Spoil(wildExtents, random);
    }
    const ClusterBounds bounds(layout, wildClusters.data(), wildExtents.data());
    SurfelCloud cloud = whole.Get();
    cloud.Nodes = nodes.data();
    cloud.NodeColors = colors.data();
    cloud.PositionsFloat = positions.data();
    cloud.Covariances = covariances.data();
    cloud.Clusters = &bounds;
    SplatContext context = LensContext();
    context.Cut.Error = i % 3;
    context.Optics.Radius = i % 5 ? 0.1 : 0.0;
    Splatter splatter;
    Picture picture(64, 64);
    splatter.Render(context, { cloud }, SerialExecutor(), picture.Get());
    drawn += splatter.Statistics().Splats > 0 ? 1 : 0;
  }
  CHECK(drawn > 150);
}
}
