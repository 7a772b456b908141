// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelHierarchyReader.h"

#include "Core/Files/ArrayFile.h"
#include "Core/Surfels/SurfelArrays.h"
#include "Rendering/Scene/MappedArrays.h"
#include "SurfelData/HierarchyArrays.h"
#include "SurfelData/SMPExecutor.h"

#include <vtkErrorCode.h>
#include <vtkFieldData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>

#include <exception>
#include <memory>
#include <stdexcept>
#include <string>

namespace Core = SurfelSplatting;

namespace
{
std::shared_ptr<const Core::ArrayFile> Open(const char* path)
{
  if (!path || !*path)
  {
    throw std::runtime_error("there is no file name; call SetFileName first");
  }
  return std::make_shared<Core::ArrayFile>(path, Core::SMPExecutor());
}

void AddPoints(vtkDataArray* positions, vtkPolyData* output)
{
  const int type = positions->GetDataType();
  if (positions->GetNumberOfComponents() != 3 || (type != VTK_FLOAT && type != VTK_DOUBLE))
  {
    throw std::runtime_error("its points are not three floats or doubles each; write it again");
  }
  vtkNew<vtkPoints> points;
  points->SetData(positions);
  output->SetPoints(points);
}

/// Also that no array of the points is shorter than they are.
std::string ProblemOf(const Core::ArrayFile& file, vtkPolyData* output)
{
  const auto count = static_cast<std::uint64_t>(output->GetNumberOfPoints());
  for (const Core::StoredArray& stored : file.Arrays())
  {
    if (stored.Role != Core::ArrayRole::FieldData && stored.Tuples != count)
    {
      return "its array " + stored.Name + " has " + std::to_string(stored.Tuples) +
        " values for its " + std::to_string(count) + " points; write it again";
    }
  }
  return Core::CheckHierarchy(output);
}

void AddArray(Core::ArrayRole role, vtkDataArray* array, vtkPolyData* output)
{
  vtkPointData* data = output->GetPointData();
  switch (role)
  {
    case Core::ArrayRole::Points:
      AddPoints(array, output);
      break;
    case Core::ArrayRole::PointData:
      data->AddArray(array);
      break;
    case Core::ArrayRole::Scalars:
      data->SetScalars(array);
      break;
    case Core::ArrayRole::Normals:
      data->SetNormals(array);
      break;
    case Core::ArrayRole::FieldData:
      output->GetFieldData()->AddArray(array);
      break;
  }
}

/// Whether a frame reads the nodes or surfels that it needs from an array. The entries that it
/// walks to choose them (Arrays::Clusters, Arrays::Extents) are near each other.
bool IsReadAtRandom(const Core::StoredArray& stored)
{
  for (const char* name : { Core::Arrays::Nodes, Core::Arrays::NodeColors, Core::Arrays::Covariance,
         Core::Arrays::AreaVector, Core::Arrays::TwoSided, Core::Arrays::Overlap,
         Core::Arrays::Opacity })
  {
    if (stored.Name == name)
    {
      return true;
    }
  }
  return stored.Role == Core::ArrayRole::Points || stored.Role == Core::ArrayRole::Scalars;
}

/// The arrays in the order of the file: those that are computed from others are behind them, and
/// their later times say that they are up to date (FindComputed in HierarchyArrays.h).
void MapArrays(const std::shared_ptr<const Core::ArrayFile>& file, vtkPolyData* output)
{
  for (const Core::StoredArray& stored : file->Arrays())
  {
    if (IsReadAtRandom(stored))
    {
      file->ReadAtRandom(stored);
    }
    AddArray(stored.Role, Core::MakeMappedArray(file, stored), output);
  }
  if (output->GetFieldData()->HasArray(Core::Arrays::Nodes))
  {
    Core::NoteSources(output);
  }
  vtkDataArray* colors = output->GetFieldData()->GetArray(Core::Arrays::NodeColors);
  vtkDataArray* scalars = output->GetPointData()->GetScalars();
  if (colors && scalars)
  {
    colors->SetComponentName(0, scalars->GetName());
  }
}
}

vtkStandardNewMacro(vtkSurfelHierarchyReader);

vtkSurfelHierarchyReader::vtkSurfelHierarchyReader()
{
  this->SetNumberOfInputPorts(0);
}

vtkSurfelHierarchyReader::~vtkSurfelHierarchyReader()
{
  this->SetFileName(nullptr);
}

void vtkSurfelHierarchyReader::ReportError(const char* problem)
{
  this->SetErrorCode(vtkErrorCode::FileFormatError);
  vtkErrorMacro(
    "Cannot read " << (this->FileName ? this->FileName : "(none)") << ": " << problem << ".");
}

int vtkSurfelHierarchyReader::RequestData(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputVector)
{
  this->SetErrorCode(vtkErrorCode::NoError);
  vtkPolyData* output = vtkPolyData::GetData(outputVector);
  std::string problem;
  try
  {
    const std::shared_ptr<const Core::ArrayFile> file = Open(this->FileName);
    MapArrays(file, output);
    problem = ProblemOf(*file, output);
  }
  catch (const std::exception& exception)
  {
    problem = exception.what();
  }
  if (!problem.empty())
  {
    output->Initialize();
    this->ReportError(problem.c_str());
    return 0;
  }
  return 1;
}

bool vtkSurfelHierarchyReader::CheckFile()
{
  this->SetErrorCode(vtkErrorCode::NoError);
  try
  {
    Open(this->FileName)->CheckAll(Core::SMPExecutor());
    return true;
  }
  catch (const std::exception& exception)
  {
    this->ReportError(exception.what());
    return false;
  }
}

void vtkSurfelHierarchyReader::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << "\n";
}
