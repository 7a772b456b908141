// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkDeepEXRWriter
 * @brief   writes the layers of a picture as a deep OpenEXR file
 *
 * This writer takes one 2D image with the deep samples of a vtkSurfelSplatter (DeepSamplesOn()):
 * the point array "SampleCount" (unsigned int; number of samples of each pixel) and the field data
 * array "DeepSamples" (float[5]; pixel after pixel from the bottom row up, nearest first:
 * premultiplied R, G, B, then A in (0, 1], then the depth; or float[6]: then the depth where
 * the sample ends).
 *
 * The file has deep scan lines, ZIPS compressed, top row first, with the channels R, G, B, A and Z,
 * 32-bit float, and ZBack for float[6]. Z is the distance along the camera's view direction (not
 * along the pixel's ray) in world units. Samples of a vtkSurfelSplatter are tidy: sorted, no two at
 * one depth, none within another. Composited front to back they give the picture without
 * background, exactly so with any number of lens cells (DeepImage.h).
 * @code
 * renderer.GetSplatter().DeepSamplesOn()
 * writer = vtkDeepEXRWriter()
 * writer.SetInputConnection(renderer.GetOutputPort())
 * writer.SetFileName("out.exr")
 * writer.Write()
 * @endcode
 *
 * @sa vtkSurfelEXRReader vtkSurfelImageRenderer vtkSurfelEXRWriter
 */
#ifndef vtkDeepEXRWriter_h
#define vtkDeepEXRWriter_h

#include "vtkEXRWriterBase.h"
#include "vtkSurfelOpenEXRModule.h" // for the export macro

class VTKSURFELOPENEXR_EXPORT vtkDeepEXRWriter : public vtkEXRWriterBase
{
public:
  static vtkDeepEXRWriter* New();
  vtkTypeMacro(vtkDeepEXRWriter, vtkEXRWriterBase);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Whether the header declares the samples tidy (attribute deepImageState). The samples are tidy
   * in any case. OpenEXR's own Python package (3.5.3) refuses to open a file with this attribute;
   * other readers use or ignore it. Switch it on for compositors that would otherwise sort the
   * samples. Default off.
   */
  vtkSetMacro(DeepImageState, vtkTypeBool);
  vtkGetMacro(DeepImageState, vtkTypeBool);
  vtkBooleanMacro(DeepImageState, vtkTypeBool);
  ///@}

  /**
   * Number of samples in the file that was written last.
   */
  vtkGetMacro(NumberOfSamples, vtkIdType);

protected:
  vtkDeepEXRWriter();
  ~vtkDeepEXRWriter() override;

#ifndef __VTK_WRAP__
  void WriteStream(vtkImageData* image, std::ofstream& file, const std::string& path) override;
#endif

private:
  vtkDeepEXRWriter(const vtkDeepEXRWriter&) = delete;
  void operator=(const vtkDeepEXRWriter&) = delete;

  vtkTypeBool DeepImageState = 0;
  vtkIdType NumberOfSamples = 0;
};

#endif
