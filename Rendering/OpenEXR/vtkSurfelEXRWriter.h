// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelEXRWriter
 * @brief   writes a float picture as an OpenEXR file
 *
 * The input is one 2D image whose point scalars have 3 or 4 components: R, G, B and A of the file,
 * 32-bit float, ZIP compressed, top row first (a vtkImageData's first row is the lowest).
 * Floating-point values are written as they are: OpenEXR expects linear light, and colours
 * premultiplied by alpha, which is what vtkSurfelImageRenderer yields. Integers are scaled so that
 * their type's largest value becomes 1.
 *
 * Further point arrays of one component become further channels, such as "Depth" as Z:
 * @code
 * writer->AddChannel("Depth", "Z");
 * @endcode
 *
 * The file appears under its name only when it is complete: what is written first is a temporary
 * file beside it. GetErrorCode() tells how the last Write() ended (vtkErrorCode).
 *
 * @sa vtkSurfelImageRenderer
 */
#ifndef vtkSurfelEXRWriter_h
#define vtkSurfelEXRWriter_h

#include "vtkImageWriter.h"
#include "vtkSurfelOpenEXRModule.h" // for the export macro

#include <memory> // for std::unique_ptr

class VTKSURFELOPENEXR_EXPORT vtkSurfelEXRWriter : public vtkImageWriter
{
public:
  static vtkSurfelEXRWriter* New();
  vtkTypeMacro(vtkSurfelEXRWriter, vtkImageWriter);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  /**
   * Updates the input and writes it to FileName.
   */
  void Write() override;

  ///@{
  /**
   * Write the point array arrayName, of one component, as channel channelName (not R, G, B or A).
   * An array that the input lacks when it is written is an error. Default: no further channels.
   */
  void AddChannel(const char* arrayName, const char* channelName);
  void RemoveAllChannels();
  int GetNumberOfChannels();
  ///@}

protected:
  vtkSurfelEXRWriter();
  ~vtkSurfelEXRWriter() override;

  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;

private:
  vtkSurfelEXRWriter(const vtkSurfelEXRWriter&) = delete;
  void operator=(const vtkSurfelEXRWriter&) = delete;

  struct Internals;
  std::unique_ptr<Internals> Internal;
};

#endif
