// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelViewActor.h"

#include "vtkSurfelMapper.h"
#include "vtkSurfelSplattingPass.h"

#include <vtkHardwareSelector.h>
#include <vtkMapper.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPolyData.h>
#include <vtkRenderState.h>
#include <vtkRenderer.h>

vtkStandardNewMacro(vtkSurfelViewActor);

vtkSurfelViewActor::vtkSurfelViewActor()
{
  vtkNew<vtkPolyData> noPoints; // exporters update the mappers of all actors
  vtkNew<vtkSurfelMapper> mapper;
  mapper->SetInputData(noPoints);
  this->SetMapper(mapper);
}

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
  // Larger than any coordinate that the filters keep.
  constexpr double far = 1e18;
  for (int side = 0; side < 6; ++side)
  {
    this->ViewBounds[side] = side % 2 == 0 ? -far : far;
  }
  return this->ViewBounds;
}

void vtkSurfelViewActor::Render(vtkRenderer* renderer, vtkMapper* mapper)
{
  mapper->Render(renderer, this); // vtkActor leaves this to the subclasses of its object factory
}

void vtkSurfelViewActor::ProcessSelectorPixelBuffers(
  vtkHardwareSelector* selector, std::vector<unsigned int>& pixeloffsets)
{
  this->Superclass::ProcessSelectorPixelBuffers(selector, pixeloffsets);
  unsigned char* pixels = selector->GetPixelBuffer(vtkHardwareSelector::COMPOSITE_INDEX_PASS);
  if (this->CompositeIndex == 0 || !pixels ||
    selector->GetCurrentPass() != vtkHardwareSelector::COMPOSITE_INDEX_PASS)
  {
    return;
  }
  for (const unsigned int offset : pixeloffsets)
  {
    for (int byte = 0; byte < 3; ++byte)
    {
      pixels[offset + byte] = static_cast<unsigned char>(this->CompositeIndex >> (8 * byte));
    }
  }
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
  // Splatted by the view's pass, or by the pass of an actor drawn before this one.
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
  if (window && this->Pass) // VTK also calls this without a window, which passes do not allow
  {
    this->Pass->ReleaseGraphicsResources(window);
  }
}

void vtkSurfelViewActor::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Pass: " << this->Pass.Get() << "\n";
  os << indent << "CoversView: " << this->CoversView << "\n";
  os << indent << "CompositeIndex: " << this->CompositeIndex << "\n";
}
