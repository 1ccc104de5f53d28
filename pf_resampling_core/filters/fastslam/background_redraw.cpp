#include "pf_resampling_core/filters/fastslam/background_redraw.hpp"

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <atomic>
#include <deque>
#include <exception>
#include <mutex>
#include <utility>

namespace pf_resampling {
namespace {

/// Of what a redraw has used, the allocator keeps the most that there ever was, and for each of a
/// few threads apart: most of what a node would need.
void give_memory_back() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace

struct BackgroundRedraw::Job {
  explicit Job(const FastSlam& filter) : interventions(filter.interventions()), copy(filter) {}
  void run(const std::function<double()>& stopwatch) noexcept;
  bool next(Input* input);

  const std::uint64_t interventions;
  int updates = 0;  // since it began
  std::atomic<bool> is_given_up{false};

  // The thread's, until it is done.
  FastSlam copy;
  double duration = 0.0;
  std::exception_ptr fault;

  std::mutex mutex;  // of the two below
  std::deque<Input> inputs;
  bool is_done = false;
};

void BackgroundRedraw::Job::run(const std::function<double()>& stopwatch) noexcept {
  try {
    const double start = stopwatch ? stopwatch() : 0.0;
    copy.redraw_now();
    duration = stopwatch ? stopwatch() - start : 0.0;
    give_memory_back();
    for (Input input; next(&input);) input(&copy);
  } catch (...) {
    fault = std::current_exception();
    const std::lock_guard<std::mutex> lock(mutex);
    is_done = true;
  }
}

// False when there is none left, or no need of it: the job is done then.
bool BackgroundRedraw::Job::next(Input* input) {
  const std::lock_guard<std::mutex> lock(mutex);
  is_done = is_given_up || inputs.empty();
  if (is_done) return false;
  *input = std::move(inputs.front());
  inputs.pop_front();
  return true;
}

BackgroundRedraw::BackgroundRedraw(std::function<double()> stopwatch, TakeOvers* take_overs)
    : stopwatch_(std::move(stopwatch)),
      take_overs_(take_overs != nullptr ? take_overs : &own_take_overs_) {}

BackgroundRedraw::~BackgroundRedraw() {
  if (job_) job_->is_given_up = true;
  wait();
}

void BackgroundRedraw::wait() {
  if (thread_.joinable()) thread_.join();
}

void BackgroundRedraw::update(FastSlam* filter, const OdometryIncrement& odometry,
                              const std::vector<RangeBearingObservation>& measured,
                              const Pose2& sensor) {
  take_over(filter);
  filter->update(odometry, measured, sensor);
  if (is_running() && ++job_->updates > kMostReplayed) {
    refuse("it fell behind by more than " + std::to_string(kMostReplayed) + " updates", *filter);
  }
  log([odometry, measured, sensor](FastSlam* copy) {
    copy->update(odometry, measured, sensor);
    copy->put_off_redraw();
  });
  if (!filter->redraw_is_due()) return;
  if (!job_ && refused_ != filter->interventions()) begin(*filter);
  if (refused_ == filter->interventions()) {
    filter->refuse_redraw();
  } else {
    filter->put_off_redraw();
  }
  refused_.reset();
}

// The copy gets what the filter saw, not what it concludes: if the filter is put elsewhere, the
// copy is given up.
std::optional<PoseEstimate> BackgroundRedraw::recover(
    FastSlam* filter, const std::vector<RangeBearingObservation>& observations, const Pose2& sensor,
    std::int64_t stamp, double lost) {
  log([observations, sensor, stamp](FastSlam* copy) {
    copy->recover(observations, sensor, stamp, 0.0);
  });
  return filter->recover(observations, sensor, stamp, lost);
}

void BackgroundRedraw::log(Input input) {
  if (!is_running()) return;
  const std::lock_guard<std::mutex> lock(job_->mutex);
  job_->inputs.push_back(std::move(input));
}

void BackgroundRedraw::begin(const FastSlam& filter) {
  try {
    job_ = std::make_unique<Job>(filter);
    thread_ = std::thread([job = job_.get(), this] { job->run(stopwatch_); });
  } catch (const std::exception& error) {  // no memory, or no thread
    job_.reset();
    refuse(error.what(), filter);
  }
}

void BackgroundRedraw::refuse(const std::string& fault, const FastSlam& filter) {
  give_up();
  status_.last_fault = fault;
  refused_ = filter.interventions();
}

// The thread may go on for a while.
void BackgroundRedraw::give_up() {
  ++status_.given_up;
  if (job_) job_->is_given_up = true;
}

bool BackgroundRedraw::is_running() const {
  return job_ && !job_->is_given_up;
}

bool BackgroundRedraw::take_over(FastSlam* filter) {
  if (!job_) return false;
  if (is_running() && job_->interventions != filter->interventions()) give_up();
  const auto is_done = [&] {
    const std::lock_guard<std::mutex> lock(job_->mutex);
    return job_->is_done;
  };
  if (!take_overs_->is_due(is_done)) return false;
  wait();  // for a thread that has nothing left to do, unless a run is replayed
  const std::unique_ptr<Job> job = std::move(job_);
  if (job->is_given_up) return false;
  try {
    if (job->fault) std::rethrow_exception(job->fault);
    for (const Input& input : job->inputs) input(&job->copy);  // that came when it was done
  } catch (const std::exception& error) {
    refuse(error.what(), *filter);
    return false;
  } catch (...) {
    refuse("an exception without a text", *filter);
    return false;
  }
  if (job->copy.step() != filter->step()) {  // updated, but not by update()
    give_up();
    return false;
  }
  std::swap(*filter, job->copy);
  ++status_.taken_over;
  status_.last_replayed = job->updates;
  status_.last_duration = job->duration;
  status_.longest_duration = std::max(status_.longest_duration, job->duration);
  return true;
}

}  // namespace pf_resampling
