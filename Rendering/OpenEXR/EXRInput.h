// SPDX-License-Identifier: BSD-3-Clause
/**
 * Opens an OpenEXR file and checks it. OpenEXR allocates whatever a header announces; this class
 * first checks that the file can hold it. Internal to the module.
 */
#pragma once

#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfStdIO.h>

#include <fstream>
#include <stdexcept>
#include <string>

namespace SurfelSplatting
{
/// A problem with a file: a text that follows the file name, and a vtkErrorCode.
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
  /// Reads the header. Throws EXRProblem or an exception of OpenEXR if the file is not an OpenEXR
  /// file, is damaged, or is of an unsupported kind.
  explicit EXRInput(const std::string& path);

  const Imf::Header& GetHeader() const { return this->Header; }
  bool IsDeep() const { return this->Deep; }
  int Width() const;
  int Height() const;

  /// The stream, at its first byte.
  Imf::IStream& Rewind();

  /// Throws EXRProblem if this file is too small to hold this many uncompressed bytes.
  /// @param what the data, for the message
  void CheckUnpacked(double bytes, const std::string& what) const;

  /// Bytes of a pixel; in a deep file, of a sample.
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
