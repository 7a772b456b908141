// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Volumes/ImageGaussians.h"

#include "Filters/Volumes/CellGaussians.h"
#include "Filters/Volumes/GradientNormals.h"

#include "vtkArrayDispatch.h"
#include "vtkDataArrayRange.h"
#include "vtkDataSetAttributes.h"
#include "vtkImageData.h"
#include "vtkMatrix3x3.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace SurfelVolumes
{
namespace
{
/// Squares of lengths must fit into floats.
constexpr double LeastSpacing = 1e-15, LargestSpacing = 1e15;

/// World from index coordinates: the linear part, row by row.
struct Axes
{
  explicit Axes(vtkImageData* image)
  {
    for (int row = 0; row < 3; ++row)
    {
      for (int column = 0; column < 3; ++column)
      {
        this->A[row][column] =
          image->GetDirectionMatrix()->GetElement(row, column) * image->GetSpacing()[column];
      }
    }
  }

  double Volume() const
  {
    const auto& a = this->A;
    return std::abs(a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
      a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
      a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]));
  }

  double A[3][3];
};

/// Copies a component of consecutive tuples.
struct CopyScalars
{
  template <typename Array>
  void operator()(Array* array, vtkIdType begin, int component, std::vector<double>& values) const
  {
    const auto count = static_cast<vtkIdType>(values.size());
    const auto tuples = vtk::DataArrayTupleRange(array, begin, begin + count);
    for (vtkIdType i = 0; i < count; ++i)
    {
      values[i] = static_cast<double>(tuples[i][component]);
    }
  }
};

/// The array if it has so many values, else null.
vtkUnsignedCharArray* Fitting(vtkUnsignedCharArray* ghosts, vtkIdType count)
{
  return ghosts && ghosts->GetNumberOfValues() == count ? ghosts : nullptr;
}

/// The slices z - 1 to z + 2 of points; the first and the last are empty where not needed.
using Slices = std::array<std::vector<double>, 4>;

/// Red, green and blue of the slices z and z + 1; empty where the table gives the colours.
using ColorSlices = std::array<std::array<std::vector<double>, 3>, 2>;

/// The number that stands for the brightest red, green or blue.
double LargestColor(vtkDataArray* colors)
{
  const int type = colors->GetDataType();
  return type == VTK_UNSIGNED_CHAR ? 255.0 : type == VTK_UNSIGNED_SHORT ? 65535.0 : 1.0;
}

/// A corner of a cell: the cell's place, and which of the two points along each axis.
struct CellCorner
{
  std::array<vtkIdType, 3> Cell;
  std::array<int, 3> Side; // 0 or 1

  vtkIdType operator[](int axis) const { return this->Cell[axis] + this->Side[axis]; }
};

/// The cells of an image, slice by slice.
class ImageCells
{
public:
  ImageCells(
    vtkImageData* image, const ImageScalars& scalars, const TransferTable& table, int subdivision)
    : Scalars(scalars)
    , PointGhosts(Fitting(image->GetPointGhostArray(), image->GetNumberOfPoints()))
    , CellGhosts(Fitting(image->GetCellGhostArray(), image->GetNumberOfCells()))
    , Table(table)
    , World(image)
    , Normals(this->World.A)
    , Settings{ subdivision, std::cbrt(this->World.Volume()) }
    , NeedsNormals(scalars.Normals != nullptr)
  {
    image->GetDimensions(this->Size);
  }

  /// Appends the Gaussians of the cells between the slices z and z + 1.
  void Append(vtkIdType z, GaussianPart& part) const
  {
    const vtkIdType nx = this->Size[0], ny = this->Size[1];
    const Slices slices = this->ReadSlices(z);
    const Slices others = this->HasOtherNormals() ? this->ReadSlicesOfNormals(z) : Slices();
    const Slices& ofNormals = this->HasOtherNormals() ? others : slices;
    const ColorSlices colorSlices = this->ReadColors(z);
    std::vector<CellGaussian> found;
    std::array<std::array<double, 3>, 8> normals, colors;
    CellCorners corners;
    corners.Colors = this->Scalars.AreDependent ? &colors : nullptr;
    corners.Normals = this->NeedsNormals ? &normals : nullptr;
    for (vtkIdType y = 0; y < ny - 1; ++y)
    {
      for (vtkIdType x = 0; x < nx - 1; ++x)
      {
        for (int i = 0; i < 8; ++i)
        {
          corners.Scalars[i] = slices[1 + (i >> 2)][(y + (i >> 1 & 1)) * nx + x + (i & 1)];
        }
        if (!this->IsUsable(corners.Scalars, x, y, z) || IsEmptyCell(corners.Scalars, this->Table))
        {
          continue;
        }
        for (int i = 0; this->NeedsNormals && i < 8; ++i)
        {
          normals[i] = this->FindNormal(ofNormals, { { x, y, z }, { i & 1, i >> 1 & 1, i >> 2 } });
        }
        for (int i = 0; this->Scalars.AreDependent && i < 8; ++i)
        {
          for (int k = 0; k < 3; ++k)
          {
            colors[i][k] = colorSlices[i >> 2][k][(y + (i >> 1 & 1)) * nx + x + (i & 1)];
          }
        }
        found.clear();
        AppendCellGaussians(corners, this->Table, this->Settings, found);
        for (const CellGaussian& gaussian : found)
        {
          part.Gaussians.push_back(this->ToWorld(gaussian, x, y, z));
          part.Normals.insert(
            part.Normals.end(), gaussian.Normal, gaussian.Normal + (this->NeedsNormals ? 3 : 0));
        }
      }
    }
  }

private:
  bool HasOtherNormals() const
  {
    return this->NeedsNormals && this->Scalars.Normals->Array != this->Scalars.Array;
  }

  /// Scalars that are classified, with neighbours where normals need them.
  Slices ReadSlices(vtkIdType z) const
  {
    const bool hasNeighbors = this->NeedsNormals && !this->HasOtherNormals();
    Slices slices;
    for (int i = hasNeighbors ? 0 : 1; i < (hasNeighbors ? 4 : 3); ++i)
    {
      slices[i] =
        this->ReadSlice(z - 1 + i, this->Scalars.Array, ClassifiedComponent(this->Scalars));
    }
    return slices;
  }

  /// What normals come from, where these are not the scalars that are classified.
  Slices ReadSlicesOfNormals(vtkIdType z) const
  {
    Slices slices;
    for (int i = 0; i < 4; ++i)
    {
      slices[i] = this->ReadSlice(z - 1 + i, this->Scalars.Normals->Array, 0);
    }
    return slices;
  }

  ColorSlices ReadColors(vtkIdType z) const
  {
    ColorSlices slices;
    const double scale = 1.0 / LargestColor(this->Scalars.Array);
    for (int i = 0; this->Scalars.AreDependent && i < 2; ++i)
    {
      for (int k = 0; k < 3; ++k)
      {
        slices[i][k] = this->ReadComponent(z + i, this->Scalars.Array, k);
        for (double& value : slices[i][k])
        {
          value = value > 0.0 ? std::min(1.0, scale * value) : 0.0; // NaN becomes 0
        }
      }
    }
    return slices;
  }

  /// Normal of a corner as its cell has it.
  std::array<double, 3> FindNormal(const Slices& slices, const CellCorner& corner) const
  {
    std::array<double, 3> derivatives;
    for (int axis = 0; axis < 3; ++axis)
    {
      derivatives[axis] = this->FindDerivative(slices, corner, axis);
    }
    return this->Normals(derivatives);
  }

  double FindDerivative(const Slices& slices, const CellCorner& corner, int axis) const
  {
    const double scalar = this->ScalarAt(slices, corner, axis, 0);
    if (!(std::abs(scalar) <= LargestScalar))
    {
      return 0.0; // the scalars that are classified are finite
    }
    const double low = this->ScalarAt(slices, corner, axis, -1);
    const double high = this->ScalarAt(slices, corner, axis, 1);
    const double outside = this->Scalars.Normals->Outside(scalar);
    const auto& ends = this->Scalars.Normals->AreEnds;
    const bool isFirst = ends[2 * axis] && corner.Cell[axis] == 0;
    const bool isLast = ends[2 * axis + 1] && corner.Cell[axis] == this->Size[axis] - 2;
    if (!(isFirst || isLast) || std::isnan(outside))
    {
      return Difference(low, scalar, high);
    }
    // Where a single cell lies between two faces, each corner is at its own.
    const bool isLow = isFirst && !(isLast && corner.Side[axis] == 1);
    return isLow ? -FaceDifference(high, scalar, outside) : FaceDifference(low, scalar, outside);
  }

  /// The scalar at a corner, or of a neighbour along an axis; NaN beyond the image.
  double ScalarAt(const Slices& slices, const CellCorner& corner, int axis, int step) const
  {
    std::array<vtkIdType, 3> place{ corner[0], corner[1], corner[2] };
    place[axis] += step;
    if (place[axis] < 0 || place[axis] >= this->Size[axis])
    {
      return std::numeric_limits<double>::quiet_NaN();
    }
    const vtkIdType slice = place[2] - corner.Cell[2] + 1;
    return slices[slice][place[1] * this->Size[0] + place[0]];
  }

  std::vector<double> ReadComponent(vtkIdType z, vtkDataArray* array, int component) const
  {
    const vtkIdType count = vtkIdType{ this->Size[0] } * this->Size[1];
    std::vector<double> values(count);
    if (!vtkArrayDispatch::Dispatch::Execute(array, CopyScalars(), z * count, component, values))
    {
      CopyScalars()(array, z * count, component, values);
    }
    return values;
  }

  /// Scalars of a slice of points; NaN at hidden points, none beyond the image.
  std::vector<double> ReadSlice(vtkIdType z, vtkDataArray* array, int component) const
  {
    if (z < 0 || z >= this->Size[2])
    {
      return {};
    }
    std::vector<double> values = this->ReadComponent(z, array, component);
    const auto count = static_cast<vtkIdType>(values.size());
    for (vtkIdType i = 0; this->PointGhosts && i < count; ++i)
    {
      if (this->PointGhosts->GetValue(z * count + i) & vtkDataSetAttributes::HIDDENPOINT)
      {
        values[i] = std::numeric_limits<double>::quiet_NaN();
      }
    }
    return values;
  }

  bool IsUsable(const std::array<double, 8>& corners, vtkIdType x, vtkIdType y, vtkIdType z) const
  {
    constexpr int dropped = vtkDataSetAttributes::HIDDENCELL | vtkDataSetAttributes::DUPLICATECELL;
    const vtkIdType cell = (z * (this->Size[1] - 1) + y) * (this->Size[0] - 1) + x;
    return std::all_of(corners.begin(), corners.end(),
             [](double s) { return std::abs(s) <= LargestScalar; }) &&
      !(this->CellGhosts && (this->CellGhosts->GetValue(cell) & dropped));
  }

  /// Places relative to the centre: C' = A C A^T, and the extinction stays.
  Gaussian ToWorld(const CellGaussian& cell, vtkIdType x, vtkIdType y, vtkIdType z) const
  {
    const vtkIdType index[3] = { x, y, z };
    double place[3];
    for (int k = 0; k < 3; ++k)
    {
      place[k] = static_cast<double>(index[k]) + cell.Center[k] - 0.5 * (this->Size[k] - 1);
    }
    const double* c = cell.Covariance;
    const double full[3][3] = { { c[0], c[3], c[5] }, { c[3], c[1], c[4] }, { c[5], c[4], c[2] } };
    constexpr int pairs[6][2] = { { 0, 0 }, { 1, 1 }, { 2, 2 }, { 0, 1 }, { 1, 2 }, { 0, 2 } };
    const auto& a = this->World.A;
    Gaussian gaussian;
    for (int k = 0; k < 3; ++k)
    {
      gaussian.Position[k] =
        static_cast<float>(a[k][0] * place[0] + a[k][1] * place[1] + a[k][2] * place[2]);
      gaussian.Color[k] = ColorByte(cell.Color[k]);
    }
    for (int k = 0; k < 6; ++k)
    {
      double sum = 0.0;
      for (int i = 0; i < 9; ++i)
      {
        sum += a[pairs[k][0]][i / 3] * full[i / 3][i % 3] * a[pairs[k][1]][i % 3];
      }
      gaussian.Covariance[k] = static_cast<float>(sum);
    }
    gaussian.Extinction = static_cast<float>(cell.Extinction);
    return gaussian;
  }

  ImageScalars Scalars;
  vtkUnsignedCharArray *PointGhosts, *CellGhosts;
  const TransferTable& Table;
  Axes World;
  GradientNormals Normals;
  CellSettings Settings;
  bool NeedsNormals;
  int Size[3];
};
}

int ClassifiedComponent(const ImageScalars& scalars)
{
  return scalars.AreDependent ? 3 : 0;
}

std::string CheckImage(vtkImageData* image, vtkDataArray* scalars)
{
  int size[3];
  image->GetDimensions(size);
  if (*std::min_element(size, size + 3) < 2)
  {
    return "The image has " + std::to_string(size[0]) + " x " + std::to_string(size[1]) + " x " +
      std::to_string(size[2]) +
      " points, so it is no volume: it needs at least 2 points along each axis.";
  }
  if (!scalars || scalars->GetNumberOfTuples() != image->GetNumberOfPoints())
  {
    return "The image has no scalars at its points. Choose an array with "
           "SetInputArrayToProcess(), and turn cell data into point data with "
           "vtkCellDataToPointData.";
  }
  const double* spacing = image->GetSpacing();
  const auto [least, most] = std::minmax({ spacing[0], spacing[1], spacing[2] });
  const double volume = Axes(image).Volume();
  if (!(least > 0.0) || !(volume > 0.0))
  {
    return "The cells of the image have no volume: their sides are " + std::to_string(spacing[0]) +
      ", " + std::to_string(spacing[1]) + " and " + std::to_string(spacing[2]) +
      ". Set a spacing above 0 and a direction matrix that can be inverted.";
  }
  if (!(least >= LeastSpacing && most <= LargestSpacing) || !std::isfinite(volume))
  {
    return "The spacing of the image must be from 1e-15 to 1e15: use other units of length.";
  }
  return std::string();
}

bool CollectImage(vtkImageData* image, const ImageScalars& scalars, const TransferTable& table,
  int subdivision, const SurfelGeometry::StageProgress& progress, GaussianCollection& collection)
{
  const ImageCells cells(image, scalars, table, subdivision);
  return collection.Collect(image->GetDimensions()[2] - 1, progress,
    [&cells](vtkIdType z, GaussianPart& part) { cells.Append(z, part); });
}

void FindCenter(vtkImageData* image, double center[3])
{
  int extent[6];
  image->GetExtent(extent);
  double index[3];
  for (int k = 0; k < 3; ++k)
  {
    index[k] = 0.5 * (extent[2 * k] + extent[2 * k + 1]);
  }
  image->TransformContinuousIndexToPhysicalPoint(index, center);
}
}
