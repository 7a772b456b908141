// SPDX-License-Identifier: BSD-3-Clause
#include "vtkPointsToSurfelsBase.h"

#include "vtkPointCloudCleaning.h"
#include "vtkSurfelEstimation.h"
#include "vtkSurfelNormalization.h"

#include "vtkInformation.h"

#include <algorithm>

//------------------------------------------------------------------------------
vtkPointsToSurfelsBase::vtkPointsToSurfelsBase() = default;
vtkPointsToSurfelsBase::~vtkPointsToSurfelsBase() = default;

//------------------------------------------------------------------------------
int vtkPointsToSurfelsBase::FillInputPortInformation(int vtkNotUsed(port), vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPointSet");
  return 1;
}

//------------------------------------------------------------------------------
vtkMTimeType vtkPointsToSurfelsBase::GetMTime()
{
  return std::max({ this->Superclass::GetMTime(), this->Cleaning->GetMTime(),
    this->Estimation->GetMTime(), this->Normalization->GetMTime() });
}

//------------------------------------------------------------------------------
void vtkPointsToSurfelsBase::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "CleanPoints: " << this->CleanPoints << "\n";
  os << indent << "UseSensor: " << this->UseSensor << "\n";
  os << indent << "NumberOfNeighbors: " << this->NumberOfNeighbors << "\n";
  os << indent << "Cleaning:\n";
  this->Cleaning->PrintSelf(os, indent.GetNextIndent());
  os << indent << "Estimation:\n";
  this->Estimation->PrintSelf(os, indent.GetNextIndent());
  os << indent << "Normalization:\n";
  this->Normalization->PrintSelf(os, indent.GetNextIndent());
}
