// SPDX-License-Identifier: BSD-3-Clause
/**
 * A point cloud as it is stored in files: bytes, and a list of the fields of a point; the faces of
 * a mesh.
 */
#pragma once

#include "Filters/Common/RawVector.h"

#include "vtkCellArray.h"
#include "vtkSmartPointer.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace PointCloud
{
struct Field
{
  enum Types : std::uint8_t
  {
    UNKNOWN,
    BOOL,
    INT8,
    UINT8,
    INT16,
    UINT16,
    INT32,
    UINT32,
    INT64,
    UINT64,
    FLOAT32,
    FLOAT64
  };

  std::string Name;
  std::size_t Offset = 0; ///< in a point, bytes
  Types Type = UNKNOWN;
  std::size_t Count = 0; ///< of values
};

/// Bytes per value.
inline std::size_t SizeOf(Field::Types type)
{
  constexpr std::size_t sizes[] = { 0, 1, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8 };
  return sizes[type];
}

struct FieldCloud
{
  std::uint32_t Width = 0, Height = 0; ///< Height > 1: a depth image, row by row
  std::size_t PointStep = 0;           ///< bytes from one point to the next
  std::vector<Field> Fields;
  SurfelGeometry::RawVector<std::uint8_t> Data;
  vtkSmartPointer<vtkCellArray> Faces; ///< null: none
};

/// Reverses the bytes of every value.
inline void SwapBytes(FieldCloud& cloud)
{
  for (const Field& field : cloud.Fields)
  {
    const std::size_t size = SizeOf(field.Type);
    for (std::size_t at = field.Offset; at < cloud.Data.size(); at += cloud.PointStep)
    {
      for (std::size_t end = at + field.Count * size, value = at; value < end; value += size)
      {
        std::reverse(cloud.Data.data() + value, cloud.Data.data() + value + size);
      }
    }
  }
}
}
