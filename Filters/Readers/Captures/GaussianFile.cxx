// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Readers/Captures/GaussianFile.h"

#include "Filters/Readers/Points/PCDDecoder.h"

#include <algorithm>
#include <cctype>
#include <stdexcept>

namespace PointCloud
{
namespace
{
bool IsBigEndianMachine()
{
  const std::uint16_t one = 1;
  return *reinterpret_cast<const std::uint8_t*>(&one) == 0;
}

bool HasExtension(const std::string& path, const std::string& extension)
{
  return path.size() > extension.size() &&
    std::equal(extension.rbegin(), extension.rend(), path.rbegin(),
      [](char a, char b) { return a == std::tolower(static_cast<unsigned char>(b)); });
}

/// The header of a file whose numbers all have known sizes; throws otherwise.
PLYHeader ReadKnownHeader(std::istream& file)
{
  PLYHeader header = ReadPLYHeader(file);
  if (std::any_of(header.Elements.begin(), header.Elements.end(),
        [](const PLYElement& element) { return element.HasUnknown; }))
  {
    throw std::runtime_error(
      "an element has a property without known type and name; the header is damaged.");
  }
  return header;
}
}

CaptureFormat FindCaptureFormat(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  if (!file || file.peek() == std::ifstream::traits_type::eof())
  {
    return CaptureFormat::None;
  }
  if (SPZGaussians::Has(file))
  {
    return CaptureFormat::SPZ;
  }
  if (FindFormat(path) != Format::PLY)
  {
    return HasExtension(path, ".splat") ? CaptureFormat::Splat : CaptureFormat::None;
  }
  try
  {
    const PLYHeader header = ReadKnownHeader(file);
    const PLYElement* vertices = header.Find("vertex");
    const bool isCapture =
      (vertices && IsCapture(vertices->Fields)) || PackedGaussians::Has(header);
    return isCapture ? CaptureFormat::PLY : CaptureFormat::None;
  }
  catch (const std::runtime_error&)
  {
    return CaptureFormat::None; // damaged
  }
}

GaussianFile::GaussianFile(const std::string& path)
  : File(path, std::ios::binary)
{
  if (!this->File || this->File.peek() == std::ifstream::traits_type::eof())
  {
    throw std::runtime_error(this->File.is_open()
        ? "the file is empty."
        : "the file cannot be opened; check name and rights.");
  }
  const bool isPLY = FindFormat(path) == Format::PLY;
  const bool isSPZ = SPZGaussians::Has(this->File) || HasExtension(path, ".spz");
  if (!isPLY && !isSPZ && !HasExtension(path, ".splat"))
  {
    throw std::runtime_error("neither a .ply nor a .spz file, judging by its first bytes, nor a "
                             ".splat file, judging by its name.");
  }
  this->File.seekg(0, std::ios::end);
  const auto bytes = static_cast<std::uint64_t>(this->File.tellg());
  this->File.seekg(0);
  isPLY ? this->OpenPLY(bytes) : isSPZ ? this->OpenSPZ(bytes) : this->OpenSplat(bytes);
  this->Header.Fields = this->Values.Fields;
  this->Header.PointStep = this->Values.Step;
}

void GaussianFile::OpenPLY(std::uint64_t bytes)
{
  const PLYHeader header = ReadKnownHeader(this->File);
  if (PackedGaussians::Has(header))
  {
    this->Packed.emplace(header, this->File, bytes);
    this->Values = this->Packed->Layout();
    this->Header.Width = static_cast<std::uint32_t>(this->Packed->Count());
    return;
  }
  this->OpenVertices(header, bytes);
}

void GaussianFile::OpenVertices(const PLYHeader& header, std::uint64_t bytes)
{
  const PLYElement* vertices = header.Find("vertex");
  if (!vertices || !IsCapture(vertices->Fields))
  {
    throw std::runtime_error("a .ply file without scale_0, rot_0 and opacity: it holds points or a "
                             "mesh, which vtkPointCloudReader reads.");
  }
  const bool isFirst = std::all_of(
    header.Elements.data(), vertices, [](const PLYElement& before) { return before.Count == 0; });
  if (vertices->HasLists || !isFirst)
  {
    throw std::runtime_error(vertices->HasLists
        ? "its Gaussians have a list among their properties; captures have numbers only."
        : "its Gaussians are not the first element of the file; write them first.");
  }
  const bool isAscii = header.Format == "ascii", isBig = header.Format == "binary_big_endian";
  if (!isAscii && !isBig && header.Format != "binary_little_endian")
  {
    throw std::runtime_error(
      "its format is neither ascii, binary_little_endian nor binary_big_endian.");
  }
  this->Values = LayoutOfPLY(vertices->Fields, vertices->Step);
  // In ascii a value takes at least a digit and a blank.
  CheckSize(vertices->Count, isAscii ? 2 * vertices->Fields.size() - 1 : vertices->Step,
    bytes - static_cast<std::uint64_t>(this->File.tellg()));
  this->Header.Width = static_cast<std::uint32_t>(vertices->Count);
  this->Header.Data = isAscii ? "ascii" : "binary";
  this->Header.Lines = header.Lines;
  this->IsSwapped = !isAscii && isBig != IsBigEndianMachine();
}

void GaussianFile::OpenSplat(std::uint64_t bytes)
{
  this->Values = LayoutOfSplat();
  const std::uint64_t step = this->Values.Step;
  if (bytes % step != 0)
  {
    throw std::runtime_error("a .splat file has " + std::to_string(step) +
      " bytes for each Gaussian, and this one has " + std::to_string(bytes) +
      " bytes, which is no multiple; it is cut short, or of another format.");
  }
  CheckSize(bytes / step, step, bytes);
  this->Header.Width = static_cast<std::uint32_t>(bytes / step);
  this->Header.Data = "binary";
  this->IsSwapped = IsBigEndianMachine();
}

void GaussianFile::OpenSPZ(std::uint64_t bytes)
{
  this->Columns.emplace(this->File, bytes);
  this->Values = this->Columns->Layout();
  this->Header.Width = static_cast<std::uint32_t>(this->Columns->Count());
}

bool GaussianFile::Load(const std::function<bool(double)>& proceed)
{
  return !this->Columns || this->Columns->Inflate(this->File, proceed);
}

std::uint64_t GaussianFile::PartSize() const
{
  // The decoder of text counts lines and points from where it begins.
  return this->Header.Data == "ascii" ? this->Count()
                                      : std::min<std::uint64_t>(1 << 16, this->Count());
}

FieldCloud GaussianFile::Read(std::uint64_t count)
{
  const std::uint64_t first = this->Done;
  this->Done += count;
  if (this->Packed)
  {
    return this->Packed->Read(this->File, first, count);
  }
  if (this->Columns)
  {
    return this->Columns->Read(first, count);
  }
  PCDHeader part = this->Header;
  part.Width = static_cast<std::uint32_t>(count);
  FieldCloud gaussians = DecodePCD(this->File, part);
  if (this->IsSwapped)
  {
    SwapBytes(gaussians);
  }
  return gaussians;
}
}
