// SPDX-License-Identifier: BSD-3-Clause
#include "vtkPVPointsToSurfels.h"

#include "vtkPointCloudCleaning.h"
#include "vtkSurfelEstimation.h"

#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkInformation.h>
#include <vtkMultiProcessController.h>
#include <vtkObjectFactory.h>
#include <vtkPointSet.h>

#include <algorithm>

vtkStandardNewMacro(vtkPVPointsToSurfels);

namespace
{
// As the command line: normals of depth images need more neighbours.
constexpr int UsualNeighbors = 16;
constexpr int DepthImageNeighbors = 30;

/// What the reader knows about the sensor.
struct Sensor
{
  bool HasViewpoint = false;
  double Viewpoint[3] = { 0.0, 0.0, 0.0 }; // world units
  int Columns = 0;                         // of a depth image, else 0
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

/// Nothing if the points are no longer those of the file.
Sensor FindSensor(vtkPointSet* points)
{
  Sensor sensor;
  double bounds[6], dimensions[2];
  if (!points || !ReadField(points, "ScanBounds", bounds) ||
    !std::equal(bounds, bounds + 6, points->GetBounds()))
  {
    return sensor;
  }
  sensor.HasViewpoint = ReadField(points, "ScanViewpoint", sensor.Viewpoint);
  if (ReadField(points, "ScanDimensions", dimensions) &&
    dimensions[0] * dimensions[1] == static_cast<double>(points->GetNumberOfPoints()))
  {
    sensor.Columns = static_cast<int>(dimensions[0]);
  }
  return sensor;
}
}

vtkPVPointsToSurfels::vtkPVPointsToSurfels() = default;
vtkPVPointsToSurfels::~vtkPVPointsToSurfels() = default;

int vtkPVPointsToSurfels::RequestData(
  vtkInformation* request, vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  vtkMultiProcessController* controller = this->GetEstimation()->GetController();
  const bool isAlone = !controller || controller->GetNumberOfProcesses() < 2;
  // Several processes must agree, and only one of them has the file.
  const Sensor sensor = isAlone ? FindSensor(vtkPointSet::GetData(inputVector[0])) : Sensor();
  this->SetCleanPoints(this->CleaningMode != CLEANING_OFF);
  this->GetCleaning()->SetSmoothing(this->CleaningMode == CLEANING_FULL);
  this->GetCleaning()->SetColumns(sensor.Columns);
  const double* v = sensor.Viewpoint;
  this->GetCleaning()->SetViewpoint(v[0], v[1], v[2]);

  vtkSurfelEstimation* estimation = this->GetEstimation();
  const int usual = sensor.Columns > 0 ? DepthImageNeighbors : UsualNeighbors;
  estimation->SetNumberOfNeighbors(this->NumberOfNeighbors > 0 ? this->NumberOfNeighbors : usual);
  estimation->SetViewpoint(v[0], v[1], v[2]);
  switch (this->SidesMode)
  {
    case SIDES_TWO:
      estimation->SetOrientationModeToTwoSided();
      break;
    case SIDES_GIVEN:
      estimation->SetOrientationModeToAsGiven();
      break;
    default:
      estimation->SetOrientationMode(
        sensor.HasViewpoint ? vtkSurfelEstimation::VIEWPOINT : vtkSurfelEstimation::CONSISTENT);
  }
  return this->Superclass::RequestData(request, inputVector, outputVector);
}

void vtkPVPointsToSurfels::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "CleaningMode: " << this->CleaningMode << "\n";
  os << indent << "NumberOfNeighbors: " << this->NumberOfNeighbors << "\n";
  os << indent << "SidesMode: " << this->SidesMode << "\n";
}
