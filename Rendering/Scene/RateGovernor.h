// SPDX-License-Identifier: BSD-3-Clause
/**
 * Chooses how much coarser surfels are drawn, so that frames hold a wanted rate. Internal to the
 * module.
 */
#pragma once

namespace SurfelSplatting
{
/**
 * Learns from the time that frames take. The number of splats falls with the inverse square of the
 * coarsening, but other work does not: the coarsening is changed by less than that, frame by frame,
 * until the load is between 0.7 and 1.
 */
class RateGovernor
{
public:
  static constexpr double MaxCoarsening = 16.0;

  /// Factor on the LODError for the next interactive frame, [1, MaxCoarsening].
  double Coarsening() const { return this->Next; }

  /**
   * Learns from an interactive frame.
   * @param load        time that the frame took over the time that the wanted rate leaves for it
   * @param coarsening  factor that the frame was drawn with
   * @param hasProps    whether blurred pixels of other props were splatted: coarsening does not
   *                    reduce their number, so that more of it may be useless
   */
  void AddInteractiveFrame(double load, double coarsening, bool hasProps);

  /// Learns that a still frame was drawn. The scene may have changed, so that more coarsening may
  /// be useful again; the last coarsening is kept for the next interaction.
  void AddStillFrame();

private:
  double Next = 1.0;
  double LastCoarsening = 1.0;
  double LastLoad = 0.0;                // 0: unknown
  double LargestUseful = MaxCoarsening; // more was seen to save no time
};
}
