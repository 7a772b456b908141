// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelEXRReader
 * @brief   reads OpenEXR pictures, flat and deep, and where their samples are in space
 *
 * Output 0 is the picture, a vtkImageData of the data window, row 0 at the bottom:
 *
 * | channels of the file        | array of the picture                                            |
 * |-----------------------------|-----------------------------------------------------------------|
 * | R G B (A)                   | point scalars "Color", float[4], float[3] without A             |
 * | Z                           | "Depth", float                                                  |
 * | NAME.X NAME.Y NAME.Z        | NAME, float[3]                                                  |
 * | any other                   | a float array of the channel's name                             |
 * | R G B A Z of a deep file    | point array "SampleCount", field data array "DeepSamples";      |
 * |                             | "Color" and "Depth" as the samples give them                    |
 *
 * N becomes "Normal", CoC "CircleOfConfusion", coverage "Coverage", fragments "Fragments" and level
 * "Level". Half and integer channels become floats; colours stay premultiplied. Samples are sorted
 * by depth where they are not; other channels of deep files are passed over, their samples taken as
 * points. Field data "WorldToCamera", "CameraLens" and "ScreenWindow"
 * (Documentation/DataContract.md) are there where the header has them.
 *
 * Output 1 is a vtkPolyData with one vertex per sample, or per pixel with a Depth above 0 of a flat
 * picture, double points: in world coordinates where the header has a camera and a screen window,
 * Z being the distance along the view direction; otherwise (x + 0.5, y + 0.5, Z), x and y in
 * pixels. Points carry "Color", premultiplied as in the file, and "Depth", those of flat pictures
 * all arrays of their pixels. Non-finite depths make no points.
 *
 * Scan lines and tiles of one part are read, in any order of rows and with any compression. What is
 * not, such as several parts, deep tiles and sub-sampled channels, is an error, and so are damaged
 * files: both outputs are empty then, and GetErrorCode() is not 0 (vtkErrorCode).
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

#include <functional> // for what is tried

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
   * The file to read. Default: none.
   */
  vtkSetFilePathMacro(FileName);
  vtkGetFilePathMacro(FileName);
  ///@}

  /**
   * 1 if the file begins like an OpenEXR file, else 0.
   */
  static int CanReadFile(VTK_FILEPATH const char* fileName);

  ///@{
  /**
   * Whether output 1 is made, about 60 bytes per sample; empty otherwise. Default on.
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

  // Opens the file for the work. What goes wrong is reported; the outputs are empty then.
  int Try(const Work& work, vtkInformationVector* outputVector);

  char* FileName = nullptr;
  vtkTypeBool GeneratePoints = 1;
};

#endif
