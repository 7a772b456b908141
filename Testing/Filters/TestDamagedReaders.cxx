// SPDX-License-Identifier: BSD-3-Clause
// Damaged captures and scans: an error, or points whose values are all finite. Most useful under a
// sanitizer, with more rounds: SURFELSPLATTING_DAMAGE_ROUNDS=20000.
#include "ReaderFiles.h"
#include "SurfelTesting.h"
#include "Testing/Shared/Random.h"

#include "vtkCellArray.h"
#include "vtkGaussianSplatReader.h"
#include "vtkPointCloudReader.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <type_traits>

using namespace SurfelTesting;

namespace
{
int Rounds()
{
  const char* const rounds = std::getenv("SURFELSPLATTING_DAMAGE_ROUNDS");
  return rounds ? std::atoi(rounds) : 400;
}

/// A file that is removed when a test ends.
class DamagedFile
{
public:
  explicit DamagedFile(const std::string& extension)
    : Path("TestDamagedReaders" + extension)
  {
  }
  ~DamagedFile() { std::remove(this->Path.c_str()); }

  void Write(const std::string& content) const
  {
    std::remove(this->Path.c_str()); // a file that is cut to nothing waits for the disk
    std::ofstream(this->Path, std::ios::binary) << content;
  }

  const std::string Path;
};

char AnyByte(Random& random)
{
  const char likely[] = { '\x00', '\x01', '\x7f', '\x80', '\xff' };
  const auto other = static_cast<char>(random.Integer(0, 255));
  return random() < 0.5 ? other : likely[random.Integer(0, 4)];
}

void ChangeDigits(std::string& content, Random& random)
{
  const auto head = static_cast<int>(std::min<std::size_t>(content.size(), 1500));
  for (int change = 0; change < 3; ++change)
  {
    const auto digit = content.find_first_of("0123456789", random.Integer(0, head - 1));
    if (digit != std::string::npos)
    {
      content[digit] = "0123456789-e. "[random.Integer(0, 13)];
    }
  }
}

/// Leaves out, repeats or moves a line of the header.
void ChangeLines(std::string& content, Random& random)
{
  const auto size = static_cast<int>(content.size());
  const auto end = content.find('\n', random.Integer(0, std::min(size - 1, 1500)));
  if (end == std::string::npos)
  {
    return;
  }
  const auto begin = end == 0 ? std::string::npos : content.rfind('\n', end - 1);
  const auto first = begin == std::string::npos ? 0 : begin + 1;
  const std::string line = content.substr(first, end + 1 - first);
  const int kind = random.Integer(0, 2);
  if (kind != 1)
  {
    content.erase(first, line.size());
  }
  if (kind != 0)
  {
    content.insert(content.find('\n') + 1, line);
  }
}

std::string Damaged(std::string content, Random& random)
{
  const auto place = [&] { return random.Integer(0, static_cast<int>(content.size()) - 1); };
  const int begin = place(), kind = random.Integer(0, 6);
  if (kind < 2)
  {
    // Where the numbers of binary headers are, or anywhere.
    const int last = std::min(static_cast<int>(content.size()) - 1, 140);
    for (int change = random.Integer(1, 8); change > 0; --change)
    {
      content[kind == 0 ? place() : random.Integer(0, last)] = AnyByte(random);
    }
  }
  else if (kind == 2)
  {
    content.erase(begin);
  }
  else if (kind == 3)
  {
    content.insert(begin, random.Integer(1, 40), AnyByte(random));
  }
  else if (kind == 4)
  {
    content.erase(begin, random.Integer(1, 40));
  }
  else
  {
    kind == 5 ? ChangeDigits(content, random) : ChangeLines(content, random);
  }
  return content;
}

bool IsFinite(vtkDataArray* array)
{
  for (vtkIdType i = 0; i < array->GetNumberOfTuples(); ++i)
  {
    for (int c = 0; c < array->GetNumberOfComponents(); ++c)
    {
      if (!std::isfinite(array->GetComponent(i, c)))
      {
        return false;
      }
    }
  }
  return true;
}

bool HasItsCorners(vtkPolyData* output)
{
  vtkDataArray* const corners = output->GetPolys()->GetConnectivityArray();
  for (vtkIdType i = 0; i < corners->GetNumberOfTuples(); ++i)
  {
    const double corner = corners->GetComponent(i, 0);
    if (corner < 0.0 || corner >= static_cast<double>(output->GetNumberOfPoints()))
    {
      return false;
    }
  }
  return true;
}

/// Every array has a value for every point, and every corner is a point. What captures have is
/// finite; scans mark missing points by NaN.
bool IsSound(vtkPolyData* output, bool isCapture)
{
  vtkPointData* const arrays = output->GetPointData();
  bool isSound = HasItsCorners(output) &&
    (!isCapture || output->GetNumberOfPoints() == 0 || IsFinite(output->GetPoints()->GetData()));
  for (int i = 0; i < arrays->GetNumberOfArrays(); ++i)
  {
    vtkDataArray* const array = arrays->GetArray(i);
    isSound = isSound && array && array->GetNumberOfTuples() == output->GetNumberOfPoints() &&
      (!isCapture || IsFinite(array));
  }
  return isSound;
}

std::string Itself(const std::string& content)
{
  return content;
}

/// @param pack makes the file of the content that is damaged
template <typename Reader>
void CheckDamage(const std::string& extension, const std::string& whole, int points,
  std::string (*pack)(const std::string&) = Itself)
{
  constexpr bool isCapture = std::is_same<Reader, vtkGaussianSplatReader>::value;
  const DamagedFile file(extension);
  const int rounds = Rounds();
  int errors = 0;
  Random random(whole.size());
  for (int round = 0; round <= rounds; ++round)
  {
    file.Write(pack(round == 0 ? whole : Damaged(whole, random)));
    CAPTURE(round);
    Reader::CanReadFile(file.Path.c_str()); // which reads the header
    vtkNew<Reader> reader;
    const Messages messages(reader);
    reader->SetFileName(file.Path.c_str());
    reader->Update();
    const bool isError = reader->GetErrorCode() != 0;
    CHECK(messages.Errors.empty() != isError);
    CHECK(IsSound(reader->GetOutput(), isCapture));
    CHECK((round > 0 || (!isError && reader->GetOutput()->GetNumberOfPoints() == points)));
    errors += isError ? 1 : 0;
  }
  CHECK(errors > rounds / 20); // other damage is none: other colours, say
}

void CheckCapture(const std::string& extension, const std::string& whole, int points,
  std::string (*pack)(const std::string&) = Itself)
{
  CheckDamage<vtkGaussianSplatReader>(extension, whole, points, pack);
}

TEST_CASE("Captures in .ply files")
{
  CheckCapture(".ply", ReaderFiles::CapturePLY(20, false), 20);
  CheckCapture(".ply", ReaderFiles::CapturePLY(20, true), 20);
}

TEST_CASE("Compressed captures in .ply files")
{
  const ReaderFiles::Strings coefficients = ReaderFiles::Numbered("f_rest_", 9);
  CheckCapture(".ply", ReaderFiles::CompressedPLY(260, coefficients), 260);
  // Other numbers where the coefficients would be.
  CheckCapture(".ply", ReaderFiles::CompressedPLY(260, { "label" }), 260);
}

TEST_CASE("Captures in .splat files")
{
  CheckCapture(".splat", ReaderFiles::Splat(20), 20);
}

TEST_CASE("Captures in .spz files: the stream, then what it compresses")
{
  for (const int version : { 2, 3 })
  {
    const std::string content = ReaderFiles::SPZContent(version, 20);
    CheckCapture(".spz", ReaderFiles::Gzip(content), 20);
    CheckCapture(".spz", content, 20, ReaderFiles::Gzip);
  }
}

#ifdef SURFELSPLATTING_HAS_ZSTD
TEST_CASE("Captures in .spz files of version 4")
{
  CheckCapture(".spz", ReaderFiles::SPZ4(20), 20);
}
#endif

TEST_CASE("Scans in .pcd files")
{
  CheckDamage<vtkPointCloudReader>(".pcd", ReaderFiles::PCD(10, false), 20);
  CheckDamage<vtkPointCloudReader>(".pcd", ReaderFiles::PCD(10, true), 20);
}

#ifdef SURFELSPLATTING_READ_PLY
TEST_CASE("Meshes in .ply files")
{
  for (const char* const form : { "ascii", "binary_little_endian", "binary_big_endian" })
  {
    CheckDamage<vtkPointCloudReader>(".ply", ReaderFiles::MeshPLY(20, form), 20);
  }
}
#endif
}
