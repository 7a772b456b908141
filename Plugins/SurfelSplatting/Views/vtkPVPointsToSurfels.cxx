// SPDX-License-Identifier: BSD-3-Clause
#include "vtkPVPointsToSurfels.h"

#include "vtkPointCloudCleaning.h"
#include "vtkPointsOnFaces.h"
#include "vtkSurfelEstimation.h"

#include <vtkDataObject.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPolyData.h>

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
  vtkPolyData* mesh = vtkPolyData::GetData(inputVector[0]);
  if (!mesh)
  {
    return this->Superclass::RequestData(request, inputVector, outputVector);
  }
  vtkNew<vtkPointsOnFaces> faces;
  faces->SetInputData(mesh);
  faces->MakeNormalsOff(); // of parts that are inside out they would be wrong
  faces->Update();
  vtkPolyData* points = faces->GetOutput();
  if (faces->GetLack() != vtkPointsOnFaces::NO_LACK)
  {
    vtkLogF(INFO,
      "%lld points on the faces of the mesh are taken, since its %lld vertices do not tell the "
      "surface.",
      static_cast<long long>(points->GetNumberOfPoints()),
      static_cast<long long>(mesh->GetNumberOfPoints()));
  }
  vtkNew<vtkInformation> information;
  information->Set(vtkDataObject::DATA_OBJECT(), points);
  vtkNew<vtkInformationVector> vector;
  vector->Append(information);
  vtkInformationVector* input[1] = { vector };
  return this->Superclass::RequestData(request, input, outputVector);
}

void vtkPVPointsToSurfels::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "CleaningMode: " << this->CleaningMode << "\n";
  os << indent << "SidesMode: " << this->SidesMode << "\n";
}
