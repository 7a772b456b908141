// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelHierarchyWriter.h"

#include "Rendering/Scene/HierarchyFile.h"
#include "Rendering/Scene/SMPExecutor.h"

#include <vtkErrorCode.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkObjectFactory.h>
#include <vtkPolyData.h>

#include <exception>

vtkStandardNewMacro(vtkSurfelHierarchyWriter);

vtkSurfelHierarchyWriter::vtkSurfelHierarchyWriter()
{
  this->SetNumberOfOutputPorts(0);
}

vtkSurfelHierarchyWriter::~vtkSurfelHierarchyWriter()
{
  this->SetFileName(nullptr);
}

int vtkSurfelHierarchyWriter::Write()
{
  this->SetErrorCode(vtkErrorCode::NoError);
  if (this->GetNumberOfInputConnections(0) == 0)
  {
    this->SetErrorCode(vtkErrorCode::UnknownError);
    vtkErrorMacro("There is no hierarchy to write: set the input first.");
    return 0;
  }
  // Every call writes, whether or not the input has changed.
  this->Modified();
  this->Update();
  return this->GetErrorCode() == vtkErrorCode::NoError ? 1 : 0;
}

int vtkSurfelHierarchyWriter::RequestData(
  vtkInformation*, vtkInformationVector** inputVector, vtkInformationVector*)
{
  this->SetErrorCode(vtkErrorCode::NoError);
  if (!this->FileName || !*this->FileName)
  {
    this->SetErrorCode(vtkErrorCode::NoFileNameError);
    vtkErrorMacro("There is no file name: call SetFileName first.");
    return 0;
  }
  try
  {
    SurfelSplatting::WriteHierarchy(
      vtkPolyData::GetData(inputVector[0]), this->FileName, SurfelSplatting::SMPExecutor());
  }
  catch (const std::exception& problem)
  {
    this->SetErrorCode(vtkErrorCode::CannotOpenFileError);
    vtkErrorMacro("Cannot write " << this->FileName << ": " << problem.what());
    return 0;
  }
  return 1;
}

void vtkSurfelHierarchyWriter::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << "\n";
}
