// SPDX-License-Identifier: BSD-3-Clause
#include "vtkEXRWriterBase.h"

#include "vtkErrorCode.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"

#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>

namespace
{
/// Follows links to the file that a path stands for, which may not exist yet.
std::string FollowLinks(const std::string& path)
{
  constexpr int largestDepth = 40; // as in Linux
  std::filesystem::path target = path;
  std::error_code problem;
  for (int i = 0; i < largestDepth && std::filesystem::is_symlink(target, problem); ++i)
  {
    target = target.parent_path() / std::filesystem::read_symlink(target, problem);
  }
  return target.string();
}
}

vtkEXRWriterBase::vtkEXRWriterBase() = default;
vtkEXRWriterBase::~vtkEXRWriterBase() = default;

void vtkEXRWriterBase::Write()
{
  this->SetErrorCode(vtkErrorCode::NoError);
  if (this->GetNumberOfInputConnections(0) == 0)
  {
    this->SetErrorCode(vtkErrorCode::UnknownError);
    vtkErrorMacro("There is no picture to write: set the input first.");
    return;
  }
  this->SetErrorCode(vtkErrorCode::UnknownError); // stays if a filter before this one fails
  // Every call writes, whether or not the input has changed.
  this->Modified();
  this->UpdateWholeExtent();
}

int vtkEXRWriterBase::RequestData(
  vtkInformation*, vtkInformationVector** inputVector, vtkInformationVector*)
{
  this->SetErrorCode(vtkErrorCode::NoError);
  if (!this->FileName || !*this->FileName)
  {
    this->SetErrorCode(vtkErrorCode::NoFileNameError);
    vtkErrorMacro("There is no file name: call SetFileName first.");
    return 0;
  }
  vtkImageData* image = vtkImageData::GetData(inputVector[0]);
  const int* size = image->GetDimensions();
  if (size[0] < 1 || size[1] < 1 || size[2] != 1)
  {
    this->SetErrorCode(vtkErrorCode::UnknownError);
    vtkErrorMacro("Cannot write " << this->FileName << ": the picture is " << size[0] << " x "
                                  << size[1] << " x " << size[2] << ", not one plane of pixels.");
    return 0;
  }

  // The target of a link is written; the link stays.
  const std::string target = FollowLinks(this->FileName);
  const std::string temporary = target + "." + std::to_string(getpid()) + ".part";
  unsigned long problemCode = vtkErrorCode::NoError;
  try
  {
    this->WriteTemporary(image, temporary, problemCode);
    problemCode = vtkErrorCode::CannotOpenFileError;
    std::error_code problem;
    std::filesystem::rename(temporary, target, problem);
    if (problem)
    {
      throw std::runtime_error(problem.message());
    }
  }
  catch (const std::exception& problem)
  {
    std::remove(temporary.c_str());
    this->SetErrorCode(problemCode);
    vtkErrorMacro("Cannot write " << this->FileName << ": " << problem.what());
    return 0;
  }
  return 1;
}

void vtkEXRWriterBase::WriteTemporary(
  vtkImageData* image, const std::string& path, unsigned long& problemCode)
{
  problemCode = vtkErrorCode::CannotOpenFileError;
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  if (!file)
  {
    throw std::runtime_error("the folder does not exist or is not writable.");
  }
  try
  {
    this->WriteStream(image, file, path);
  }
  catch (...)
  {
    problemCode = file ? vtkErrorCode::UnknownError : vtkErrorCode::OutOfDiskSpaceError;
    throw;
  }
  problemCode = vtkErrorCode::OutOfDiskSpaceError;
  file.close();
  if (!file)
  {
    throw std::runtime_error("writing failed; is the disk full?");
  }
}
