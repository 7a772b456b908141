// SPDX-License-Identifier: BSD-3-Clause
/**
 * The mappers whose surfels a pass splats in the current frame. Internal to the module.
 */
#pragma once

#include "Rendering/Scene/SceneView.h"
#include "vtkSurfelMapper.h"

#include <vtkCallbackCommand.h>
#include <vtkNew.h>
#include <vtkRenderer.h>
#include <vtkWeakPointer.h>

#include <vector>

namespace SurfelSplatting
{
/// Tells mappers that a pass splats their surfels, from now to the end of the renderer's frame:
/// they draw no dots, also while later passes draw translucent props.
class SplattedMappers
{
public:
  ~SplattedMappers() { this->Clear(); }

  void Set(vtkRenderer* renderer, const std::vector<SceneItem>& items)
  {
    this->Clear();
    for (const SceneItem& item : items)
    {
      vtkSurfelMapper* mapper = vtkSurfelMapper::SafeDownCast(item.Mapper);
      mapper->SetSplatted(true);
      this->Mappers.push_back(mapper);
    }
    vtkNew<vtkCallbackCommand> command;
    command->SetClientData(this);
    command->SetCallback([](vtkObject*, unsigned long, void* self, void*) {
      static_cast<SplattedMappers*>(self)->Clear();
    });
    this->Renderer = renderer;
    this->Observer = renderer->AddObserver(vtkCommand::EndEvent, command);
  }

  void Clear()
  {
    for (vtkSurfelMapper* mapper : this->Mappers)
    {
      mapper->SetSplatted(false);
    }
    this->Mappers.clear();
    if (this->Renderer)
    {
      this->Renderer->RemoveObserver(this->Observer);
      this->Renderer = nullptr;
    }
  }

private:
  std::vector<vtkSmartPointer<vtkSurfelMapper>> Mappers;
  vtkWeakPointer<vtkRenderer> Renderer;
  unsigned long Observer = 0;
};
}
