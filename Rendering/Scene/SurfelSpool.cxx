// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/SurfelSpool.h"

#include "Core/Surfels/SurfelArrays.h"
#include "Rendering/Scene/CloudAdapter.h"
#include "Rendering/Scene/MappedArrays.h"

#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <stdexcept>
#include <system_error>

#include <unistd.h>

namespace SurfelSplatting
{
namespace
{
constexpr const char* Points = "Points";

[[noreturn]] void FailToWrite()
{
  throw std::system_error(errno, std::generic_category());
}

/// The points of a piece relative to the origin of another one.
vtkSmartPointer<vtkDataArray> ShiftedPoints(vtkPolyData* piece, vtkPolyData* first, int type)
{
  double from[3], to[3];
  ReadOrigin(piece, from);
  ReadOrigin(first, to);
  vtkDataArray* points = piece->GetPoints()->GetData();
  if (std::equal(from, from + 3, to) && points->GetDataType() == type &&
    points->HasStandardMemoryLayout())
  {
    return points;
  }
  vtkSmartPointer<vtkDataArray> shifted;
  shifted.TakeReference(vtkDataArray::CreateDataArray(type));
  shifted->SetNumberOfComponents(3);
  shifted->SetNumberOfTuples(points->GetNumberOfTuples());
  for (vtkIdType i = 0; i < points->GetNumberOfTuples(); ++i)
  {
    for (int c = 0; c < 3; ++c)
    {
      shifted->SetComponent(i, c, points->GetComponent(i, c) + (from[c] - to[c]));
    }
  }
  return shifted;
}
}

SurfelSpool::~SurfelSpool()
{
  for (const Column& column : this->Columns)
  {
    std::remove(column.Path.c_str());
  }
}

void SurfelSpool::AddColumn(const char* name, int type, int components)
{
  const std::string path = this->Path + "." + std::to_string(getpid()) + "." +
    std::to_string(this->Columns.size()) + ".part";
  this->Columns.push_back({ name, type, components, path, {} });
  std::ofstream& file = this->Columns.back().File;
  file.open(path, std::ios::binary | std::ios::trunc);
  if (!file)
  {
    FailToWrite();
  }
}

void SurfelSpool::Start(vtkPolyData* piece)
{
  this->First = vtkSmartPointer<vtkPolyData>::New();
  for (int i = 0; i < piece->GetFieldData()->GetNumberOfArrays(); ++i)
  {
    vtkAbstractArray* array = piece->GetFieldData()->GetAbstractArray(i);
    const std::string name = array->GetName() ? array->GetName() : "";
    if (name.rfind("Surfel", 0) != 0 || name == Arrays::Origin) // others are of a hierarchy
    {
      this->First->GetFieldData()->AddArray(array);
    }
  }
  const int type = piece->GetPoints()->GetDataType();
  this->AddColumn(Points, type == VTK_DOUBLE ? VTK_DOUBLE : VTK_FLOAT, 3);
  this->AddColumn(Arrays::TwoSided, VTK_UNSIGNED_CHAR, 1);
  this->AddColumn(Arrays::Overlap, VTK_UNSIGNED_CHAR, 1);
  this->AddColumn(Arrays::Covariance, VTK_FLOAT, 6);
  this->AddColumn(Arrays::AreaVector, VTK_FLOAT, 3);
  vtkPointData* data = piece->GetPointData();
  for (int i = 0; i < data->GetNumberOfArrays(); ++i)
  {
    vtkDataArray* array = data->GetArray(i);
    if (!IsStorable(data->GetAbstractArray(i)) ||
      array->GetNumberOfTuples() != piece->GetNumberOfPoints())
    {
      continue;
    }
    const std::string name = array->GetName() ? array->GetName() : "";
    const bool isThere = std::any_of(this->Columns.begin(), this->Columns.end(),
      [&name](const Column& column) { return column.Name == name; });
    if (!name.empty() && !isThere)
    {
      this->AddColumn(name.c_str(), array->GetDataType(), array->GetNumberOfComponents());
      this->Scalars = array == data->GetScalars() ? name : this->Scalars;
      this->Normals = array == data->GetNormals() ? name : this->Normals;
    }
  }
}

vtkSmartPointer<vtkDataArray> SurfelSpool::Values(vtkPolyData* piece, const Column& column) const
{
  if (&column == &this->Columns.front())
  {
    return ShiftedPoints(piece, this->First, column.Type);
  }
  vtkDataArray* array = piece->GetPointData()->GetArray(column.Name.c_str());
  if (!array && (column.Name == Arrays::TwoSided || column.Name == Arrays::Overlap))
  {
    vtkSmartPointer<vtkDataArray> zeros;
    zeros.TakeReference(vtkDataArray::CreateDataArray(column.Type));
    zeros->SetNumberOfTuples(piece->GetNumberOfPoints());
    zeros->Fill(0.0);
    return zeros;
  }
  if (!array || array->GetNumberOfComponents() != column.Components ||
    array->GetNumberOfTuples() != piece->GetNumberOfPoints())
  {
    throw std::runtime_error("a piece lacks the point array " + column.Name + " with " +
      std::to_string(column.Components) +
      " components, which the first one has; give all pieces the same arrays");
  }
  return AsType(array, column.Type);
}

void SurfelSpool::Add(vtkPolyData* piece)
{
  if (!piece || piece->GetNumberOfPoints() == 0)
  {
    return;
  }
  const std::string problem = CheckStorable(piece);
  if (!problem.empty())
  {
    throw std::runtime_error(problem);
  }
  if (!this->First)
  {
    this->Start(piece);
  }
  std::vector<vtkSmartPointer<vtkDataArray>> values; // all are there before any is written
  for (const Column& column : this->Columns)
  {
    values.push_back(this->Values(piece, column));
  }
  auto next = values.begin();
  for (Column& column : this->Columns)
  {
    vtkDataArray* array = *next++;
    column.File.write(static_cast<const char*>(array->GetVoidPointer(0)),
      static_cast<std::streamsize>(array->GetNumberOfValues()) * array->GetDataTypeSize());
    if (!column.File)
    {
      FailToWrite();
    }
  }
}

vtkSmartPointer<vtkDataArray> SurfelSpool::MapColumn(Column& column)
{
  column.File.close();
  if (!column.File)
  {
    FailToWrite();
  }
  this->Files.push_back(MappedFile::Open(column.Path));
  const MappedFile& file = this->Files.back();
  vtkSmartPointer<vtkDataArray> array;
  array.TakeReference(vtkDataArray::CreateDataArray(column.Type));
  array->SetName(column.Name.c_str());
  array->SetNumberOfComponents(column.Components);
  const auto values = static_cast<vtkIdType>(file.Size()) / array->GetDataTypeSize();
  array->SetVoidArray(file.Data(), values, 1); // the memory is the file's
  return array;
}

vtkSmartPointer<vtkPolyData> SurfelSpool::Map()
{
  if (!this->First)
  {
    throw std::runtime_error("there are no surfels");
  }
  vtkSmartPointer<vtkPolyData> cloud = this->First;
  for (Column& column : this->Columns)
  {
    const vtkSmartPointer<vtkDataArray> array = this->MapColumn(column);
    if (&column == &this->Columns.front())
    {
      vtkNew<vtkPoints> points;
      points->SetData(array);
      cloud->SetPoints(points);
    }
    else
    {
      cloud->GetPointData()->AddArray(array);
    }
  }
  cloud->GetPointData()->SetActiveScalars(this->Scalars.c_str());
  cloud->GetPointData()->SetActiveNormals(this->Normals.c_str());
  return cloud;
}
}
