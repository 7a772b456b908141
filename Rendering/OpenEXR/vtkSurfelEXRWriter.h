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
 * Further point arrays of one or three components become further channels: NAME, or NAME.X, NAME.Y
 * and NAME.Z. One by one, or all, "Depth" as Z, "Normal" as N, "CircleOfConfusion" as CoC and
 * "Coverage", "Fragments" and "Level" in small letters:
 * @code
 * writer->AddChannel("Depth", "Z");
 * writer->AllChannelsOn();
 * @endcode
 *
 * @sa vtkSurfelEXRReader vtkSurfelImageRenderer vtkDeepEXRWriter
 */
#ifndef vtkSurfelEXRWriter_h
#define vtkSurfelEXRWriter_h

#include "vtkEXRWriterBase.h"
#include "vtkSurfelOpenEXRModule.h" // for the export macro

#include <memory> // for std::unique_ptr

class VTKSURFELOPENEXR_EXPORT vtkSurfelEXRWriter : public vtkEXRWriterBase
{
public:
  static vtkSurfelEXRWriter* New();
  vtkTypeMacro(vtkSurfelEXRWriter, vtkEXRWriterBase);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Write the point array arrayName, of one or three components, as channel channelName (not R, G,
   * B or A). An array that the input lacks when it is written is an error. Default: no further
   * channels.
   */
  void AddChannel(const char* arrayName, const char* channelName);
  void RemoveAllChannels();
  int GetNumberOfChannels();
  ///@}

  ///@{
  /**
   * Whether all other point arrays of one or three components are written, besides those that were
   * added. Two arrays for one channel are an error. Default off.
   */
  vtkSetMacro(AllChannels, vtkTypeBool);
  vtkGetMacro(AllChannels, vtkTypeBool);
  vtkBooleanMacro(AllChannels, vtkTypeBool);
  ///@}

protected:
  vtkSurfelEXRWriter();
  ~vtkSurfelEXRWriter() override;

#ifndef __VTK_WRAP__
  void WriteStream(vtkImageData* image, std::ofstream& file, const std::string& path) override;
#endif

private:
  vtkSurfelEXRWriter(const vtkSurfelEXRWriter&) = delete;
  void operator=(const vtkSurfelEXRWriter&) = delete;

  vtkTypeBool AllChannels = 0;
  struct Internals;
  std::unique_ptr<Internals> Internal;
};

#endif
