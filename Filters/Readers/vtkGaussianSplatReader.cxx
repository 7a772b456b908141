// SPDX-License-Identifier: BSD-3-Clause
#include "vtkGaussianSplatReader.h"

#include "Filters/Common/StageProgress.h"
#include "Filters/Readers/Captures/GaussianArrays.h"
#include "Filters/Readers/Captures/GaussianFile.h"
#include "Filters/Readers/Points/ReadingProblem.h"

#include "vtkErrorCode.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkPolyData.h"

#include <algorithm>
#include <stdexcept>
#include <string>

vtkStandardNewMacro(vtkGaussianSplatReader);

int vtkGaussianSplatReader::CanReadFile(const char* fileName)
{
  return fileName && PointCloud::FindCaptureFormat(fileName) != PointCloud::CaptureFormat::None;
}

std::string vtkGaussianSplatReader::CheckMemory(
  vtkIdType gaussians, int harmonics, double otherBytes)
{
  return PointCloud::CheckMemory(gaussians, harmonics, otherBytes);
}

void vtkGaussianSplatReader::Read(vtkPolyData* output)
{
  PointCloud::GaussianFile file(this->FileName);
  this->Antialiased = file.IsAntialiased();
  const SurfelGeometry::StageProgress loading(this, 0.0, file.LoadShare());
  const SurfelGeometry::StageProgress progress(this, file.LoadShare(), 1.0);
  if (!file.Load([&loading](double fraction) { return loading.Step(fraction); }))
  {
    return;
  }
  PointCloud::GaussianArrays arrays(file.Layout(), static_cast<vtkIdType>(file.Count()));
  for (std::uint64_t done = 0; done < file.Count();)
  {
    const std::uint64_t part = std::min(file.PartSize(), file.Count() - done);
    arrays.Append(file.Read(part));
    done += part;
    if (!progress.Step(static_cast<double>(done) / static_cast<double>(file.Count())))
    {
      return;
    }
  }
  this->NumberOfInvalidGaussians = arrays.RemoveInvalid();
  if (file.Count() > 0 && this->NumberOfInvalidGaussians == static_cast<vtkIdType>(file.Count()))
  {
    throw std::runtime_error("each of its " + std::to_string(file.Count()) +
      " Gaussians has a value that is not finite; the file is damaged.");
  }
  arrays.MoveTo(output);
}

int vtkGaussianSplatReader::RequestData(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputVector)
{
  vtkPolyData* output = vtkPolyData::GetData(outputVector, 0);
  this->NumberOfInvalidGaussians = 0;
  this->Antialiased = false;
  const PointCloud::ReadingProblem problem =
    PointCloud::FindReadingProblem(this->FileName, "Gaussians", [&] { this->Read(output); });
  this->SetErrorCode(problem.Code);
  if (problem.Code == vtkErrorCode::NoError)
  {
    return 1;
  }
  output->Initialize();
  vtkErrorMacro(<< problem.Text);
  return 0;
}

void vtkGaussianSplatReader::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << "\n";
  os << indent << "NumberOfInvalidGaussians: " << this->NumberOfInvalidGaussians << "\n";
  os << indent << "Antialiased: " << this->Antialiased << "\n";
}
