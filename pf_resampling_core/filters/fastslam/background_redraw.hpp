#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/parallel/take_overs.hpp"

namespace pf_resampling {

/// What became of redraws in the background.
struct BackgroundRedrawStatus {
  double last_duration = 0.0;     ///< s, of the last that took over: the redraw without the replay
  double longest_duration = 0.0;  ///< s, likewise
  int last_replayed = 0;          ///< updates that it caught up with
  std::int64_t taken_over = 0;
  std::int64_t given_up = 0;  ///< because the filter was changed meanwhile, or for the last_fault
  std::string last_fault;     ///< why a redraw could not be done; counted as refused by the filter
};

/// Redraws for a filter that must not wait for them. When a redraw is due, a copy of the whole
/// filter does it in a thread of its own and replays the updates that came since; once none is
/// left, the copy takes the filter's place. If no other redraw comes due meanwhile, it is to the
/// bit what a filter would be that had waited.
///
/// One redraw at a time; others that come due are begun after it. A filter that is changed
/// otherwise meanwhile (FastSlam::interventions()) keeps its place, and the copy is thrown away.
///
/// All functions are to be called from one thread, all with the same filter, which has
/// set_deferred_redraws(true); none but wait(), the destructor and, when a run is replayed,
/// take_over() waits for a redraw.
class BackgroundRedraw {
 public:
  /// Updates, since a redraw began, that a copy may need to catch up with before it is given up.
  static constexpr int kMostReplayed = 2000;

  /// `stopwatch`: seconds since some time, from any thread; without it, durations are 0.
  /// `take_overs`: see there; nullptr: nobody asks.
  explicit BackgroundRedraw(std::function<double()> stopwatch = nullptr,
                            TakeOvers* take_overs = nullptr);
  /// Waits for a redraw that runs.
  ~BackgroundRedraw();
  BackgroundRedraw(const BackgroundRedraw&) = delete;
  BackgroundRedraw& operator=(const BackgroundRedraw&) = delete;

  /// FastSlam::update(), after take_over(); a redraw that is then due is begun.
  void update(FastSlam* filter, const OdometryIncrement& odometry,
              const std::vector<RangeBearingObservation>& measured, const Pose2& sensor = {});
  /// FastSlam::recover().
  std::optional<PoseEstimate> recover(FastSlam* filter,
                                      const std::vector<RangeBearingObservation>& observations,
                                      const Pose2& sensor, std::int64_t stamp, double lost);
  /// Puts the copy in place of the filter if it has caught up; returns whether it did.
  bool take_over(FastSlam* filter);

  /// Waits until the copy has caught up; for tests.
  void wait();
  bool is_running() const;
  /// Whether there is one that was neither taken over nor thrown away yet.
  bool is_busy() const { return job_ != nullptr; }
  const BackgroundRedrawStatus& status() const { return status_; }

 private:
  using Input = std::function<void(FastSlam*)>;
  struct Job;

  void log(Input input);
  void begin(const FastSlam& filter);
  void refuse(const std::string& fault, const FastSlam& filter);
  void give_up();

  std::function<double()> stopwatch_;
  TakeOvers own_take_overs_;
  TakeOvers* take_overs_;
  std::unique_ptr<Job> job_;
  std::thread thread_;
  std::optional<std::uint64_t> refused_;  // the redraw that is due, after so many interventions
  BackgroundRedrawStatus status_;
};

}  // namespace pf_resampling
