// SPDX-License-Identifier: BSD-3-Clause
#include "vtkEXRWriterBase.h"

#include "vtkErrorCode.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtksys/SystemInformation.hxx"
#include "vtksys/SystemTools.hxx"

#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>

namespace
{
/// Follows links to the file that a path stands for, which may not exist yet.
std::string FollowLinks(const std::string& path)
{
  constexpr int largestDepth = 40; // as in Linux
  std::string target = path, next;
  for (int i = 0; i < largestDepth && vtksys::SystemTools::FileIsSymlink(target); ++i)
  {
    if (!vtksys::SystemTools::ReadSymlink(target, next))
    {
      break;
    }
    target = vtksys::SystemTools::FileIsFullPath(next)
      ? next
      : vtksys::SystemTools::GetFilenamePath(target) +
        (target.find('/') == std::string::npos ? "" : "/") + next;
  }
  return target;
}

std::ofstream OpenForWriting(const std::string& path)
{
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  if (!file)
  {
    throw std::runtime_error("the folder does not exist or is not writable.");
  }
  return file;
}
}

//------------------------------------------------------------------------------
vtkEXRWriterBase::vtkEXRWriterBase() = default;
vtkEXRWriterBase::~vtkEXRWriterBase() = default;

//------------------------------------------------------------------------------
void vtkEXRWriterBase::Write()
{
  this->SetErrorCode(vtkErrorCode::NoError);
  if (this->GetNumberOfInputConnections(0) == 0)
  {
    this->SetErrorCode(vtkErrorCode::UnknownError);
    vtkErrorMacro("There is no picture to write: set the input first.");
    return;
  }
  // Every call writes, whether or not the input has changed.
  this->Modified();
  this->UpdateWholeExtent();
}

//------------------------------------------------------------------------------
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

  vtksys::SystemInformation system;
  // The target of a link is written; the link stays.
  const std::string target = FollowLinks(this->FileName);
  const std::string temporary = target + "." + std::to_string(system.GetProcessId()) + ".part";
  unsigned long problemCode = vtkErrorCode::CannotOpenFileError;
  try
  {
    std::ofstream file = OpenForWriting(temporary);
    try
    {
      this->WriteStream(image, file, temporary);
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
    problemCode = vtkErrorCode::CannotOpenFileError;
    if (std::rename(temporary.c_str(), target.c_str()) != 0)
    {
      throw std::runtime_error(vtksys::SystemTools::GetLastSystemError());
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
