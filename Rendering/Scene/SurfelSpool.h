// SPDX-License-Identifier: BSD-3-Clause
/**
 * Collects the surfels of a cloud, piece by piece, in files beside the one that will be written, so
 * that the whole cloud need not be in memory. Internal to the module.
 */
#pragma once

#include "Core/Files/MappedFile.h"

#include <vtkSmartPointer.h>

#include <fstream>
#include <list>
#include <string>
#include <vector>

class vtkDataArray;
class vtkPolyData;

namespace SurfelSplatting
{
class SurfelSpool
{
public:
  /// @param path of the file that will be written
  explicit SurfelSpool(const std::string& path)
    : Path(path)
  {
  }
  /// Deletes its files.
  ~SurfelSpool();
  SurfelSpool(const SurfelSpool&) = delete;
  SurfelSpool& operator=(const SurfelSpool&) = delete;

  /// Appends surfels (Documentation/DataContract.md). They get the origin of the first piece. Each
  /// piece needs the point arrays of the first one; further ones are left out.
  /// @throw std::runtime_error that says what is wrong with the piece or the disk
  void Add(vtkPolyData* piece);

  /// All pieces as one cloud, in mapped memory that exists as long as this. No piece can follow.
  vtkSmartPointer<vtkPolyData> Map();

private:
  /// One array of the surfels.
  struct Column
  {
    std::string Name;
    int Type, Components;
    std::string Path;
    std::ofstream File;
  };

  void Start(vtkPolyData* piece);
  void AddColumn(const char* name, int type, int components);
  vtkSmartPointer<vtkDataArray> Values(vtkPolyData* piece, const Column& column) const;
  vtkSmartPointer<vtkDataArray> MapColumn(Column& column);

  const std::string Path;
  std::list<Column> Columns; // the first has the points
  std::string Scalars, Normals;
  vtkSmartPointer<vtkPolyData> First; // its field data
  std::vector<MappedFile> Files;
};
}
