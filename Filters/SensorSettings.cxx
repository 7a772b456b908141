// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/SensorSettings.h"

#include "Filters/Arrays/ScanSensor.h"
#include "vtkPointCloudCleaning.h"
#include "vtkSurfelEstimation.h"

namespace SurfelGeometry
{
SensorSettings::SensorSettings(vtkPointCloudCleaning* cleaning, vtkSurfelEstimation* estimation)
  : Cleaning(cleaning)
  , Estimation(estimation)
  , Columns(cleaning->GetColumns())
  , CleaningUseViewpoint(cleaning->GetUseViewpoint())
  , NumberOfNeighbors(estimation->GetNumberOfNeighbors())
  , OrientationMode(estimation->GetOrientationMode())
  , UseViewpoint(estimation->GetUseViewpoint())
{
  cleaning->GetViewpoint(this->CleaningViewpoint);
  estimation->GetViewpoint(this->Viewpoint);
}

SensorSettings::~SensorSettings()
{
  this->Cleaning->SetColumns(this->Columns);
  this->Cleaning->SetUseViewpoint(this->CleaningUseViewpoint);
  this->Cleaning->SetViewpoint(this->CleaningViewpoint);
  this->Estimation->SetNumberOfNeighbors(this->NumberOfNeighbors);
  this->Estimation->SetOrientationMode(this->OrientationMode);
  this->Estimation->SetUseViewpoint(this->UseViewpoint);
  this->Estimation->SetViewpoint(this->Viewpoint);
}

void SensorSettings::Use(const ScanSensor& sensor, bool seesBacks)
{
  const double* v = sensor.Viewpoint;
  if (this->Columns == 0 && !this->CleaningUseViewpoint && sensor.HasViewpoint)
  {
    this->Cleaning->SetColumns(sensor.Columns);
    this->Cleaning->UseViewpointOn();
    this->Cleaning->SetViewpoint(v[0], v[1], v[2]);
  }
  if (this->OrientationMode != vtkSurfelEstimation::CONSISTENT || this->UseViewpoint)
  {
    return;
  }
  if (sensor.HasViewpoint)
  {
    const bool isTwoSided = seesBacks && sensor.IsDepthImage;
    this->Estimation->SetOrientationMode(
      isTwoSided ? vtkSurfelEstimation::TWO_SIDED : vtkSurfelEstimation::VIEWPOINT);
    this->Estimation->SetUseViewpoint(isTwoSided);
    this->Estimation->SetViewpoint(v[0], v[1], v[2]);
  }
  else if (sensor.HasScanners)
  {
    this->Estimation->SetOrientationModeToScanners();
  }
}

void SensorSettings::SetNumberOfNeighbors(int neighbors, const ScanSensor& sensor)
{
  if (neighbors > 0 || sensor.IsDepthImage)
  {
    this->Estimation->SetNumberOfNeighbors(neighbors > 0 ? neighbors : DepthImageNeighbors);
  }
}
}
