// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Common/WorkerListener.h"

#include "vtkCallbackCommand.h"
#include "vtkCommand.h"
#include "vtkExecutive.h"
#include "vtkVersionMacros.h"

namespace SurfelGeometry
{
namespace
{
void Keep(const void* text, std::string& first)
{
  if (first.empty())
  {
    first = text ? static_cast<const char*>(text) : "unknown";
  }
}
}

WorkerListener::WorkerListener(const StageProgress& progress, vtkAlgorithm* worker)
  : Progress(progress)
  , Worker(worker)
{
  this->Command->SetClientData(this);
  this->Command->SetCallback(&WorkerListener::Handle);
  for (const unsigned long event :
    { vtkCommand::ProgressEvent, vtkCommand::WarningEvent, vtkCommand::ErrorEvent })
  {
    worker->AddObserver(event, this->Command);
  }
  worker->GetExecutive()->AddObserver(vtkCommand::ErrorEvent, this->Command);
  if (worker->GetAbortExecute())
  {
    worker->SetAbortExecute(0);
  }
#if VTK_MAJOR_VERSION > 9 || (VTK_MAJOR_VERSION == 9 && VTK_MINOR_VERSION >= 3)
  worker->SetAbortOutput(false); // what CheckAbort() has kept of it
#endif
}

WorkerListener::~WorkerListener()
{
  this->Worker->RemoveObserver(this->Command);
  this->Worker->GetExecutive()->RemoveObserver(this->Command);
}

void WorkerListener::Handle(vtkObject*, unsigned long event, void* listener, void* data)
{
  auto* self = static_cast<WorkerListener*>(listener);
  if (event == vtkCommand::ErrorEvent)
  {
    Keep(data, self->Error); // the first error is the cause; one of the pipeline follows
  }
  else if (event == vtkCommand::WarningEvent)
  {
    Keep(data, self->Warning);
  }
  else if (event == vtkCommand::ProgressEvent &&
    !self->Progress.Step(*static_cast<const double*>(data)))
  {
    self->Stopped = true;
    self->Worker->SetAbortExecute(1);
  }
}
}
