// SPDX-License-Identifier: BSD-3-Clause
#include "vtkPVPointsToSurfels.h"

#include "vtkPointCloudCleaning.h"
#include "vtkSurfelEstimation.h"

#include <vtkInformation.h>
#include <vtkObjectFactory.h>

vtkStandardNewMacro(vtkPVPointsToSurfels);

vtkPVPointsToSurfels::vtkPVPointsToSurfels()
{
  // ParaView's first view may be from behind, as may be others when the mouse turns the cloud.
  this->SeesBacksOfDepthImages = true;
}

vtkPVPointsToSurfels::~vtkPVPointsToSurfels() = default;

int vtkPVPointsToSurfels::RequestData(
  vtkInformation* request, vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  this->SetCleanPoints(this->CleaningMode != CLEANING_OFF);
  this->GetCleaning()->SetSmoothing(this->CleaningMode == CLEANING_FULL);
  vtkSurfelEstimation* estimation = this->GetEstimation();
  switch (this->SidesMode)
  {
    case SIDES_TWO:
      estimation->SetOrientationModeToTwoSided();
      break;
    case SIDES_GIVEN:
      estimation->SetOrientationModeToAsGiven();
      break;
    default:
      estimation->SetOrientationModeToConsistent();
  }
  return this->Superclass::RequestData(request, inputVector, outputVector);
}

void vtkPVPointsToSurfels::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "CleaningMode: " << this->CleaningMode << "\n";
  os << indent << "SidesMode: " << this->SidesMode << "\n";
}
