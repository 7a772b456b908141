// SPDX-License-Identifier: BSD-3-Clause
/**
 * Writes files of arrays (ArrayFile.h). The arrays are filled in the mapped file, so that they may
 * be larger than the memory.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Files/ArrayFile.h"
#include "Core/Files/MappedFile.h"

#include <memory>
#include <string>
#include <vector>

namespace SurfelSplatting
{
/// Writes the whole file or none: it has another name until it is complete.
class ArrayFileWriter
{
public:
  static constexpr std::size_t LongestName = sizeof(ArrayRecord::Name) - 1;

  /// Makes the file with place for the arrays, all zero.
  /// @param arrays without the places in the file; names up to LongestName, components above 0
  /// @throw std::runtime_error if there is no place, or no such folder
  ArrayFileWriter(const std::string& path, std::vector<StoredArray> arrays);

  /// Deletes the file unless it is complete.
  ~ArrayFileWriter();
  ArrayFileWriter(const ArrayFileWriter&) = delete;
  ArrayFileWriter& operator=(const ArrayFileWriter&) = delete;

  /// Memory of an array, to be filled.
  template <typename Value>
  Value* Data(std::size_t array)
  {
    return reinterpret_cast<Value*>(this->File->Data() + this->Arrays[array].Begin);
  }

  /// Completes the file.
  /// @throw std::runtime_error if the disk fails
  void Finish(const Executor& executor);

private:
  std::string Path, Temporary;
  std::vector<StoredArray> Arrays;
  FileHeader Header{};
  std::unique_ptr<MappedFile> File;
};
}
