// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkEXRWriterBase
 * @brief   what writers of OpenEXR files share: whole files or none
 *
 * The file appears under its name only when it is complete: what is written first is a temporary
 * file beside it, which goes away where something fails. What a link points to is written; the link
 * stays. GetErrorCode() tells how the last Write() ended (vtkErrorCode).
 *
 * Where the input has the field data of a vtkSurfelSplatter's picture, camera and lens go into the
 * file's header: worldToCamera, for row vectors as OpenEXR wants it, the camera looking along -z,
 * and the same in doubles as worldToCameraDouble; focus, the distance in focus, and lensDiameter,
 * both in world units, not metres; focalLengthPixels; screenWindowCenter, screenWindowWidth and
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
  /// Writes all of the file. What is wrong with the input or with writing is a std::exception; its
  /// text follows "Cannot write NAME: ".
  virtual void WriteStream(vtkImageData* image, std::ofstream& file, const std::string& path) = 0;
#endif

private:
  vtkEXRWriterBase(const vtkEXRWriterBase&) = delete;
  void operator=(const vtkEXRWriterBase&) = delete;
};

#endif
