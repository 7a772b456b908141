// SPDX-License-Identifier: BSD-3-Clause
/**
 * What the field arrays of a scan say of its sensor (Documentation/DataContract.md).
 */
#pragma once

class vtkPointSet;

namespace SurfelSplatting
{
class Ranks;
}

namespace SurfelGeometry
{
/// Normals of depth images, which are noisy and quantised along the line of sight, need more
/// neighbours. In other scans more neighbours would blur fine detail.
constexpr int DepthImageNeighbors = 30;

struct ScanSensor
{
  bool HasViewpoint = false;
  double Viewpoint[3] = { 0.0, 0.0, 0.0 }; // world units
  bool IsDepthImage = false;
  bool HasScanners = false; // some points know theirs (FindScanners in InputArrays.h)
  int Columns = 0;          // of a depth image whose points are all here, row by row; otherwise 0
};

/// No more than HasScanners, if the points are no longer those of the file: moved, cut or merged.
/// @param ranks have the pieces of one cloud, all of them call this; null: this process is alone
ScanSensor FindSensor(vtkPointSet* points, SurfelSplatting::Ranks* ranks);
}
