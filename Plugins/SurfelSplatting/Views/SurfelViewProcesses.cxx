// SPDX-License-Identifier: BSD-3-Clause
#include "SurfelViewProcesses.h"

#include <vtkCommunicator.h>
#include <vtkMultiProcessController.h>
#include <vtkPVRenderView.h>

namespace SurfelViews
{
vtkMultiProcessController* ProcessesOf(vtkPVRenderView* view, bool interactive)
{
  const bool distributed = view &&
    (interactive ? view->GetUseDistributedRenderingForLODRender()
                 : view->GetUseDistributedRenderingForRender());
  vtkMultiProcessController* all = vtkMultiProcessController::GetGlobalController();
  return distributed && all && all->GetNumberOfProcesses() > 1 && !view->InTileDisplayMode() &&
      !view->InCaveDisplayMode()
    ? all
    : nullptr;
}

std::size_t Largest(std::size_t mine, vtkMultiProcessController* controller)
{
  auto own = static_cast<vtkIdType>(mine);
  vtkIdType largest = own;
  if (controller)
  {
    controller->AllReduce(&own, &largest, 1, vtkCommunicator::MAX_OP);
  }
  return static_cast<std::size_t>(largest);
}
}
