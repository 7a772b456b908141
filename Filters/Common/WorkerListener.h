// SPDX-License-Identifier: BSD-3-Clause
/**
 * Observes a filter that works inside of another one.
 */
#pragma once

#include "Filters/Common/StageProgress.h"

#include "vtkNew.h"

#include <string>

class vtkCallbackCommand;
class vtkObject;

namespace SurfelGeometry
{
/// Passes a worker's progress on, stops it, and stores what it says, which nobody else hears. That
/// an earlier execution of the worker was stopped is forgotten.
class WorkerListener
{
public:
  WorkerListener(const StageProgress& progress, vtkAlgorithm* worker);
  ~WorkerListener();
  WorkerListener(const WorkerListener&) = delete;
  void operator=(const WorkerListener&) = delete;

  bool Stopped = false;
  std::string Error;   ///< the first one; empty: none
  std::string Warning; ///< the first one; empty: none

private:
  static void Handle(vtkObject* caller, unsigned long event, void* listener, void* data);

  StageProgress Progress;
  vtkAlgorithm* Worker;
  vtkNew<vtkCallbackCommand> Command;
};
}
