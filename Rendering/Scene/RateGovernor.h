// SPDX-License-Identifier: BSD-3-Clause
/**
 * Chooses how much coarser surfels are drawn, so that frames hold a wanted rate. Internal to the
 * module.
 */
#pragma once

namespace SurfelSplatting
{
/**
 * Learns from the time that frames take. The coarsening has steps of 2^(1/4). Each step is a trial:
 *
 * - A frame that takes too long is drawn more coarsely. If that does not save time, since the time
 *   goes into other work, the coarsening is taken back.
 * - A frame in time is drawn more finely. If that takes too long, the coarsening is taken back.
 * - Where coarser frames save no time, finer ones are tried, as long as they take no more.
 *
 * A failed trial is not repeated until the time changes by half or a still frame was drawn, so that
 * the picture of a resting camera does not flicker.
 */
class RateGovernor
{
public:
  static constexpr double MaxCoarsening = 16.0;

  /// Factor on the LODError for the next interactive frame, [1, MaxCoarsening].
  double Coarsening() const;

  /**
   * Learns from an interactive frame.
   * @param load        time that the frame took over the time that the wanted rate leaves for it
   * @param coarsening  factor that the frame was drawn with; others than Coarsening() are ignored
   */
  void AddInteractiveFrame(double load, double coarsening);

  /// Learns that a still frame was drawn. The scene may have changed, so that all trials may
  /// succeed again; the last coarsening is kept for the next interaction.
  void AddStillFrame();

private:
  enum class Trial
  {
    None,
    Coarser,
    Finer
  };

  void Decide(double load);
  bool HasFailed(double load) const;
  void Begin(Trial trial, int step, double load);

  int Step = 0; // of the next frame
  double Least = 0.0;
  int Frames = 0; // whose least load this is

  Trial Running = Trial::None;
  int StepBefore = 0;      // the trial
  double LoadBefore = 0.0; // the load that it is compared with

  bool CoarserFailed = false, FinerFailed = false;
  double SettledLoad = 0.0; // when a trial failed last
};
}
