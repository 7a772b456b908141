// SPDX-License-Identifier: BSD-3-Clause
#include "vtkPointsToSurfelsBase.h"

#include "Filters/Arrays/InputArrays.h"
#include "Filters/Arrays/ScanSensor.h"
#include "Filters/Scanners/ScanOrder.h"
#include "vtkPointCloudCleaning.h"
#include "vtkSurfelEstimation.h"
#include "vtkSurfelNormalization.h"

#include "vtkFloatArray.h"
#include "vtkInformation.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPointSet.h"

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
bool vtkPointsToSurfelsBase::FindScannersByOrder(vtkPointSet* points, vtkFloatArray* toScanner)
{
  if (!points || !toScanner || points->GetNumberOfPoints() == 0)
  {
    return false;
  }
  const auto scans = SurfelGeometry::FindScans(points->GetPoints());
  if (scans.empty())
  {
    return false;
  }
  SurfelGeometry::WriteWays(points->GetPoints(), scans, toScanner);
  toScanner->SetName(SurfelGeometry::ToScannerArray);
  return true;
}

//------------------------------------------------------------------------------
vtkSmartPointer<vtkPointSet> vtkPointsToSurfelsBase::WithScanners(
  vtkPointSet* input, SurfelGeometry::ScanSensor& sensor)
{
  const bool isKnown =
    sensor.HasViewpoint || sensor.HasScanners || this->Estimation->GetUseViewpoint();
  vtkNew<vtkFloatArray> ways;
  if (!this->UseSensor || isKnown || !FindScannersByOrder(input, ways))
  {
    return input;
  }
  sensor.HasScanners = true;
  const auto known = vtkSmartPointer<vtkPointSet>::Take(input->NewInstance());
  known->ShallowCopy(input);
  known->GetPointData()->AddArray(ways);
  return known;
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
