// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelEXRReader
 * @brief   reads OpenEXR pictures, flat and deep, and makes points in space of their samples
 *
 * This reader has two outputs. Output 0 is the picture, a vtkImageData of the data window with row
 * 0 at the bottom:
 *
 * | channels of the file        | array of the picture                                            |
 * |-----------------------------|-----------------------------------------------------------------|
 * | R G B (A)                   | point scalars "Color", float[4], float[3] without A             |
 * | Z                           | "Depth", float                                                  |
 * | NAME.X NAME.Y NAME.Z        | NAME, float[3]                                                  |
 * | any other                   | a float array of the channel's name                             |
 * | R G B A Z (ZBack) of a deep | point array "SampleCount", field data array "DeepSamples",      |
 * | file                        | float[5] or float[6];                                           |
 * |                             | "Color" and "Depth" composited from the samples                 |
 *
 * N becomes "Normal", CoC "CircleOfConfusion", coverage "Coverage", fragments "Fragments" and level
 * "Level". Half and integer channels become floats; colours stay premultiplied. Samples that are
 * not sorted by depth are sorted. Other channels of deep files are ignored. The field data
 * "WorldToCamera", "CameraLens" and "ScreenWindow" (Documentation/DataContract.md) are set if the
 * header has them.
 *
 * Output 1 is a vtkPolyData with one vertex per sample; in flat pictures, per pixel with a Depth
 * above 0. Points are of type double. If the header has a camera and a screen window, they are in
 * world coordinates, and Z is taken as the distance along the view direction. Otherwise they are
 * (x + 0.5, y + 0.5, Z), with x and y in pixels. Of a sample with an extent it is the middle.
 * Points have the arrays "Color", premultiplied as in the file, and "Depth"; those of flat pictures
 * have all arrays of their pixels. Samples with non-finite depths make no points.
 *
 * Files with one part are supported, in scan lines or flat tiles, with any order of rows and any
 * compression. Several parts, deep tiles and sub-sampled channels are not supported. For those, and
 * for damaged files, an error is reported, both outputs are empty, and GetErrorCode() is not 0
 * (vtkErrorCode).
 * @code
 * reader = vtkSurfelEXRReader()
 * reader.SetFileName("deep.exr")
 * reader.Update()
 * picture, points = reader.GetOutput(), reader.GetOutputDataObject(1)
 * @endcode
 *
 * @sa vtkSurfelEXRWriter vtkDeepEXRWriter
 */
#ifndef vtkSurfelEXRReader_h
#define vtkSurfelEXRReader_h

#include "vtkImageAlgorithm.h"
#include "vtkSurfelOpenEXRModule.h" // for the export macro

#include <functional> // for the work on a file

namespace SurfelSplatting
{
class EXRInput;
}

class VTKSURFELOPENEXR_EXPORT vtkSurfelEXRReader : public vtkImageAlgorithm
{
public:
  static vtkSurfelEXRReader* New();
  vtkTypeMacro(vtkSurfelEXRReader, vtkImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * The name of the file to read. Default none.
   */
  vtkSetFilePathMacro(FileName);
  vtkGetFilePathMacro(FileName);
  ///@}

  /**
   * Returns 1 if the file begins like an OpenEXR file, else 0.
   */
  static int CanReadFile(VTK_FILEPATH const char* fileName);

  ///@{
  /**
   * Whether to make output 1, which takes about 60 bytes per sample; otherwise it is empty. Default
   * on.
   */
  vtkSetMacro(GeneratePoints, vtkTypeBool);
  vtkGetMacro(GeneratePoints, vtkTypeBool);
  vtkBooleanMacro(GeneratePoints, vtkTypeBool);
  ///@}

protected:
  vtkSurfelEXRReader();
  ~vtkSurfelEXRReader() override;

  int FillOutputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;
  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;

private:
  vtkSurfelEXRReader(const vtkSurfelEXRReader&) = delete;
  void operator=(const vtkSurfelEXRReader&) = delete;

  using Work = std::function<void(SurfelSplatting::EXRInput&)>;

  // Opens the file and does the work. If that fails, reports an error and empties the outputs.
  int Try(const Work& work, vtkInformationVector* outputVector);

  char* FileName = nullptr;
  vtkTypeBool GeneratePoints = 1;
};

#endif
