// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelHierarchyWriter.h"

#include "Rendering/Scene/HierarchyFile.h"
#include "Rendering/Scene/SurfelSpool.h"
#include "SurfelData/SMPExecutor.h"

#include <vtkErrorCode.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkObjectFactory.h>
#include <vtkPolyData.h>

#include <cerrno>
#include <cstdint>
#include <exception>
#include <new>
#include <string>
#include <system_error>
#include <utility>

vtkStandardNewMacro(vtkSurfelHierarchyWriter);

vtkSurfelHierarchyWriter::vtkSurfelHierarchyWriter()
{
  this->SetNumberOfOutputPorts(0);
}

vtkSurfelHierarchyWriter::~vtkSurfelHierarchyWriter()
{
  this->SetFileName(nullptr);
}

namespace
{
/// VTK's number of what went wrong. Limits of a user's files are full disks, too.
unsigned long CodeOf(const std::exception& problem)
{
  const auto* system = dynamic_cast<const std::system_error*>(&problem);
  if (!system || system->code() == std::errc::not_enough_memory)
  {
    return vtkErrorCode::UnknownError;
  }
  const bool isFull = system->code() == std::errc::no_space_on_device ||
    system->code() == std::errc::file_too_large || system->code().value() == EDQUOT;
  return isFull ? vtkErrorCode::OutOfDiskSpaceError : vtkErrorCode::CannotOpenFileError;
}
}

void vtkSurfelHierarchyWriter::WarnOfLeftOut(vtkPolyData* surfels)
{
  std::string names;
  for (const std::string& name : SurfelSplatting::ArraysLeftOut(surfels))
  {
    names += (names.empty() ? "" : ", ") + name;
  }
  if (!names.empty())
  {
    vtkWarningMacro("Arrays that are not in the file: "
      << names
      << ". Files hold arrays of numbers, with one tuple per point and names of up to 95 bytes.");
  }
}

void vtkSurfelHierarchyWriter::ReportError(unsigned long code, const char* problem)
{
  this->SetErrorCode(code);
  vtkErrorMacro(
    "Cannot write " << (this->FileName ? this->FileName : "(none)") << ": " << problem << ".");
}

bool vtkSurfelHierarchyWriter::Begin()
{
  this->SetErrorCode(vtkErrorCode::NoError);
  if (this->FileName && *this->FileName)
  {
    return true;
  }
  this->ReportError(vtkErrorCode::NoFileNameError, "there is no file name; call SetFileName first");
  return false;
}

bool vtkSurfelHierarchyWriter::AddPiece(vtkPolyData* surfels)
{
  if (!this->Begin())
  {
    return false;
  }
  try
  {
    if (!this->Pieces)
    {
      this->Pieces.reset(new SurfelSplatting::SurfelSpool(this->FileName));
      this->WarnOfLeftOut(surfels);
    }
    this->Pieces->Add(surfels);
    return true;
  }
  catch (const std::exception& problem)
  {
    this->Pieces.reset();
    this->ReportError(CodeOf(problem), problem.what());
    return false;
  }
}

int vtkSurfelHierarchyWriter::Write()
{
  this->SetErrorCode(vtkErrorCode::NoError);
  if (this->Pieces)
  {
    const std::unique_ptr<SurfelSplatting::SurfelSpool> pieces = std::move(this->Pieces);
    try
    {
      return this->WriteFile(pieces->Map()) ? 1 : 0;
    }
    catch (const std::exception& problem)
    {
      this->ReportError(CodeOf(problem), problem.what());
      return 0;
    }
  }
  if (this->GetNumberOfInputConnections(0) == 0)
  {
    this->ReportError(vtkErrorCode::UnknownError, "there are no surfels; set the input first");
    return 0;
  }
  this->SetErrorCode(vtkErrorCode::UnknownError); // stays if a filter before this one fails
  // Every call writes, whether or not the input has changed.
  this->Modified();
  this->Update();
  return this->GetErrorCode() == vtkErrorCode::NoError ? 1 : 0;
}

int vtkSurfelHierarchyWriter::RequestData(
  vtkInformation*, vtkInformationVector** inputVector, vtkInformationVector*)
{
  vtkPolyData* surfels = vtkPolyData::GetData(inputVector[0]);
  this->WarnOfLeftOut(surfels);
  return this->WriteFile(surfels) ? 1 : 0;
}

bool vtkSurfelHierarchyWriter::WriteFile(vtkPolyData* surfels)
{
  if (!this->Begin())
  {
    return false;
  }
  try
  {
    const std::uint64_t invalid =
      SurfelSplatting::WriteHierarchy(surfels, this->FileName, SurfelSplatting::SMPExecutor());
    if (invalid > 0)
    {
      vtkWarningMacro(<< invalid << (invalid == 1 ? " surfel" : " surfels")
                      << " left out: values are not finite.");
    }
    return true;
  }
  catch (const std::bad_alloc&)
  {
    this->ReportError(vtkErrorCode::UnknownError,
      "there is too little memory; making a hierarchy takes 40 bytes for each surfel");
  }
  catch (const std::exception& problem)
  {
    this->ReportError(CodeOf(problem), problem.what());
  }
  return false;
}

void vtkSurfelHierarchyWriter::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << "\n";
}
