// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelViewActor.h"

#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkObjectFactory.h>
#include <vtkPropCollection.h>
#include <vtkRenderState.h>
#include <vtkRenderer.h>
#include <vtkSequencePass.h>

namespace
{
/// The first visible actor of this kind splats for all.
vtkSurfelViewActor* FirstOf(vtkRenderer* renderer)
{
  vtkCollectionSimpleIterator it;
  renderer->GetViewProps()->InitTraversal(it);
  while (vtkProp* prop = renderer->GetViewProps()->GetNextProp(it))
  {
    auto* actor = vtkSurfelViewActor::SafeDownCast(prop);
    if (actor && actor->GetVisibility())
    {
      return actor;
    }
  }
  return nullptr;
}
}

vtkStandardNewMacro(vtkSurfelViewActor);

vtkSurfelViewActor::vtkSurfelViewActor()
{
  // All other props have been drawn already.
  vtkNew<vtkSequencePass> nothing;
  this->Pass->SetDelegatePass(nothing);
  this->Pass->OtherPropsThroughLensOff();
}

vtkSurfelViewActor::~vtkSurfelViewActor() = default;

vtkSurfelSplatter* vtkSurfelViewActor::GetSplatter()
{
  return this->Pass->GetSplatter();
}

int vtkSurfelViewActor::RenderOpaqueGeometry(vtkViewport* viewport)
{
  auto* renderer = vtkRenderer::SafeDownCast(viewport);
  return renderer && renderer->GetSelector() ? this->Superclass::RenderOpaqueGeometry(viewport) : 0;
}

int vtkSurfelViewActor::RenderVolumetricGeometry(vtkViewport* viewport)
{
  auto* renderer = vtkRenderer::SafeDownCast(viewport);
  auto* mapper = vtkSurfelMapper::SafeDownCast(this->Mapper);
  const bool splatted = mapper && mapper->GetSplatted(); // by a pass of the view
  if (!renderer || renderer->GetSelector() || splatted || FirstOf(renderer) != this)
  {
    return 0;
  }
  vtkRenderState state(renderer);
  state.SetPropArrayAndCount(nullptr, 0);
  state.SetFrameBuffer(nullptr);
  this->Pass->Render(&state);
  return 1;
}

void vtkSurfelViewActor::ReleaseGraphicsResources(vtkWindow* window)
{
  this->Superclass::ReleaseGraphicsResources(window);
  if (window) // VTK calls this without one; passes must not be
  {
    this->Pass->ReleaseGraphicsResources(window);
  }
}

void vtkSurfelViewActor::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Pass:\n";
  this->Pass->PrintSelf(os, indent.GetNextIndent());
}
