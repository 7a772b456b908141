// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Arrays/ScanSensor.h"

#include "Core/Base/Ranks.h"
#include "Filters/Arrays/InputArrays.h"

#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkPointSet.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace SurfelGeometry
{
namespace
{
constexpr double Infinity = std::numeric_limits<double>::infinity();

/// Bounds of no points.
constexpr double NoBounds[6] = { Infinity, -Infinity, Infinity, -Infinity, Infinity, -Infinity };

/// What one process has of a cloud; world units.
struct SensorPiece
{
  double Count = 0.0; // of its points
  double Bounds[6];   // of its points
  bool HasScan = false, HasViewpoint = false, HasScanners = false;
  double ScanBounds[6] = {}, Viewpoint[3] = {};
  double Dimensions[2] = { 0.0, 0.0 }; // columns, rows
};

/// Reads a field array of so many values. False if there is none.
template <int Count>
bool ReadField(vtkPointSet* points, const char* name, double (&values)[Count])
{
  vtkDataArray* array = points->GetFieldData()->GetArray(name);
  if (!array || array->GetNumberOfTuples() != 1 || array->GetNumberOfComponents() != Count)
  {
    return false;
  }
  array->GetTuple(0, values);
  return true;
}

SensorPiece ReadPiece(vtkPointSet* points)
{
  SensorPiece piece;
  std::copy_n(NoBounds, 6, piece.Bounds);
  if (!points)
  {
    return piece;
  }
  double origin[3];
  ReadOrigin(points, origin);
  piece.Count = static_cast<double>(points->GetNumberOfPoints());
  if (points->GetNumberOfPoints() > 0)
  {
    points->GetBounds(piece.Bounds);
  }
  vtkDataArray* toScanner = FindScanners(points);
  piece.HasScanners = toScanner && toScanner->GetMaxNorm() > 0.0; // 0: unknown
  piece.HasScan = ReadField(points, "ScanBounds", piece.ScanBounds);
  piece.HasViewpoint = ReadField(points, "ScanViewpoint", piece.Viewpoint);
  ReadField(points, "ScanDimensions", piece.Dimensions);
  for (int c = 0; c < 6; ++c)
  {
    piece.Bounds[c] += origin[c / 2];
    piece.ScanBounds[c] += origin[c / 2];
  }
  for (int c = 0; c < 3; ++c)
  {
    piece.Viewpoint[c] += origin[c];
  }
  return piece;
}

std::vector<SensorPiece> ReadPieces(vtkPointSet* points, SurfelSplatting::Ranks* ranks)
{
  std::vector<SensorPiece> pieces = { ReadPiece(points) };
  if (ranks)
  {
    const SensorPiece own = pieces[0];
    pieces.clear();
    for (const SurfelSplatting::Message& other :
      ranks->Share([&] { return SurfelSplatting::MessageOf(own); }))
    {
      pieces.push_back(SurfelSplatting::MessageReader(other).Get<SensorPiece>());
    }
  }
  return pieces;
}
}

ScanSensor FindSensor(vtkPointSet* points, SurfelSplatting::Ranks* ranks)
{
  const std::vector<SensorPiece> pieces = ReadPieces(points, ranks);
  const auto scan = std::find_if(
    pieces.begin(), pieces.end(), [](const SensorPiece& piece) { return piece.HasScan; });
  ScanSensor sensor;
  sensor.HasScanners = std::any_of(
    pieces.begin(), pieces.end(), [](const SensorPiece& piece) { return piece.HasScanners; });
  if (scan == pieces.end())
  {
    return sensor;
  }
  double bounds[6], count = 0.0;
  std::copy_n(NoBounds, 6, bounds);
  for (const SensorPiece& piece : pieces)
  {
    count += piece.Count;
    for (int c = 0; c < 6; c += 2)
    {
      bounds[c] = std::min(bounds[c], piece.Bounds[c]);
      bounds[c + 1] = std::max(bounds[c + 1], piece.Bounds[c + 1]);
    }
  }
  if (!std::equal(bounds, bounds + 6, scan->ScanBounds))
  {
    return sensor;
  }
  sensor.HasViewpoint = scan->HasViewpoint;
  std::copy_n(scan->Viewpoint, sensor.HasViewpoint ? 3 : 0, sensor.Viewpoint);
  const double columns = scan->Dimensions[0], rows = scan->Dimensions[1];
  sensor.IsDepthImage = columns > 1.0 && rows > 1.0 && columns * rows == count;
  const bool isWhole = points && static_cast<double>(points->GetNumberOfPoints()) == count;
  sensor.Columns = sensor.IsDepthImage && isWhole ? static_cast<int>(columns) : 0;
  return sensor;
}
}
