// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/MappedArrays.h"

#include "Core/Files/ArrayFileWriter.h"

#include <vtkAbstractArray.h>
#include <vtkType.h>

#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>

namespace SurfelSplatting
{
namespace
{
/// The files of the arrays that exist, by the place of their values. A free function of VTK gets
/// only this place.
class OpenFiles
{
public:
  static OpenFiles& Get()
  {
    static auto* files = new OpenFiles; // never deleted: arrays may live until the very end
    return *files;
  }

  void Add(const void* values, const std::shared_ptr<const ArrayFile>& file)
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Files[values] = file;
  }

  std::shared_ptr<const ArrayFile> Find(const void* values)
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    const auto found = this->Files.find(values);
    return found != this->Files.end() ? found->second : nullptr;
  }

  bool Remove(const void* values)
  {
    std::shared_ptr<const ArrayFile> file; // is closed after the lock is released
    const std::lock_guard<std::mutex> lock(this->Mutex);
    const auto found = this->Files.find(values);
    if (found == this->Files.end())
    {
      return false;
    }
    file = std::move(found->second);
    this->Files.erase(found);
    return true;
  }

private:
  std::mutex Mutex;
  std::map<const void*, std::shared_ptr<const ArrayFile>> Files;
};

void Release(void* values)
{
  // An array that is allocated again keeps this function for its new memory.
  if (values && !OpenFiles::Get().Remove(values))
  {
    std::free(values);
  }
}

struct TypePair
{
  ArrayType Stored;
  int Vtk;
};

constexpr TypePair Types[] = { { ArrayType::Float32, VTK_FLOAT },
  { ArrayType::Float64, VTK_DOUBLE }, { ArrayType::Int8, VTK_SIGNED_CHAR },
  { ArrayType::UInt8, VTK_UNSIGNED_CHAR }, { ArrayType::Int16, VTK_SHORT },
  { ArrayType::UInt16, VTK_UNSIGNED_SHORT }, { ArrayType::Int32, VTK_INT },
  { ArrayType::UInt32, VTK_UNSIGNED_INT }, { ArrayType::Int64, VTK_ID_TYPE },
  { ArrayType::Int64, VTK_LONG }, { ArrayType::Int64, VTK_LONG_LONG },
  { ArrayType::UInt64, VTK_UNSIGNED_LONG }, { ArrayType::UInt64, VTK_UNSIGNED_LONG_LONG },
  { ArrayType::Int8, VTK_CHAR } };
}

vtkSmartPointer<vtkDataArray> MakeMappedArray(
  const std::shared_ptr<const ArrayFile>& file, const StoredArray& stored)
{
  vtkSmartPointer<vtkDataArray> array;
  for (const TypePair& type : Types)
  {
    if (type.Stored == stored.Type)
    {
      array.TakeReference(vtkDataArray::CreateDataArray(type.Vtk));
      break;
    }
  }
  array->SetName(stored.Name.c_str());
  array->SetNumberOfComponents(static_cast<int>(stored.Components));
  if (stored.Tuples > 0)
  {
    void* values = file->Data(stored);
    OpenFiles::Get().Add(values, file);
    array->SetVoidArray(values, static_cast<vtkIdType>(stored.Tuples * stored.Components), 0,
      vtkAbstractArray::VTK_DATA_ARRAY_USER_DEFINED);
    array->SetArrayFreeFunction(Release);
  }
  return array;
}

std::shared_ptr<const ArrayFile> FindArrayFile(vtkDataArray* array)
{
  return array && array->HasStandardMemoryLayout() && array->GetNumberOfValues() > 0
    ? OpenFiles::Get().Find(array->GetVoidPointer(0))
    : nullptr;
}

bool FindStoredType(vtkDataArray* array, ArrayType& type)
{
  for (const TypePair& pair : Types)
  {
    if (pair.Vtk == array->GetDataType() &&
      static_cast<int>(SizeOf(pair.Stored)) == array->GetDataTypeSize())
    {
      type = pair.Stored;
      return true;
    }
  }
  return false;
}

bool IsStorable(vtkAbstractArray* array)
{
  auto* numbers = vtkDataArray::SafeDownCast(array);
  ArrayType type;
  return numbers && FindStoredType(numbers, type) && numbers->GetNumberOfComponents() > 0 &&
    (!numbers->GetName() || std::strlen(numbers->GetName()) <= ArrayFileWriter::LongestName);
}

vtkSmartPointer<vtkDataArray> AsType(vtkDataArray* array, int type)
{
  if (array->GetDataType() == type && array->HasStandardMemoryLayout())
  {
    return array;
  }
  vtkSmartPointer<vtkDataArray> copy;
  copy.TakeReference(vtkDataArray::CreateDataArray(type));
  copy->DeepCopy(array);
  copy->SetName(array->GetName());
  return copy;
}
}
