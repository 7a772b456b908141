// SPDX-License-Identifier: BSD-3-Clause
#include "vtkPointCloudReader.h"

#include "Filters/Readers/Points/PointCloudFields.h"
#include "Filters/Readers/Points/PointCloudFile.h"
#include "Filters/Readers/Points/PointCloudHeader.h"
#include "Filters/Readers/Points/ReadingProblem.h"

#include "vtkDoubleArray.h"
#include "vtkErrorCode.h"
#include "vtkFieldData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPolyData.h"

#include <algorithm>
#include <initializer_list>
#include <string>

namespace
{
void AddFieldArray(const char* name, std::initializer_list<double> values, vtkPolyData* output)
{
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(static_cast<int>(values.size()));
  array->InsertNextTuple(values.begin());
  output->GetFieldData()->AddArray(array);
}

/// Where the sensor was, for filters behind others; with the bounds they can tell whether the
/// points have been moved since.
void AddSensor(const PointCloud::PointCloudFile& file, vtkPolyData* output)
{
  const double* v = file.Viewpoint;
  double b[6];
  output->GetBounds(b);
  if (file.HasViewpoint)
  {
    AddFieldArray("ScanViewpoint", { v[0], v[1], v[2] }, output);
  }
  AddFieldArray("ScanBounds", { b[0], b[1], b[2], b[3], b[4], b[5] }, output);
  if (file.Cloud.Height > 1)
  {
    AddFieldArray("ScanDimensions",
      { static_cast<double>(file.Cloud.Width), static_cast<double>(file.Cloud.Height) }, output);
  }
}
}

vtkStandardNewMacro(vtkPointCloudReader);

vtkPointCloudReader::vtkPointCloudReader()
{
  this->SetNumberOfInputPorts(0);
}

vtkPointCloudReader::~vtkPointCloudReader()
{
  this->SetFileName(nullptr);
}

int vtkPointCloudReader::CanReadFile(const char* fileName)
{
  return fileName && PointCloud::FindFormat(fileName) != PointCloud::Format::Unknown ? 1 : 0;
}

void vtkPointCloudReader::Read(vtkPolyData* output)
{
  const PointCloud::PointCloudFile file = PointCloud::ReadPointCloudFile(this->FileName);
  this->UpdateProgress(0.6);
  PointCloud::DecodeFields(file.Cloud, output);
  std::copy_n(file.Viewpoint, 3, this->Viewpoint);
  this->HasViewpoint = file.HasViewpoint;
  this->Dimensions[0] = static_cast<int>(file.Cloud.Width);
  this->Dimensions[1] = static_cast<int>(file.Cloud.Height);
  if (file.HasViewpoint || file.Cloud.Height > 1)
  {
    AddSensor(file, output);
  }
}

int vtkPointCloudReader::RequestData(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputVector)
{
  vtkPolyData* output = vtkPolyData::GetData(outputVector, 0);
  std::fill_n(this->Viewpoint, 3, 0.0);
  std::fill_n(this->Dimensions, 2, 0);
  this->HasViewpoint = false;
  const PointCloud::ReadingProblem problem =
    PointCloud::FindReadingProblem(this->FileName, "points", [&] { this->Read(output); });
  this->SetErrorCode(problem.Code);
  if (problem.Code == vtkErrorCode::NoError)
  {
    return 1;
  }
  output->Initialize();
  vtkErrorMacro(<< problem.Text);
  return 0;
}

void vtkPointCloudReader::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << "\n";
  os << indent << "HasViewpoint: " << this->HasViewpoint << "\n";
  os << indent << "Viewpoint: " << this->Viewpoint[0] << " " << this->Viewpoint[1] << " "
     << this->Viewpoint[2] << "\n";
  os << indent << "Dimensions: " << this->Dimensions[0] << " " << this->Dimensions[1] << "\n";
}
