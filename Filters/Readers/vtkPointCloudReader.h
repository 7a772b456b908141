// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkPointCloudReader
 * @brief   reads .pcd and .ply point clouds with all their point fields
 *
 * Reads PCL's .pcd files (ascii, binary, binary_compressed) and .ply files (ascii, binary in either
 * byte order): their vertices, and the faces of up to 200000, for vtkPointsOnFaces. The content
 * decides the format, not the file's name. Fields become:
 *
 * | field                              | output                                                  |
 * |------------------------------------|---------------------------------------------------------|
 * | x y z                              | points; double where a float would round them           |
 * | rgb, rgba; red green blue (alpha)  | unsigned char scalars "RGB" or "RGBA"; so do r g b and  |
 * |                                    | diffuse_red .. diffuse_blue                             |
 * | normal_x .. normal_z, nx ny nz     | float "Normals", set as the normals                     |
 * | any other                          | an array of the field's name, type and component count  |
 *
 * An alpha that is 0 in every point or 255 in every point is left out (depth cameras write 0).
 * Points with NaN coordinates are kept, so that an organized cloud keeps its rows; the surfel
 * filters drop and count them. Without faces all points form one poly-vertex cell, so that an
 * ordinary mapper shows them. Faces with corners that do not exist are left out.
 *
 * What is known of the sensor is in the field arrays ScanViewpoint, ScanBounds and (organized
 * clouds) ScanDimensions, for filters that do not know the reader; Documentation/DataContract.md.
 *
 * The ParaView plugin is built without .ply files, which ParaView reads itself.
 *
 * @sa vtkSurfelEstimation
 */
#ifndef vtkPointCloudReader_h
#define vtkPointCloudReader_h

#include "vtkPolyDataAlgorithm.h"
#include "vtkSurfelReadersModule.h" // for the export macro

class VTKSURFELREADERS_EXPORT vtkPointCloudReader : public vtkPolyDataAlgorithm
{
public:
  static vtkPointCloudReader* New();
  vtkTypeMacro(vtkPointCloudReader, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * The file to read. Default: none.
   */
  vtkSetFilePathMacro(FileName);
  vtkGetFilePathMacro(FileName);
  ///@}

  /**
   * 1 if the file begins like a .ply or .pcd file, else 0.
   */
  static int CanReadFile(VTK_FILEPATH const char* fileName);

  ///@{
  /**
   * Position of the sensor in the coordinates of the points, and whether the file has one. Valid
   * after an update. A .pcd header always has a viewpoint; its default (0, 0, 0) counts only for
   * an organized cloud, which is one depth image seen from the origin.
   */
  vtkGetVector3Macro(Viewpoint, double);
  vtkGetMacro(HasViewpoint, bool);
  ///@}

  /**
   * Columns and rows of an organized cloud (one depth image, row by row); (number of points, 1)
   * otherwise. Valid after an update.
   */
  vtkGetVector2Macro(Dimensions, int);

protected:
  vtkPointCloudReader();
  ~vtkPointCloudReader() override;

  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;

  char* FileName = nullptr;
  double Viewpoint[3] = { 0.0, 0.0, 0.0 };
  bool HasViewpoint = false;
  int Dimensions[2] = { 0, 0 };

private:
  vtkPointCloudReader(const vtkPointCloudReader&) = delete;
  void operator=(const vtkPointCloudReader&) = delete;

  void Read(vtkPolyData* output);
};

#endif
