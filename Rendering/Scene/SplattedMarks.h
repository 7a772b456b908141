// SPDX-License-Identifier: BSD-3-Clause
/**
 * Which surfels a pass splats in the frame that is being drawn. Internal to the module.
 */
#pragma once

#include "vtkSurfelMapper.h"
#include "vtkSurfelSplatter.h"

#include <vtkCallbackCommand.h>
#include <vtkNew.h>
#include <vtkRenderer.h>
#include <vtkWeakPointer.h>

#include <vector>

namespace SurfelSplatting
{
/// The surfels of a renderer are the pass's from now to the end of the renderer's frame, also while
/// later passes draw translucent props.
class SplattedMarks
{
public:
  ~SplattedMarks() { this->Clear(); }

  void Set(vtkRenderer* renderer, const std::vector<vtkSurfelSplatter::Item>& items)
  {
    this->Clear();
    for (const vtkSurfelSplatter::Item& item : items)
    {
      item.Mapper->SetSplatted(true);
      this->Mappers.push_back(item.Mapper);
    }
    vtkNew<vtkCallbackCommand> command;
    command->SetClientData(this);
    command->SetCallback([](vtkObject*, unsigned long, void* self, void*) {
      static_cast<SplattedMarks*>(self)->Clear();
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
