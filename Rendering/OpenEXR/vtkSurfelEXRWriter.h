// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelEXRWriter
 * @brief   writes a float picture as an OpenEXR file
 *
 * This writer takes one 2D image whose point scalars have 3 or 4 components. They become the
 * channels R, G, B and A of the file, 32-bit float, ZIP compressed, top row first (the first row of
 * a vtkImageData is the bottom row). Floating-point values are written unchanged: OpenEXR expects
 * colours premultiplied by alpha, as vtkSurfelSplatter makes them, and linear light, as it does
 * with LinearLightOn(). Integers are scaled so that the largest value of their type becomes 1.
 *
 * Further point arrays with one or three components can become further channels, NAME or NAME.X,
 * NAME.Y and NAME.Z: one by one, or all. All are written with their own names, except that "Depth"
 * becomes Z, "Normal" N, "CircleOfConfusion" CoC, and "Coverage", "Fragments" and "Level" begin
 * with a small letter:
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
   * The further channels. AddChannel() adds the point array arrayName, which has one or three
   * components, as channel channelName (not R, G, B or A). Writing fails if the input does not have
   * the array. Default none.
   */
  void AddChannel(const char* arrayName, const char* channelName);
  void RemoveAllChannels();
  int GetNumberOfChannels();
  ///@}

  ///@{
  /**
   * Whether to write all other point arrays with one or three components as well. Writing fails if
   * two arrays have the same channel name. Default off.
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
