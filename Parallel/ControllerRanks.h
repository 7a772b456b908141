// SPDX-License-Identifier: BSD-3-Clause
/**
 * Implements the core's Ranks with the processes of a vtkMultiProcessController.
 */
#pragma once

#include "Core/Base/Ranks.h"

class vtkMultiProcessController;

namespace SurfelSplatting
{
class ControllerRanks : public Ranks
{
public:
  /// @param controller must outlive this
  explicit ControllerRanks(vtkMultiProcessController* controller)
    : Controller(controller)
  {
  }

  int Size() const override;
  int Rank() const override;
  std::vector<Message> Exchange(std::vector<Message> messages) override;

private:
  void Send(const Message& message, int to);
  void Receive(Message& message, int from);

  vtkMultiProcessController* Controller;
};
}
