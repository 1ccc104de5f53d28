#include "pf_resampling_core/filters/fastslam/saved_past.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

constexpr int kMostPoses = std::numeric_limits<int>::max() / 4;

bool is_scale(double scale) {
  return scale >= 1.0 && scale <= kLargestNoiseScale;
}

}  // namespace

void describe(Archive& archive, SmoothedPastState& past) {
  if (!archive.something(!past.graph.poses.empty())) return;
  archive("graph", past.graph);
  archive("landmark_ids", past.landmark_ids);
  archive("last_seen", past.last_seen);
  archive("is_dormant", past.is_dormant);
  archive("longest_absence", past.longest_absence);
  archive("decided", past.decided);
  archive("time", past.time);
  archive("validated", past.validated);
  archive("passages", past.passages);
  archive("windows", past.windows);
}

std::string fault_of(const SmoothedPastState& past) {
  const SmoothingGraph& graph = past.graph;
  if (graph.poses.empty()) return {};
  if (past.landmark_ids.size() != graph.landmarks.size() ||
      past.last_seen.size() != graph.landmarks.size() ||
      past.is_dormant.size() != graph.landmarks.size()) {
    return "redraw state is inconsistent: every landmark needs an id and a last sighting";
  }
  const auto is_number = [](int pose) { return std::abs(pose) <= kMostPoses; };
  if (!is_number(past.decided) ||
      !std::all_of(past.last_seen.begin(), past.last_seen.end(), is_number)) {
    return "redraw state is inconsistent: the number of a pose is out of range";
  }
  const GaussianPrior& prior = graph.prior;
  const bool fits = prior.landmarks.size() <= graph.landmarks.size() &&
                    prior.landmarks_given_path.size() == prior.landmarks.size() &&
                    prior.information.rows() == prior.size() &&
                    prior.information.cols() == prior.size() &&
                    prior.gradient.size() == prior.size();
  if (!fits || !prior.information.allFinite() || !prior.gradient.allFinite()) {
    return "the prior of what a redraw draws from has not the size of its landmarks, or is not "
           "finite";
  }
  if (!is_scale(graph.noise.range) || !is_scale(graph.noise.bearing) ||
      !is_scale(graph.noise.motion) || !std::isfinite(past.time) ||
      !std::isfinite(past.validated)) {
    return "the noise of what a redraw draws from has a scale that is not between 1 and 20, or a "
           "time that is not finite";
  }
  try {
    check(graph);
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

}  // namespace pf_resampling
