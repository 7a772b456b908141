// SPDX-License-Identifier: BSD-3-Clause
#include "DistributedView.h"

#include "vtkSurfelSplatter.h"

#include <vtkCamera.h>
#include <vtkCommunicator.h>
#include <vtkMultiProcessController.h>
#include <vtkPVInteractorStyle.h>
#include <vtkPVRenderView.h>
#include <vtkPVSession.h>
#include <vtkProcessModule.h>

namespace SurfelViews
{
namespace
{
/// A tag of its own, so that messages cannot be mixed up.
constexpr int LensTag = 52611;
}

vtkMultiProcessController* RenderController(vtkPVRenderView* view, bool interactive)
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

ViewLens SynchronizeLens(vtkPVRenderView* view, bool interactive)
{
  ViewLens lens;
  vtkCamera* camera = view->GetActiveCamera();
  lens.FocalDisk = camera->GetFocalDisk();
  lens.FocalDistance = camera->GetFocalDistance();
  if (vtkPVInteractorStyle* style = view->GetInteractorStyle())
  {
    style->GetCenterOfRotation(lens.CenterOfRotation);
    lens.HasCenter = true;
  }
  const bool remote = interactive ? view->GetUseDistributedRenderingForLODRender()
                                  : view->GetUseDistributedRenderingForRender();
  auto* module = vtkProcessModule::GetProcessModule();
  auto* session = module ? vtkPVSession::SafeDownCast(module->GetActiveSession()) : nullptr;
  // Clients of a shared session do not render at the same time.
  if (!remote || !session || session->IsMultiClients())
  {
    return lens;
  }
  constexpr vtkIdType size = sizeof(lens);
  auto* bytes = reinterpret_cast<unsigned char*>(&lens);
  if (vtkProcessModule::GetProcessType() == vtkProcessModule::PROCESS_CLIENT)
  {
    if (auto* server = session->GetController(vtkPVSession::RENDER_SERVER_ROOT))
    {
      server->Send(bytes, size, 1, LensTag);
    }
    return lens;
  }
  if (auto* client = session->GetController(vtkPVSession::CLIENT))
  {
    client->Receive(bytes, size, 1, LensTag);
  }
  vtkMultiProcessController* all = vtkMultiProcessController::GetGlobalController();
  if (all && all->GetNumberOfProcesses() > 1)
  {
    all->Broadcast(bytes, size, 0);
  }
  camera->SetFocalDisk(lens.FocalDisk);
  camera->SetFocalDistance(lens.FocalDistance);
  return lens;
}

void Focus::Apply(const ViewLens& lens, vtkSurfelSplatter* splatter) const
{
  const bool center = this->Mode == CENTER_OF_ROTATION && lens.HasCenter;
  splatter->SetFocusMode(center || this->Mode == POINT ? vtkSurfelSplatter::FOCUS_POINT
      : this->Mode == MIDDLE                           ? vtkSurfelSplatter::FOCUS_MIDDLE
                                                       : vtkSurfelSplatter::FOCUS_CAMERA);
  const double* p = center ? lens.CenterOfRotation : this->Point;
  splatter->SetFocusPoint(p[0], p[1], p[2]);
}

std::size_t MaximumOfAll(std::size_t value, vtkMultiProcessController* controller)
{
  const auto own = static_cast<vtkIdType>(value);
  vtkIdType maximum = own;
  if (controller)
  {
    controller->AllReduce(&own, &maximum, 1, vtkCommunicator::MAX_OP);
  }
  return static_cast<std::size_t>(maximum);
}
}
