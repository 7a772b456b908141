// SPDX-License-Identifier: BSD-3-Clause
/**
 * What is known of a scan's sensor, as settings of the filters.
 */
#pragma once

class vtkPointCloudCleaning;
class vtkSurfelEstimation;

namespace SurfelGeometry
{
struct ScanSensor;

/// Changes settings for one execution: at its end they are what they were.
class SensorSettings
{
public:
  SensorSettings(vtkPointCloudCleaning* cleaning, vtkSurfelEstimation* estimation);
  ~SensorSettings();
  SensorSettings(const SensorSettings&) = delete;
  void operator=(const SensorSettings&) = delete;

  /// Fills in what was not set: the depth image and the side of the surfels.
  /// @param seesBacks depth images are seen from both sides
  void Use(const ScanSensor& sensor, bool seesBacks);

  /// @param neighbors 0: as set, but DepthImageNeighbors for a depth image
  void SetNumberOfNeighbors(int neighbors, const ScanSensor& sensor);

private:
  vtkPointCloudCleaning* Cleaning;
  vtkSurfelEstimation* Estimation;
  int Columns, CleaningUseViewpoint, NumberOfNeighbors, OrientationMode, UseViewpoint;
  double CleaningViewpoint[3], Viewpoint[3];
};
}
