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
  bool All(bool value) override;

private:
  template <typename Function>
  void ForPartners(Function&& function) const;
  template <typename SendFunction, typename ReceiveFunction>
  void TakeTurns(int partner, SendFunction&& send, ReceiveFunction&& receive) const;
  template <typename T>
  T Swap(const T& own, int partner) const;
  void SwapMessages(const Message& out, Message& in, int partner) const;

  vtkMultiProcessController* Controller;
};
}
