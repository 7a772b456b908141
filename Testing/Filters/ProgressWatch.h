// SPDX-License-Identifier: BSD-3-Clause
/**
 * Watches the progress that a filter reports, and aborts it.
 */
#pragma once

#include "vtkAlgorithm.h"
#include "vtkCallbackCommand.h"
#include "vtkCommand.h"
#include "vtkNew.h"

/// Watches one filter. It must not be executed any more after the watch is gone.
class ProgressWatch
{
public:
  int Events = 0;
  double Last = 0.0;
  bool Backwards = false; ///< whether progress ever fell
  double AbortAt;         ///< the filter is asked to stop from this progress on

  explicit ProgressWatch(vtkAlgorithm* filter, double abortAt = 2.0)
    : AbortAt(abortAt)
  {
    this->Command->SetClientData(this);
    this->Command->SetCallback([](vtkObject* caller, unsigned long, void* self, void*) {
      static_cast<ProgressWatch*>(self)->See(static_cast<vtkAlgorithm*>(caller));
    });
    filter->AddObserver(vtkCommand::ProgressEvent, this->Command);
  }
  ~ProgressWatch() { this->Command->SetClientData(nullptr); }
  ProgressWatch(const ProgressWatch&) = delete;
  void operator=(const ProgressWatch&) = delete;

  /// Forgets what was seen.
  void Restart(double abortAt = 2.0)
  {
    this->Events = 0;
    this->Last = 0.0;
    this->Backwards = false;
    this->AbortAt = abortAt;
  }

private:
  void See(vtkAlgorithm* filter)
  {
    ++this->Events;
    this->Backwards = this->Backwards || filter->GetProgress() < this->Last;
    this->Last = filter->GetProgress();
    filter->SetAbortExecute(this->Last >= this->AbortAt ? 1 : 0);
  }

  vtkNew<vtkCallbackCommand> Command;
};
