// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelEXRReader.h"

#include "Rendering/OpenEXR/EXRCamera.h"
#include "Rendering/OpenEXR/EXRInput.h"
#include "Rendering/OpenEXR/EXRPixels.h"
#include "Rendering/OpenEXR/EXRPoints.h"

#include "vtkDataObject.h"
#include "vtkErrorCode.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <OpenEXR/ImfTestFile.h>

#include <exception>
#include <new>
#include <string>

vtkStandardNewMacro(vtkSurfelEXRReader);

vtkSurfelEXRReader::vtkSurfelEXRReader()
{
  this->SetNumberOfInputPorts(0);
  this->SetNumberOfOutputPorts(2);
}

vtkSurfelEXRReader::~vtkSurfelEXRReader()
{
  this->SetFileName(nullptr);
}

int vtkSurfelEXRReader::CanReadFile(const char* fileName)
{
  return fileName && Imf::isOpenExrFile(fileName) ? 1 : 0;
}

int vtkSurfelEXRReader::FillOutputPortInformation(int port, vtkInformation* info)
{
  if (port == 1)
  {
    info->Set(vtkDataObject::DATA_TYPE_NAME(), "vtkPolyData");
    return 1;
  }
  return this->Superclass::FillOutputPortInformation(port, info);
}

int vtkSurfelEXRReader::Try(const Work& work, vtkInformationVector* outputVector)
{
  unsigned long code = vtkErrorCode::FileFormatError;
  std::string problem;
  this->SetErrorCode(vtkErrorCode::NoError);
  try
  {
    if (!this->FileName || !*this->FileName)
    {
      throw SurfelSplatting::EXRProblem(
        vtkErrorCode::NoFileNameError, "There is no file name: call SetFileName first.");
    }
    SurfelSplatting::EXRInput input(this->FileName);
    work(input);
    return 1;
  }
  catch (const SurfelSplatting::EXRProblem& found)
  {
    code = found.Code;
    problem = found.what();
  }
  catch (const std::bad_alloc&)
  {
    problem =
      "the picture does not fit into memory; read a smaller one, or call GeneratePointsOff().";
  }
  catch (const std::exception& found)
  {
    problem = std::string("the file is damaged or cut short (") + found.what() + ").";
  }
  for (int port = 0; port < 2; ++port)
  {
    if (vtkDataObject* output = vtkDataObject::GetData(outputVector, port))
    {
      output->Initialize();
    }
  }
  this->SetErrorCode(code);
  vtkErrorMacro(<< (code == vtkErrorCode::NoFileNameError ? "" : this->FileName + std::string(": "))
                << problem);
  return 0;
}

int vtkSurfelEXRReader::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputVector)
{
  return this->Try(
    [outputVector](SurfelSplatting::EXRInput& input) {
      vtkInformation* info = outputVector->GetInformationObject(0);
      const int extent[6] = { 0, input.Width() - 1, 0, input.Height() - 1, 0, 0 };
      info->Set(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent, 6);
      info->Set(vtkDataObject::SPACING(), 1.0, 1.0, 1.0);
      info->Set(vtkDataObject::ORIGIN(), 0.0, 0.0, 0.0);
      info->Remove(vtkDataObject::POINT_DATA_VECTOR()); // left by another file
      const int components =
        input.IsDeep() ? 4 : SurfelSplatting::NumberOfColorComponents(input.GetHeader());
      if (components > 0)
      {
        vtkDataObject::SetPointDataActiveScalarInfo(info, VTK_FLOAT, components);
      }
    },
    outputVector);
}

int vtkSurfelEXRReader::RequestData(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputVector)
{
  vtkImageData* image = vtkImageData::GetData(outputVector, 0);
  vtkPolyData* points = vtkPolyData::GetData(outputVector, 1);
  return this->Try(
    [=](SurfelSplatting::EXRInput& input) {
      image->SetDimensions(input.Width(), input.Height(), 1);
      const auto progress = [this](double done) { this->UpdateProgress(0.8 * done); };
      const auto read =
        input.IsDeep() ? SurfelSplatting::ReadDeepPixels : SurfelSplatting::ReadFlatPixels;
      read(input, image, progress);
      SurfelSplatting::ReadCamera(input.GetHeader(), image->GetFieldData());
      if (this->GeneratePoints)
      {
        SurfelSplatting::MakePoints(image, input.GetHeader().pixelAspectRatio(), points);
      }
    },
    outputVector);
}

void vtkSurfelEXRReader::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << "\n";
  os << indent << "GeneratePoints: " << this->GeneratePoints << "\n";
}
