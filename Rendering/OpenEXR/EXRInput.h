// SPDX-License-Identifier: BSD-3-Clause
/**
 * An OpenEXR file that is opened with care: OpenEXR allocates what a header announces, so this
 * looks first whether the file can hold it. Internal to the module.
 */
#pragma once

#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfStdIO.h>

#include <fstream>
#include <stdexcept>
#include <string>

namespace SurfelSplatting
{
/// What is wrong with a file, to be read after its name, and its vtkErrorCode.
class EXRProblem : public std::runtime_error
{
public:
  EXRProblem(unsigned long code, const std::string& what)
    : std::runtime_error(what)
    , Code(code)
  {
  }
  const unsigned long Code;
};

class EXRInput
{
public:
  /// Reads the header. Throws EXRProblem, or what OpenEXR throws, where the file is none, damaged,
  /// or of a kind that is not read.
  explicit EXRInput(const std::string& path);

  const Imf::Header& GetHeader() const { return this->Header; }
  bool IsDeep() const { return this->Deep; }
  int Width() const;
  int Height() const;

  /// The file from its first byte.
  Imf::IStream& Rewind();

  /// Throws EXRProblem where so many bytes cannot have come from this file.
  void CheckUnpacked(double bytes, const std::string& ofWhat) const;

  /// Bytes of a pixel, or of a sample of a deep one.
  int BytesPerPixel() const;

private:
  void CheckAttributes();
  void CheckKind() const;
  void CheckSize() const;
  [[noreturn]] void FailAsTooLarge(const std::string& what) const;

  std::ifstream File;
  double FileBytes = 0.0;
  Imf::StdIFStream Stream;
  Imf::Header Header;
  int Version = 0; // and flags
  bool Deep = false;
};
}
