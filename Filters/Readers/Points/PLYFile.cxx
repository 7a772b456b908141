// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Readers/Points/PLYFile.h"

#include "Filters/Common/FaceLimit.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Readers/Points/TextPoints.h"

#include "vtkNew.h"

#include <pcl/io/ply/ply_parser.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <fstream>
#include <functional>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

namespace PointCloud
{
namespace
{
using Parser = pcl::io::ply::ply_parser;
using Bytes = SurfelGeometry::RawVector<std::uint8_t>;

template <typename Value>
Field::Types TypeOf()
{
  constexpr Field::Types integers[] = { Field::INT8, Field::UINT8, Field::INT16, Field::UINT16,
    Field::INT32, Field::UINT32 };
  constexpr int rank = sizeof(Value) / 2; // of 1, 2 and 4 bytes
  if (std::numeric_limits<Value>::is_integer)
  {
    return integers[2 * rank + (std::numeric_limits<Value>::is_signed ? 0 : 1)];
  }
  return sizeof(Value) == 4 ? Field::FLOAT32 : Field::FLOAT64;
}

template <typename Value>
void Append(Bytes& data, Value value)
{
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(&value);
  data.insert(data.end(), bytes, bytes + sizeof value);
}

/// The point of cells of a range grid that have none: NaN, and 0 where there is no NaN.
Bytes MissingPoint(const FieldCloud& cloud)
{
  Bytes point;
  for (const Field& field : cloud.Fields)
  {
    if (field.Type == Field::FLOAT32)
    {
      Append(point, std::numeric_limits<float>::quiet_NaN());
    }
    else if (field.Type == Field::FLOAT64)
    {
      Append(point, std::numeric_limits<double>::quiet_NaN());
    }
    else
    {
      point.resize(point.size() + SizeOf(field.Type));
    }
  }
  return point;
}

/// The product may overflow.
bool IsProduct(std::uint64_t product, std::uint64_t a, std::uint64_t b)
{
  return a > 0 && product % a == 0 && product / a == b;
}

/// What the parser finds, in the order of the file. Elements and properties that it is not told to
/// keep are skipped by it.
class Contents
{
public:
  bool Read(const std::string& path);
  FieldCloud TakeCloud();

private:
  static constexpr std::int64_t NoPoint = -1;

  Parser::element_callbacks_type AddElement(const std::string& name, std::size_t count);
  void ReadObjectInfo(const std::string& line);
  void EndFace();
  bool FindBlock(const std::string& path);
  bool ReadBlock(const std::string& path);
  bool HasTextPoints() const;
  void ReadText(const std::string& path);
  void ArrangeInGrid();

  template <typename Value>
  std::function<void(Value)> AddProperty(const std::string& element, const std::string& name);
  template <typename Size, typename Value>
  void AddListCallback(Parser::list_property_definition_callbacks_type& callbacks);
  template <typename... Values>
  void AddListCallbacks(Parser::list_property_definition_callbacks_type& callbacks);
  template <typename... Values>
  void AddScalarCallbacks(Parser::scalar_property_definition_callbacks_type& callbacks);

  FieldCloud Cloud;
  pcl::io::ply::format_type Format = pcl::io::ply::ascii_format;
  bool HasOthers = false;              // elements besides the vertices
  bool AreFirst = false;               // the vertices
  bool HaveLists = false;              // the vertices
  std::streamoff Block = 0;            // where the vertices begin, if nothing else is in the data
  std::uint64_t Count = 0;             // of vertices, by the header
  std::uint64_t Columns = 0, Rows = 0; // of a depth image, or 0
  std::vector<std::int64_t> Grid;      // vertex of each pixel of a depth image, or NoPoint
  std::vector<vtkIdType> Corners;      // of the face that is read
  vtkNew<vtkCellArray> Faces;
};

/// The files of range scanners have cells of a grid, each with a vertex or none.
Parser::element_callbacks_type Contents::AddElement(const std::string& name, std::size_t count)
{
  if (name == "vertex")
  {
    this->Count = count;
    this->AreFirst = !this->HasOthers;
  }
  this->HasOthers = this->HasOthers || (name != "vertex" && count > 0);
  if (name == "range_grid")
  {
    return { [this] { this->Grid.push_back(NoPoint); }, [] {} };
  }
  return { [] {}, [] {} };
}

/// Range scanners write "obj_info num_cols 512", PCL's organized clouds a camera's viewport.
void Contents::ReadObjectInfo(const std::string& line)
{
  std::istringstream words(line);
  std::string info, key;
  std::uint64_t number = 0;
  if (words >> info >> key >> number && key == "num_cols")
  {
    this->Columns = number;
  }
  else if (key == "num_rows")
  {
    this->Rows = number;
  }
}

template <typename Value>
std::function<void(Value)> Contents::AddProperty(
  const std::string& element, const std::string& name)
{
  if (element == "vertex")
  {
    const bool isDiffuse = name.rfind("diffuse_", 0) == 0; // colours of older files
    this->Cloud.Fields.push_back(
      { isDiffuse ? name.substr(8) : name, this->Cloud.PointStep, TypeOf<Value>(), 1 });
    this->Cloud.PointStep += sizeof(Value);
    return [this](Value value) { Append(this->Cloud.Data, value); };
  }
  if (element == "camera" && (name == "viewportx" || name == "viewporty"))
  {
    std::uint64_t& size = name == "viewportx" ? this->Columns : this->Rows;
    return [&size](Value value) {
      const bool isSize = value > 0 && static_cast<double>(value) < 1e9;
      size = isSize ? static_cast<std::uint64_t>(value) : 0;
    };
  }
  return {};
}

template <typename... Values>
void Contents::AddScalarCallbacks(Parser::scalar_property_definition_callbacks_type& callbacks)
{
  ((Parser::at<Values>(
      callbacks) = [this](const std::string& element,
                     const std::string& name) { return this->AddProperty<Values>(element, name); }),
    ...);
}

/// Keeps a face all of whose corners exist.
void Contents::EndFace()
{
  const bool isWhole = std::all_of(this->Corners.begin(), this->Corners.end(),
    [this](vtkIdType i) { return i >= 0 && static_cast<std::uint64_t>(i) < this->Count; });
  if (isWhole)
  {
    this->Faces->InsertNextCell(static_cast<vtkIdType>(this->Corners.size()), this->Corners.data());
  }
  this->Corners.clear();
}

template <typename Size, typename Value>
void Contents::AddListCallback(Parser::list_property_definition_callbacks_type& callbacks)
{
  using Callbacks =
    std::tuple<std::function<void(Size)>, std::function<void(Value)>, std::function<void()>>;
  Parser::at<Size, Value>(callbacks) = [this](const std::string& element, const std::string& name) {
    this->HaveLists = this->HaveLists || element == "vertex";
    if (element == "range_grid")
    {
      return Callbacks([](Size) {}, [this](Value vertex) { this->Grid.back() = vertex; }, [] {});
    }
    if (element == "face" && (name == "vertex_indices" || name == "vertex_index") &&
      this->Count <= SurfelGeometry::MostVerticesOfFaces) // vertices come first
    {
      return Callbacks([](Size) {}, [this](Value corner) { this->Corners.push_back(corner); },
        [this] { this->EndFace(); });
    }
    return Callbacks{};
  };
}

template <typename... Values>
void Contents::AddListCallbacks(Parser::list_property_definition_callbacks_type& callbacks)
{
  using namespace pcl::io::ply;
  (this->AddListCallback<uint8, Values>(callbacks), ...);
  (this->AddListCallback<uint16, Values>(callbacks), ...);
  (this->AddListCallback<uint32, Values>(callbacks), ...);
}

bool Contents::Read(const std::string& path)
{
  using namespace pcl::io::ply;
  Parser parser;
  parser.element_definition_callback(
    [this](const std::string& name, std::size_t count) { return this->AddElement(name, count); });
  parser.obj_info_callback([this](const std::string& line) { this->ReadObjectInfo(line); });
  Parser::scalar_property_definition_callbacks_type scalars;
  this->AddScalarCallbacks<int8, uint8, int16, uint16, int32, uint32, float32, float64>(scalars);
  parser.scalar_property_definition_callbacks(scalars);
  Parser::list_property_definition_callbacks_type lists;
  this->AddListCallbacks<int8, uint8, int16, uint16, int32, uint32>(lists);
  parser.list_property_definition_callbacks(lists);
  parser.format_callback([this](format_type format, const std::string&) { this->Format = format; });
  parser.end_header_callback([this, &path] { // false: it stops
    return !this->FindBlock(path) && (this->HasOthers || !this->HasTextPoints());
  });
  const bool isParsed = parser.parse(path);
  if (this->HasTextPoints())
  {
    this->ReadText(path); // says which line is wrong, where the parser does not
  }
  if (!isParsed || (this->Block > 0 && !this->ReadBlock(path)))
  {
    return false;
  }
  return this->Cloud.Data.size() == this->Count * this->Cloud.PointStep;
}

/// Whether the vertices are the lines behind the header. The parser takes 155.0 for 0 in a field of
/// integers, and what is no number as well.
bool Contents::HasTextPoints() const
{
  return this->Format == pcl::io::ply::ascii_format && this->Count > 0 && this->AreFirst &&
    !this->HaveLists;
}

void Contents::ReadText(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  std::string line;
  std::size_t lines = 1;
  while (std::getline(file, line) && line.rfind("end_header", 0) != 0)
  {
    ++lines;
  }
  this->Cloud.Width = static_cast<std::uint32_t>(this->Count);
  this->Cloud.Height = 1;
  this->Cloud.Data.assign(this->Count * this->Cloud.PointStep, 0);
  ReadTextPoints(file, lines, this->Cloud);
}

/// Whether the rest of the file is one block of vertices without lists, as in most files. The
/// parser would read it value by value.
bool Contents::FindBlock(const std::string& path)
{
  if (this->Format == pcl::io::ply::ascii_format || this->HasOthers || this->Count == 0)
  {
    return false;
  }
  std::ifstream file(path, std::ios::binary);
  std::string line;
  while (std::getline(file, line) && line.rfind("end_header", 0) != 0)
  {
  }
  const std::streamoff begin = file.tellg();
  file.seekg(0, std::ios::end);
  const auto bytes = static_cast<std::uint64_t>(file.tellg() - begin);
  // Every list would take bytes that no field counts.
  this->Block = file && bytes == this->Count * this->Cloud.PointStep ? begin : 0;
  return this->Block > 0;
}

bool Contents::ReadBlock(const std::string& path)
{
  Bytes& data = this->Cloud.Data;
  data.resize(this->Count * this->Cloud.PointStep);
  constexpr vtkIdType piece = 1 << 22; // bytes
  const auto size = static_cast<vtkIdType>(data.size());
  std::atomic<bool> isWhole{ true };
  SurfelGeometry::ParallelFor(0, (size + piece - 1) / piece, 1, [&](vtkIdType p, vtkIdType end) {
    std::ifstream file(path, std::ios::binary);
    const vtkIdType from = p * piece;
    file.seekg(this->Block + from);
    if (!file.read(reinterpret_cast<char*>(data.data()) + from, std::min(size, end * piece) - from))
    {
      isWhole = false;
    }
  });
  const bool isBig = this->Format == pcl::io::ply::binary_big_endian_format;
  if (isBig != (pcl::io::ply::host_byte_order == pcl::io::ply::big_endian_byte_order))
  {
    SwapBytes(this->Cloud);
  }
  return isWhole;
}

/// Puts the vertices where the grid has them.
void Contents::ArrangeInGrid()
{
  const std::size_t step = this->Cloud.PointStep;
  const Bytes missing = MissingPoint(this->Cloud);
  Bytes data;
  data.reserve(this->Grid.size() * step);
  for (const std::int64_t vertex : this->Grid)
  {
    const bool exists = vertex >= 0 && static_cast<std::uint64_t>(vertex) < this->Count;
    const std::uint8_t* point =
      exists ? this->Cloud.Data.data() + static_cast<std::size_t>(vertex) * step : missing.data();
    data.insert(data.end(), point, point + step);
  }
  this->Cloud.Data.swap(data);
  this->Count = this->Grid.size();
}

FieldCloud Contents::TakeCloud()
{
  // A cell without a vertex takes a byte of the file, however long a vertex is: a nearly empty grid
  // of long ones could fill any memory.
  constexpr std::uint64_t mostCells = 64; // for a vertex
  if (!this->Grid.empty() && IsProduct(this->Grid.size(), this->Columns, this->Rows) &&
    this->Grid.size() <= mostCells * this->Count)
  {
    this->ArrangeInGrid();
  }
  const bool isImage = this->Rows > 1 && IsProduct(this->Count, this->Columns, this->Rows);
  this->Cloud.Width = static_cast<std::uint32_t>(isImage ? this->Columns : this->Count);
  this->Cloud.Height = static_cast<std::uint32_t>(isImage ? this->Rows : 1);
  // The pixels of an image are other points than the corners know.
  this->Cloud.Faces = !isImage && this->Faces->GetNumberOfCells() > 0 ? this->Faces.Get() : nullptr;
  return std::move(this->Cloud);
}
}

FieldCloud ReadPLY(const std::string& path)
{
  Contents contents;
  if (!contents.Read(path))
  {
    throw std::runtime_error(
      "the header or the data is damaged or cut short (PCL's parser cannot read it).");
  }
  return contents.TakeCloud();
}
}
