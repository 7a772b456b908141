// SPDX-License-Identifier: BSD-3-Clause
/**
 * What the files that are compiled without VTK's headers ask of VTK: threads, progress and abort,
 * values of arrays. A library that contains such files contains this one, too.
 */
#include "Filters/Common/ArrayTuples.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Common/StageProgress.h"

#include "vtkAlgorithm.h"
#include "vtkDataArray.h"
#include "vtkSMPTools.h"
#include "vtkVersionMacros.h"

namespace SurfelGeometry
{
void RunLoop(
  vtkIdType first, vtkIdType last, vtkIdType grain, const SurfelSplatting::RangeFunction& body)
{
  SurfelSplatting::ExceptionCarrier carrier;
  vtkSMPTools::For(first, last, grain, [&](vtkIdType begin, vtkIdType end) {
    carrier.Run([&] { body(static_cast<std::size_t>(begin), static_cast<std::size_t>(end)); });
  });
  carrier.Rethrow();
}

bool StageProgress::Step(double fraction) const
{
  if (!this->Algorithm)
  {
    return true;
  }
  this->Algorithm->UpdateProgress(this->From + fraction * (this->To - this->From));
#if VTK_MAJOR_VERSION > 9 || (VTK_MAJOR_VERSION == 9 && VTK_MINOR_VERSION >= 3)
  return !this->Algorithm->CheckAbort();
#else
  return !this->Algorithm->GetAbortExecute();
#endif
}

void ReadTuple(vtkDataArray* array, vtkIdType id, double* values)
{
  array->GetTuple(id, values);
}
}
