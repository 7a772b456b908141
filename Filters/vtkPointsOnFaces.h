// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkPointsOnFaces
 * @brief   points on the faces of a mesh, if its vertices do not tell the surface
 *
 * For vtkPointsToSurfels the vertices of a mesh are points like others. Dense meshes, such as
 * scans, are drawn well by them. Those of CAD, furniture, cars and animated characters have too few
 * vertices, or hardly any where they are flat. Of such meshes this filter makes points that are
 * spread evenly over the faces, densest on thin parts such as wires. Other meshes, and clouds, are
 * passed as they are; GetLack() tells which.
 *
 * Real numbers, colours (unsigned char, three or four components) and normals are interpolated;
 * other point data are those of the nearest corner. Field data are passed, cells are not. The
 * points are double, and the same ones each time. For vtkSurfelEstimation normals are given, and
 * their sides those of the faces: the field array ModelHasFaces says so.
 *
 * The limits are those of pictures of about 800 x 600 pixels.
 *
 * @sa vtkPointsToSurfels
 */
#ifndef vtkPointsOnFaces_h
#define vtkPointsOnFaces_h

#include "vtkPolyDataAlgorithm.h"
#include "vtkSmartPointer.h"        // for the parts
#include "vtkSurfelFiltersModule.h" // for export macro

class vtkIdTypeArray;

class VTKSURFELFILTERS_EXPORT vtkPointsOnFaces : public vtkPolyDataAlgorithm
{
public:
  static vtkPointsOnFaces* New();
  vtkTypeMacro(vtkPointsOnFaces, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * About how many points are made; as many as the mesh has, if it has more. Default 200000, range
   * 1 to 2^30.
   */
  vtkSetClampMacro(NumberOfPoints, vtkIdType, 1, vtkIdType(1) << 30);
  vtkGetMacro(NumberOfPoints, vtkIdType);
  ///@}

  ///@{
  /**
   * Whether a mesh without normals gets those of its faces, smooth but for creases, if faces that
   * meet agree on their sides; those of parts that are inside out are wrong. Default on.
   */
  vtkSetMacro(MakeNormals, vtkTypeBool);
  vtkGetMacro(MakeNormals, vtkTypeBool);
  vtkBooleanMacro(MakeNormals, vtkTypeBool);
  ///@}

  enum Lacks
  {
    NO_LACK = 0,             ///< the vertices tell the surface, or there are no faces
    TOO_FEW_VERTICES = 1,    ///< below 50000
    TOO_UNEVEN_VERTICES = 2, ///< half of the area is in faces that are too large for their number
  };

  /**
   * Why the last input got points on its faces, if it did.
   */
  vtkGetMacro(Lack, int);

  /**
   * Whether the last input is a mesh as modelling programs make, whose axes are known, not a scan:
   * one of few vertices, or of uneven ones.
   */
  vtkGetMacro(IsModel, bool);

  /**
   * Of the points on faces, the number of the connected part that each is on, from 0: faces that
   * share an edge and agree on their sides. Null if there are no normals.
   */
  vtkIdTypeArray* GetParts();

  /**
   * Meshes of more vertices are passed without looking at their faces, which takes too long and
   * hardly ever finds a lack.
   */
  static vtkIdType GetMaximumNumberOfVertices();

protected:
  vtkPointsOnFaces();
  ~vtkPointsOnFaces() override;

  int RequestData(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;

private:
  vtkPointsOnFaces(const vtkPointsOnFaces&) = delete;
  void operator=(const vtkPointsOnFaces&) = delete;

  class Execution;

  vtkIdType NumberOfPoints = 200000;
  vtkTypeBool MakeNormals = 1;
  int Lack = NO_LACK;
  bool IsModel = false;
  vtkSmartPointer<vtkIdTypeArray> Parts;
};

#endif
