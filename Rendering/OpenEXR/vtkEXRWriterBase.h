// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkEXRWriterBase
 * @brief   superclass of the writers of OpenEXR files
 *
 * This class writes complete files or none. It writes a temporary file beside the final one and
 * renames it when it is complete; after a failure the temporary file is deleted. If the file name
 * is a link, its target is written and the link stays. GetErrorCode() tells how the last Write()
 * ended (vtkErrorCode).
 *
 * If the input has the field data of a picture of vtkSurfelSplatter, camera and lens are written to
 * the header: worldToCamera (for row vectors, as OpenEXR defines it, with a camera that looks along
 * -z), the same in doubles as worldToCameraDouble, focus (the distance in focus) and lensDiameter
 * (both in world units, not metres), focalLengthPixels, screenWindowCenter, screenWindowWidth and
 * pixelAspectRatio.
 *
 * @sa vtkSurfelEXRWriter vtkDeepEXRWriter vtkSurfelEXRReader
 */
#ifndef vtkEXRWriterBase_h
#define vtkEXRWriterBase_h

#include "vtkImageWriter.h"
#include "vtkSurfelOpenEXRModule.h" // for the export macro

#include <iosfwd> // for the stream
#include <string> // for the path

class vtkImageData;

class VTKSURFELOPENEXR_EXPORT vtkEXRWriterBase : public vtkImageWriter
{
public:
  vtkTypeMacro(vtkEXRWriterBase, vtkImageWriter);

  /**
   * Updates the input and writes it to FileName.
   */
  void Write() override;

protected:
  vtkEXRWriterBase();
  ~vtkEXRWriterBase() override;

  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;

#ifndef __VTK_WRAP__
  /// Writes the whole file. Throws a std::exception if the input is wrong or writing fails; its
  /// text follows "Cannot write NAME: ".
  virtual void WriteStream(vtkImageData* image, std::ofstream& file, const std::string& path) = 0;
#endif

private:
  vtkEXRWriterBase(const vtkEXRWriterBase&) = delete;
  void operator=(const vtkEXRWriterBase&) = delete;

#ifndef __VTK_WRAP__
  /// WriteStream to a new file. Throws a std::exception after it has set the code of the problem.
  void WriteTemporary(vtkImageData* image, const std::string& path, unsigned long& problemCode);
#endif
};

#endif
