// SPDX-License-Identifier: BSD-3-Clause
#include "SurfelViewProcesses.h"

#include <vtkCamera.h>
#include <vtkCommunicator.h>
#include <vtkMultiProcessController.h>
#include <vtkPVRenderView.h>
#include <vtkPVSession.h>
#include <vtkProcessModule.h>

namespace SurfelViews
{
namespace
{
/// Of nobody else's messages.
constexpr int LensTag = 52611;
}

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

void ShareLens(vtkPVRenderView* view, bool interactive)
{
  const bool remote = view &&
    (interactive ? view->GetUseDistributedRenderingForLODRender()
                 : view->GetUseDistributedRenderingForRender());
  auto* module = vtkProcessModule::GetProcessModule();
  auto* session = module ? vtkPVSession::SafeDownCast(module->GetActiveSession()) : nullptr;
  // Several clients do not render at the same time.
  if (!remote || !session || session->IsMultiClients())
  {
    return;
  }
  vtkCamera* camera = view->GetActiveCamera();
  double lens[2] = { camera->GetFocalDisk(), camera->GetFocalDistance() };
  if (vtkProcessModule::GetProcessType() == vtkProcessModule::PROCESS_CLIENT)
  {
    if (auto* server = session->GetController(vtkPVSession::RENDER_SERVER_ROOT))
    {
      server->Send(lens, 2, 1, LensTag);
    }
    return;
  }
  if (auto* client = session->GetController(vtkPVSession::CLIENT))
  {
    client->Receive(lens, 2, 1, LensTag);
  }
  vtkMultiProcessController* all = vtkMultiProcessController::GetGlobalController();
  if (all && all->GetNumberOfProcesses() > 1)
  {
    all->Broadcast(lens, 2, 0);
  }
  camera->SetFocalDisk(lens[0]);
  camera->SetFocalDistance(lens[1]);
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
