// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/Scene/PropStamp.h"

#include <vtkActor.h>
#include <vtkAlgorithm.h>
#include <vtkAssemblyNode.h>
#include <vtkAssemblyPath.h>
#include <vtkCamera.h>
#include <vtkCommand.h>
#include <vtkDataObject.h>
#include <vtkLight.h>
#include <vtkLightCollection.h>
#include <vtkMapper.h>
#include <vtkMatrix4x4.h>
#include <vtkPlane.h>
#include <vtkPlaneCollection.h>
#include <vtkPolyDataMapper.h>
#include <vtkProp3D.h>
#include <vtkPropCollection.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkShaderProperty.h>

#include <cstring>

namespace SurfelSplatting
{
namespace
{
bool IsSurfelActor(vtkProp* prop)
{
  auto* actor = vtkActor::SafeDownCast(prop);
  return actor && actor->GetMapper() && actor->GetMapper()->IsA("vtkSurfelMapper");
}

/// Whether a renderer draws nothing but its props over a colour or a gradient.
bool IsPlain(vtkRenderer* renderer)
{
  return renderer->GetErase() && !renderer->Transparent() && !renderer->GetPreserveDepthBuffer() &&
    !renderer->GetTexturedBackground() && !renderer->GetUseImageBasedLighting();
}

/// Whether a mapper is of a class whose picture depends on what AddMapper adds, and on nothing
/// else. Derived classes may draw anything.
bool IsKnownMapper(vtkMapper* mapper)
{
  if (!mapper || mapper->GetNumberOfInputPorts() == 0 || !mapper->GetInputDataObject(0, 0) ||
    mapper->HasObserver(vtkCommand::UpdateShaderEvent) ||
    mapper->HasObserver(vtkCommand::StartEvent) || mapper->HasObserver(vtkCommand::EndEvent))
  {
    return false;
  }
  if (std::strcmp(mapper->GetClassName(), "vtkDataSetMapper") == 0)
  {
    return true;
  }
  auto* polygons = vtkPolyDataMapper::SafeDownCast(mapper);
  return polygons && std::strcmp(mapper->GetClassName(), "vtkOpenGLPolyDataMapper") == 0 &&
    polygons->GetNumberOfPieces() == 1 && polygons->GetNumberOfSubPieces() == 1 &&
    polygons->GetGhostLevel() == 0;
}
}

bool IsKnownActor(vtkActor* actor)
{
  if (!actor || std::strcmp(actor->GetClassName(), "vtkOpenGLActor") != 0 || actor->GetTexture() ||
    actor->GetProperty()->GetNumberOfTextures() > 0)
  {
    return false;
  }
  vtkShaderProperty* shader = actor->GetShaderProperty();
  return shader->GetNumberOfShaderReplacements() == 0 && !shader->HasVertexShaderCode() &&
    !shader->HasFragmentShaderCode() && !shader->HasGeometryShaderCode() &&
    IsKnownMapper(actor->GetMapper());
}

bool IsOtherProp(vtkProp* prop, bool opaqueOnly)
{
  bool isOther = false;
  prop->InitPathTraversal();
  while (vtkAssemblyPath* path = prop->GetNextPath())
  {
    vtkProp* leaf = path->GetLastNode()->GetViewProp();
    isOther = isOther ||
      (vtkProp3D::SafeDownCast(leaf) && leaf->GetVisibility() &&
        (!opaqueOnly || leaf->HasOpaqueGeometry()) && !IsSurfelActor(leaf));
  }
  return isOther;
}

void PropStamp::Clear()
{
  this->Numbers.clear();
  this->Stamped.clear();
  this->Others.clear();
  this->Known = false;
}

void PropStamp::Take(
  vtkRenderer* renderer, const std::vector<vtkProp*>& drawn, double aspect, std::uint64_t settings)
{
  this->Clear();
  if (!IsPlain(renderer))
  {
    return;
  }
  this->Numbers.push_back(settings);
  this->AddRenderer(renderer, aspect);
  vtkCollectionSimpleIterator it;
  renderer->GetViewProps()->InitTraversal(it);
  while (vtkProp* prop = renderer->GetViewProps()->GetNextProp(it))
  {
    if (!prop->GetVisibility() || IsSurfelActor(prop))
    {
      continue;
    }
    if (this->AddActor(vtkActor::SafeDownCast(prop)))
    {
      this->Stamped.emplace(prop, this->Stamped.size());
    }
    else if (IsOtherProp(prop, true))
    {
      this->Clear();
      return;
    }
  }
  for (vtkProp* prop : drawn)
  {
    const auto stamped = this->Stamped.find(prop);
    if (stamped == this->Stamped.end())
    {
      this->Others.push_back(prop);
    }
    else
    {
      this->Numbers.push_back(stamped->second);
    }
  }
  this->Known = true;
}

void PropStamp::Add(double value)
{
  std::uint64_t bits;
  std::memcpy(&bits, &value, sizeof(bits));
  this->Numbers.push_back(bits);
}

void PropStamp::AddRenderer(vtkRenderer* renderer, double aspect)
{
  vtkCamera* camera = renderer->GetActiveCamera();
  this->Numbers.push_back(this->SettingsTime(renderer));
  this->Numbers.push_back(renderer->GetRenderWindow()->GetMTime());
  this->Numbers.push_back(camera->GetMTime());
  for (vtkMatrix4x4* matrix :
    { camera->GetModelViewTransformMatrix(), camera->GetProjectionTransformMatrix(aspect, -1, 1) })
  {
    for (int i = 0; i < 16; ++i)
    {
      this->Add(matrix->GetData()[i]);
    }
  }
  this->AddLights(renderer->GetLights());
  // Settings of all mappers, which have no MTime.
  double factor = 0.0, units = 0.0;
  vtkMapper::GetResolveCoincidentTopologyPolygonOffsetParameters(factor, units);
  for (const double value : { static_cast<double>(vtkMapper::GetResolveCoincidentTopology()),
         static_cast<double>(vtkMapper::GetResolveCoincidentTopologyPolygonOffsetFaces()),
         vtkMapper::GetResolveCoincidentTopologyZShift(), factor, units })
  {
    this->Add(value);
  }
}

void PropStamp::AddLights(vtkLightCollection* lights)
{
  vtkCollectionSimpleIterator it;
  lights->InitTraversal(it);
  while (vtkLight* light = lights->GetNextLight(it))
  {
    this->Numbers.push_back(light->GetMTime());
    for (const double* vector :
      { light->GetTransformedPosition(), light->GetTransformedFocalPoint() })
    {
      for (int i = 0; i < 3; ++i)
      {
        this->Add(vector[i]);
      }
    }
  }
}

/// False, and nothing is added, if the actor is not of a known kind.
bool PropStamp::AddActor(vtkActor* actor)
{
  if (!IsKnownActor(actor))
  {
    return false;
  }
  this->Numbers.push_back(actor->GetMTime());
  this->Numbers.push_back(actor->GetProperty()->GetMTime());
  if (vtkProperty* backface = actor->GetBackfaceProperty())
  {
    this->Numbers.push_back(backface->GetMTime());
  }
  actor->ComputeMatrix(); // its own may be of the last frame
  for (int i = 0; i < 16; ++i)
  {
    this->Add(actor->GetMatrix()->GetData()[i]);
  }
  this->AddMapper(actor->GetMapper());
  return true;
}

void PropStamp::AddMapper(vtkMapper* mapper)
{
  if (!mapper->GetStatic() && mapper->GetInputAlgorithm())
  {
    mapper->GetInputAlgorithm()->Update();
  }
  this->Numbers.push_back(mapper->GetMTime()); // and that of its lookup table
  this->Numbers.push_back(mapper->GetInputDataObject(0, 0)->GetMTime());
  double values[5] = { 0.0 };
  mapper->GetCoincidentTopologyPolygonOffsetParameters(values[0], values[1]);
  mapper->GetCoincidentTopologyLineOffsetParameters(values[2], values[3]);
  mapper->GetCoincidentTopologyPointOffsetParameter(values[4]);
  for (const double value : values)
  {
    this->Add(value);
  }
  if (vtkPlaneCollection* planes = mapper->GetClippingPlanes())
  {
    vtkCollectionSimpleIterator it;
    planes->InitTraversal(it);
    while (auto* plane = vtkPlane::SafeDownCast(planes->GetNextItemAsObject(it)))
    {
      this->Numbers.push_back(plane->GetMTime());
    }
  }
}

/// MTime of a renderer without its exchanges of cameras.
std::uint64_t PropStamp::SettingsTime(vtkRenderer* renderer) const
{
  const std::uint64_t time = renderer->GetMTime();
  return time == this->TimeAfter ? this->TimeBefore : time;
}

void PropStamp::BeginCameraSwap(vtkRenderer* renderer)
{
  this->TimeBefore = this->SettingsTime(renderer);
}

void PropStamp::EndCameraSwap(vtkRenderer* renderer)
{
  this->TimeAfter = renderer->GetMTime();
}
}
