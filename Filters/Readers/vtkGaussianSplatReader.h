// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkGaussianSplatReader
 * @brief   reads captures of 3D Gaussian splatting
 *
 * Reads the .ply files of the reference implementation (B. Kerbl, G. Kopanas, T. Leimkuehler,
 * G. Drettakis. 3D Gaussian Splatting for Real-Time Radiance Field Rendering. SIGGRAPH 2023), ascii
 * and binary in either byte order, .splat files, and Niantic's .spz files. The output has the
 * arrays of Documentation/DataContract.md, "Gaussians in space":
 *
 * | output                         | from .ply                         | from .splat             |
 * |--------------------------------|-----------------------------------|-------------------------|
 * | points                         | x y z; doubles stay doubles       | 3 floats                |
 * | GaussianCovariance, float[6]   | exp(scale_i), rot_i = w x y z     | 3 floats, last 4 bytes  |
 * | GaussianOpacity, float         | 1 / (1 + exp(-opacity))           | A of 4 bytes R G B A    |
 * | GaussianHarmonics, float[3 K]  | f_dc_i, f_rest_i; K = 1, 4, 9, 16 |                         |
 * | RGB, unsigned char[3], scalars |                                   | R G B of these          |
 *
 * Quaternions need not have unit length; those of .splat files are (byte - 128) / 128. Other
 * properties of a vertex, such as nx ny nz, and elements behind the vertices are ignored. Points
 * stay where the file has them. All points form one poly-vertex cell, so that an ordinary mapper
 * shows them.
 *
 * Gaussians of which a value is not finite are left out and counted: a scale whose square passes
 * the range of floats, a quaternion of length 0, NaN anywhere. Infinite logits of the opacity are 0
 * and 1, and a scale of 0 gives a flat Gaussian.
 *
 * The header is checked against the size of the file before memory is allocated. Binary files are
 * decoded while they are read, so that no copy of the file is in memory; of .spz files, which hold
 * one column after another, 19 to 65 bytes for each Gaussian are.
 *
 * The compressed .ply files of SuperSplat and PlayCanvas (packed_position, PackedGaussians.h) have
 * the same output as .ply files. Their values are as exact as their 16 bytes for each Gaussian.
 *
 * .spz files of versions 2 to 4 (SPZGaussians.h) have the same output as .ply files, and the axes
 * of these: right, down, front, where .spz mostly has right, up, back. So a capture that was
 * converted from .ply looks as before. Places are exact to half of the step that the file's
 * fractional bits give, mostly 1 / 4096, scales to 3 %; harmonics from degree 1 on are from -1
 * to 1.
 *
 * Version 4 is compressed by zstd: it gets an error where the module was built without libzstd.
 *
 * Not supported: .sog, which the Python package reads.
 *
 * @sa vtkPointCloudReader
 */
#ifndef vtkGaussianSplatReader_h
#define vtkGaussianSplatReader_h

#include "vtkPolyDataAlgorithm.h"
#include "vtkSurfelReadersModule.h" // for the export macro

#include <string>

class VTKSURFELREADERS_EXPORT vtkGaussianSplatReader : public vtkPolyDataAlgorithm
{
public:
  static vtkGaussianSplatReader* New();
  vtkTypeMacro(vtkGaussianSplatReader, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * The file to read. Default: none.
   */
  vtkSetFilePathMacro(FileName);
  vtkGetFilePathMacro(FileName);
  ///@}

  /**
   * 1 if the file is a capture: a .ply file with scale_0, rot_0 and opacity in its header, or with
   * packed_position and chunks; a gzip stream that begins with NGSP, or a file that does, of any
   * version of .spz; or any other file that is not empty and is named .splat, since these have no
   * header. Else 0, for example for a scan.
   */
  static int CanReadFile(VTK_FILEPATH const char* fileName);

  /**
   * For readers of other formats: an error message if so many Gaussians with so many harmonics, and
   * other bytes for each of them, do not fit into memory; empty if they do.
   */
  static std::string CheckMemory(vtkIdType gaussians, int harmonics, double otherBytes);

  /**
   * How many Gaussians of the file were left out because a value is not finite. Valid after an
   * update.
   */
  vtkGetMacro(NumberOfInvalidGaussians, vtkIdType);

  /**
   * Whether the file says that the capture was trained with antialiasing, as .spz files can. It is
   * then meant to be drawn with vtkSurfelSplatter::SetKeepCaptureMass. Valid after an update.
   */
  vtkGetMacro(Antialiased, bool);

protected:
  vtkGaussianSplatReader() { this->SetNumberOfInputPorts(0); }
  ~vtkGaussianSplatReader() override { this->SetFileName(nullptr); }

  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;

  char* FileName = nullptr;
  vtkIdType NumberOfInvalidGaussians = 0;
  bool Antialiased = false;

private:
  vtkGaussianSplatReader(const vtkGaussianSplatReader&) = delete;
  void operator=(const vtkGaussianSplatReader&) = delete;

  void Read(vtkPolyData* output);
};

#endif
