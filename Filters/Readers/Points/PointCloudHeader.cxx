// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Readers/Points/PointCloudHeader.h"

#include "Filters/Readers/Points/ReadingProblem.h"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace PointCloud
{
namespace
{
using Words = std::vector<std::string>;

constexpr std::size_t LongestLine = 1 << 16; // longer ones are binary data of another format

Words Split(const std::string& line)
{
  std::istringstream stream(line);
  Words words;
  for (std::string word; stream >> word;)
  {
    words.push_back(word);
  }
  return words;
}

[[noreturn]] void Fail(const std::string& what)
{
  throw std::runtime_error(what + "; the header is damaged.");
}

// Parses a whole number of decimal digits; fails if it is none.
std::uint64_t ParseCount(const std::string& key, const std::string& word)
{
  const bool isNumber = !word.empty() && word.size() < 19 &&
    std::all_of(word.begin(), word.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (!isNumber)
  {
    Fail(key + " is not a whole number");
  }
  return std::stoull(word);
}

// Adds the property that a line of a .ply header describes.
void AddPLYProperty(const Words& words, PLYElement& element)
{
  static const std::map<std::string, Field::Types> types = { { "char", Field::INT8 },
    { "int8", Field::INT8 }, { "uchar", Field::UINT8 }, { "uint8", Field::UINT8 },
    { "short", Field::INT16 }, { "int16", Field::INT16 }, { "ushort", Field::UINT16 },
    { "uint16", Field::UINT16 }, { "int", Field::INT32 }, { "int32", Field::INT32 },
    { "uint", Field::UINT32 }, { "uint32", Field::UINT32 }, { "float", Field::FLOAT32 },
    { "float32", Field::FLOAT32 }, { "double", Field::FLOAT64 }, { "float64", Field::FLOAT64 } };
  if (words.size() > 1 && words[1] == "list")
  {
    element.HasLists = true;
    return;
  }
  const auto type = words.size() == 3 ? types.find(words[1]) : types.end();
  if (type == types.end())
  {
    element.HasUnknown = true;
    return;
  }
  element.Fields.push_back({ words[2], element.Step, type->second, 1 });
  element.Step += SizeOf(type->second);
}

void CheckPLY(std::istream& file, std::uint64_t fileBytes)
{
  const PLYHeader header = ReadPLYHeader(file);
  for (const PLYElement& element : header.Elements)
  {
    CheckSize(element.Count, 1, fileBytes);
  }
}

// As std::getline, but false for longer lines: a file of gigabytes may be one.
bool NextLine(std::istream& file, std::string& line)
{
  line.resize(LongestLine);
  const bool isLine = static_cast<bool>(file.getline(&line[0], LongestLine));
  const auto read = static_cast<std::size_t>(file.gcount());
  line.resize(isLine && !file.eof() ? read - 1 : read); // gcount() has the end of the line
  return isLine;
}

// Reads and counts the lines of a .pcd header up to DATA, as key -> values.
std::map<std::string, Words> ReadPCDLines(std::istream& file, std::size_t& count)
{
  static const Words known = { "VERSION", "FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT",
    "VIEWPOINT", "POINTS", "DATA" };
  std::map<std::string, Words> lines;
  std::string line;
  while (!lines.count("DATA") && NextLine(file, line))
  {
    ++count;
    Words words = Split(line);
    if (words.empty() || words[0][0] == '#')
    {
      continue;
    }
    const std::string key = words[0] == "COLUMNS" ? "FIELDS" : words[0];
    words.erase(words.begin());
    // FIELDS must come before these lines, as pcl_io requires.
    const bool early = !lines.count("FIELDS") && (key == "SIZE" || key == "TYPE" || key == "COUNT");
    if (std::find(known.begin(), known.end(), key) == known.end() || early ||
      !lines.emplace(key, words).second)
    {
      Fail("the line " + key.substr(0, 40) + " is unknown, out of order or repeated");
    }
  }
  for (const char* key : { "FIELDS", "SIZE", "TYPE", "WIDTH", "DATA" })
  {
    if (lines[key].empty())
    {
      Fail(std::string("the line ") + key + " is missing");
    }
  }
  return lines;
}

struct PointSize
{
  std::uint64_t All = 0;    // bytes of a point
  std::uint64_t Padded = 0; // of these, bytes of fields named "_"
  std::uint64_t Values = 0; // of a point, padding included
};

void CheckPCDFields(std::map<std::string, Words>& lines, PCDHeader& header)
{
  const Words& names = lines["FIELDS"];
  const std::size_t fields = names.size();
  if (lines["COUNT"].empty())
  {
    lines["COUNT"] = Words(fields, "1");
  }
  if (lines["SIZE"].size() != fields || lines["TYPE"].size() != fields ||
    lines["COUNT"].size() != fields)
  {
    Fail("FIELDS, SIZE, TYPE and COUNT differ in length");
  }
  static const std::map<std::string, Field::Types> types = { { "I1", Field::INT8 },
    { "I2", Field::INT16 }, { "I4", Field::INT32 }, { "I8", Field::INT64 }, { "U1", Field::UINT8 },
    { "U2", Field::UINT16 }, { "U4", Field::UINT32 }, { "U8", Field::UINT64 },
    { "F4", Field::FLOAT32 }, { "F8", Field::FLOAT64 }, { "B1", Field::BOOL } };
  for (std::size_t i = 0; i < fields; ++i)
  {
    const std::uint64_t count = ParseCount("COUNT", lines["COUNT"][i]);
    const auto type = types.find(lines["TYPE"][i] + lines["SIZE"][i]);
    if (type == types.end() || count < 1 || count > 65536)
    {
      Fail("the field " + names[i].substr(0, 40) + " has an unknown type or count");
    }
    header.Fields.push_back({ names[i], header.PointStep, type->second, count });
    header.PointStep += count * SizeOf(type->second);
  }
}

// The data begins with its sizes, packed and unpacked; pcl_io packs no padding.
void CheckCompressed(
  std::istream& file, std::uint64_t points, const PointSize& size, std::uint64_t dataBytes)
{
  std::uint32_t packed = 0;
  std::uint32_t unpacked = 0;
  file.read(reinterpret_cast<char*>(&packed), sizeof(packed));
  file.read(reinterpret_cast<char*>(&unpacked), sizeof(unpacked));
  const bool isWhole = file && packed + std::uint64_t(8) <= dataBytes;
  const bool isLikely =
    unpacked == points * size.All || unpacked == points * (size.All - size.Padded);
  if (!isWhole || !isLikely || unpacked / 88 > packed) // LZF packs at most 264 bytes into 3
  {
    throw std::runtime_error("the compressed data is cut short or damaged.");
  }
}

// Reads columns and rows.
void CheckPCDSize(std::map<std::string, Words>& lines, PCDHeader& header)
{
  const std::uint64_t width = ParseCount("WIDTH", lines["WIDTH"][0]);
  const std::uint64_t height =
    lines["HEIGHT"].empty() ? 1 : ParseCount("HEIGHT", lines["HEIGHT"][0]);
  const std::uint64_t points =
    lines["POINTS"].empty() ? width * height : ParseCount("POINTS", lines["POINTS"][0]);
  if (width > std::numeric_limits<int>::max() || height > std::numeric_limits<int>::max() ||
    width * height != points)
  {
    Fail("POINTS is not WIDTH times HEIGHT");
  }
  header.Width = static_cast<std::uint32_t>(width);
  header.Height = static_cast<std::uint32_t>(height);
}

void CheckPCD(std::istream& file, std::uint64_t fileBytes)
{
  const PCDHeader header = ReadPCDHeader(file);
  const std::uint64_t points = std::uint64_t(header.Width) * header.Height;
  PointSize size;
  for (const Field& field : header.Fields)
  {
    const std::uint64_t bytes = field.Count * SizeOf(field.Type);
    size.All += bytes;
    size.Padded += field.Name == "_" ? bytes : 0;
    size.Values += field.Count;
  }
  const std::string& data = header.Data;
  const auto dataBytes = fileBytes - static_cast<std::uint64_t>(file.tellg());
  if (data == "binary_compressed")
  {
    CheckSize(points, 0, dataBytes);
    CheckCompressed(file, points, size, dataBytes);
  }
  else
  {
    // In ascii a value takes at least a digit and a blank.
    CheckSize(points, data == "binary" ? size.All : 2 * size.Values - 1, dataBytes);
  }
}
}

void CheckSize(std::uint64_t points, std::uint64_t leastBytes, std::uint64_t fileBytes)
{
  if (points > static_cast<std::uint64_t>(std::numeric_limits<int>::max()) ||
    points * leastBytes > fileBytes)
  {
    throw std::runtime_error("the header promises " + std::to_string(points) +
      " points, but the file has only " + std::to_string(fileBytes) +
      " bytes; it is cut short or its header is wrong.");
  }
}

Format FindFormat(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  std::string line;
  for (bool first = true; NextLine(file, line); first = false)
  {
    const Words words = Split(line);
    if (first && words.size() == 1 && words[0] == "ply")
    {
      return Format::PLY;
    }
    if (!words.empty() && words[0][0] != '#') // a .pcd file may begin with comments
    {
      const bool isPCD = words[0] == "VERSION" || words[0] == "FIELDS" || words[0] == "COLUMNS";
      return isPCD ? Format::PCD : Format::Unknown;
    }
  }
  return Format::Unknown;
}

PCDHeader ReadPCDHeader(std::istream& file)
{
  PCDHeader header;
  std::map<std::string, Words> lines = ReadPCDLines(file, header.Lines);
  CheckPCDFields(lines, header);
  CheckPCDSize(lines, header);
  header.Data = lines["DATA"][0];
  if (header.Data != "ascii" && header.Data != "binary" && header.Data != "binary_compressed")
  {
    Fail("DATA is neither ascii, binary nor binary_compressed");
  }
  for (std::size_t c = 0; c < std::min<std::size_t>(3, lines["VIEWPOINT"].size()); ++c)
  {
    std::istringstream(lines["VIEWPOINT"][c]) >> header.Viewpoint[c];
  }
  return header;
}

PLYHeader ReadPLYHeader(std::istream& file)
{
  PLYHeader header;
  std::string line;
  while (NextLine(file, line))
  {
    ++header.Lines;
    const Words words = Split(line);
    if (words.empty())
    {
      continue;
    }
    if (words[0] == "end_header")
    {
      return header;
    }
    if (words[0] == "format" && words.size() > 1)
    {
      header.Format = words[1];
    }
    else if (words[0] == "element" && words.size() > 2)
    {
      header.Elements.emplace_back();
      header.Elements.back().Name = words[1];
      header.Elements.back().Count = ParseCount("the number of elements " + words[1], words[2]);
    }
    else if (words[0] == "property" && !header.Elements.empty())
    {
      AddPLYProperty(words, header.Elements.back());
    }
  }
  throw std::runtime_error("the header has no end_header; the file is cut short.");
}

const PLYElement* PLYHeader::Find(const std::string& name) const
{
  const auto found = std::find_if(this->Elements.begin(), this->Elements.end(),
    [&](const PLYElement& element) { return element.Name == name; });
  return found == this->Elements.end() ? nullptr : &*found;
}

Format CheckFile(const std::string& path)
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
    std::string start(15, ' '); // enough for <!DOCTYPE html>
    file.read(&start[0], static_cast<std::streamsize>(start.size()));
    start.resize(static_cast<std::size_t>(file.gcount()));
    throw std::runtime_error("neither a .ply nor a .pcd file: it begins with \"" +
      Printable(start) + "\"; is its name right, and was all of it downloaded?");
  }
  file.seekg(0, std::ios::end);
  const auto fileBytes = static_cast<std::uint64_t>(file.tellg());
  file.seekg(0);
  format == Format::PLY ? CheckPLY(file, fileBytes) : CheckPCD(file, fileBytes);
  return format;
}
}
