// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelViewActor.h"

#include "vtkSurfelMapper.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkObjectFactory.h>
#include <vtkRenderState.h>
#include <vtkRenderer.h>

vtkStandardNewMacro(vtkSurfelViewActor);

vtkSurfelViewActor::vtkSurfelViewActor() = default;
vtkSurfelViewActor::~vtkSurfelViewActor() = default;

void vtkSurfelViewActor::SetPass(vtkSurfelSplattingPass* pass)
{
  if (this->Pass != pass)
  {
    this->Pass = pass;
    this->Modified();
  }
}

double* vtkSurfelViewActor::GetBounds()
{
  if (!this->CoversView)
  {
    return this->Superclass::GetBounds();
  }
  // Far beyond anything that is looked at, and well within what a projection can be computed of.
  constexpr double far = 1e9;
  for (int side = 0; side < 6; ++side)
  {
    this->ViewBounds[side] = side % 2 == 0 ? -far : far;
  }
  return this->ViewBounds;
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
  // By the view's pass, or by that of an actor before this one.
  const bool splatted = mapper && mapper->GetSplatted();
  if (!renderer || !this->Pass || renderer->GetSelector() || splatted)
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
  if (window && this->Pass) // VTK calls this without one; passes must not be
  {
    this->Pass->ReleaseGraphicsResources(window);
  }
}

void vtkSurfelViewActor::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Pass: " << this->Pass.Get() << "\n";
  os << indent << "CoversView: " << this->CoversView << "\n";
}
