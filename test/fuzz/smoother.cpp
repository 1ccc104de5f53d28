// Factor graphs: refused, or smoothed to something finite, or left as they were.
#include "pf_resampling_core/smoothing/smoother.hpp"

#include <algorithm>
#include <cmath>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/smoothing/cross_validation.hpp"
#include "pf_resampling_core/smoothing/reassociation.hpp"
#include "test/fuzz/fuzz_target.hpp"

namespace pf_resampling::fuzz {
namespace {

// Graphs of which every number may be anything, or of which few are out of the ordinary.
class GraphMaker {
 public:
  explicit GraphMaker(Bytes* bytes) : bytes_(bytes), wild_(bytes->below(4) == 0) {}

  SmoothingGraph make() {
    SmoothingGraph graph;
    const int poses = 1 + bytes_->below(12);
    const int landmarks = bytes_->below(6);
    SensorConstants sigma;
    for (double& value : sigma) value = number(0.01);
    graph.prior = prior_at(pose({}), sigma);
    graph.poses.push_back(graph.prior.pose);
    for (int i = 1; i < poses; ++i) {
      graph.poses.push_back(pose({0.5 * i, 0.0, 0.0}));
      graph.motions.push_back(motion());
    }
    for (int i = 0; i < landmarks; ++i) {
      graph.landmarks.emplace_back(number(2.0 * i), number(3.0));
    }
    for (int i = 0; i < poses; ++i) {
      for (int k = 0; k < landmarks; ++k) {
        const int kind = bytes_->below(4);
        if (kind == 0) continue;
        (kind == 3 ? graph.unassigned : graph.sightings).push_back(sighting(graph, i, k));
        if (kind == 3) graph.unassigned.back().landmark = -1;
      }
    }
    add_radios(&graph);
    if (bytes_->below(8) == 0) graph.noise.range = number(1.0);
    // A pose or landmark that is not there, or a motion too few.
    if (bytes_->below(16) == 0 && !graph.sightings.empty()) {
      graph.sightings.back().landmark = bytes_->integer();
    }
    if (bytes_->below(16) == 0 && !graph.motions.empty()) graph.motions.pop_back();
    return graph;
  }

 private:
  // Last, and none where the bytes are used up: so that older corpora say what they said.
  void add_radios(SmoothingGraph* graph) {
    const int radios = bytes_->below(4);
    if (radios == 0) return;
    RadioPrior own;
    own.common = {number(0.05), number(0.5)};
    SensorConstants sigma;
    for (double& value : sigma) value = number(0.01);
    graph->prior = prior_among_radios(graph->prior.pose, {number(1.0), number(1.0), number(1.0)},
                                      sigma, radios, own);
    graph->radios.assign(static_cast<std::size_t>(radios), {number(0.0), number(0.0)});
    for (int i = 0; i < static_cast<int>(graph->poses.size()); ++i) {
      RangeFactor range;
      range.pose = i;
      range.radio = bytes_->below(radios);
      range.beacon = {number(5.0), number(-4.0)};
      range.antenna = {number(0.1), number(0.2)};
      range.height = number(1.0);
      range.range = number(6.0);
      range.variance = number(0.01);
      graph->ranges.push_back(range);
    }
  }

  double number(double usual) {
    if (wild_) return bytes_->number();
    const int kind = bytes_->below(16);
    if (kind == 15) return bytes_->number();
    return kind < 8 ? usual : usual * (1.0 + 0.01 * bytes_->moderate());
  }
  Pose2 pose(const Pose2& usual) {
    return {number(usual.x), number(usual.y), number(usual.heading)};
  }
  MotionFactor motion() {
    MotionFactor motion;
    motion.mean = pose({0.5, 0.0, 0.0});
    for (int i = 0; i < 3; ++i) motion.covariance(i, i) = number(1e-4);
    motion.sensitivity(0, SensorConstant::distance_scale) = number(0.5);
    motion.sensitivity(2, SensorConstant::yaw_rate) = number(0.1);
    return motion;
  }
  SightingFactor sighting(const SmoothingGraph& graph, int pose_number, int landmark) {
    const Pose2& from = graph.poses[static_cast<std::size_t>(pose_number)];
    const Eigen::Vector2d& to = graph.landmarks[static_cast<std::size_t>(landmark)];
    SightingFactor sighting;
    sighting.pose = pose_number;
    sighting.landmark = landmark;
    sighting.range = number(std::hypot(to.x() - from.x, to.y() - from.y));
    sighting.bearing = number(std::atan2(to.y() - from.y, to.x() - from.x));
    sighting.range_variance = number(0.01);
    sighting.bearing_variance = number(0.001);
    return sighting;
  }

  Bytes* bytes_;
  bool wild_;
};

bool is_finite(const SmoothingGraph& graph) {
  bool finite = graph.constants.allFinite();
  for (const Pose2& pose : graph.poses) {
    finite =
        finite && std::isfinite(pose.x) && std::isfinite(pose.y) && std::isfinite(pose.heading);
  }
  for (const Eigen::Vector2d& landmark : graph.landmarks) finite = finite && landmark.allFinite();
  for (const Eigen::Vector2d& radio : graph.radios) finite = finite && radio.allFinite();
  return finite;
}

bool same_estimate(const SmoothingGraph& a, const SmoothingGraph& b) {
  const auto same = [](const Pose2& left, const Pose2& right) {
    return std::equal_to<>()(left.x, right.x) && std::equal_to<>()(left.y, right.y) &&
           std::equal_to<>()(left.heading, right.heading);
  };
  return std::equal(a.poses.begin(), a.poses.end(), b.poses.begin(), b.poses.end(), same) &&
         a.landmarks == b.landmarks && a.radios == b.radios && a.constants == b.constants;
}

void go_on(Bytes* bytes, const SmoothingOptions& options, const SmoothingResult& result,
           SmoothingGraph graph) {
  const Eigen::MatrixXd drawn =
      draw_deviations(result.belief, 6, RandomStream(1, RandomPurpose::redraw, 2));
  require(drawn.size() == 0 || drawn.allFinite(), "a deviation that is drawn is not finite");
  ReassociationOptions association;
  association.robust_width = options.robust_width;
  association.log_density_of_new = bytes->moderate();
  association.log_density_of_landmarks = bytes->moderate();
  const Duplicates duplicates = find_duplicates(association, graph, result.belief);
  merge_landmarks(duplicates.pairs, &graph);
  reassociate(association, &graph);
  check(graph);
  std::vector<double> times;
  for (std::size_t i = 0; i < graph.poses.size(); ++i) times.push_back(12.0 * double(i));
  const auto errors = [&](const std::vector<LeftOutBlock>& blocks) {
    return cross_validate(graph, options.robust_width, blocks);
  };
  const NoiseScales scales = noise_scales(errors(passages(graph, times, -1.0, 1e3)),
                                          errors(windows(graph, times, -1.0, 1e3)));
  require(std::isfinite(scales.range + scales.bearing + scales.motion) && scales.range >= 1.0 &&
              scales.bearing >= 1.0 && scales.motion >= 1.0,
          "a noise scale makes no sense");
  if (graph.poses.size() < 2) return;
  const int forgotten = 1 + bytes->below(static_cast<int>(graph.poses.size()) - 1);
  if (forget_oldest(forgotten, options.robust_width, &graph)) {
    const SmoothingResult again = smooth(options, &graph);
    require(again.fault != SmoothingFault::none || is_finite(graph),
            "after forgetting, a solution is not finite");
  }
}

}  // namespace

void smoother(const std::uint8_t* bytes, std::size_t size) {
  Bytes decisions(bytes, size);
  SmoothingOptions options;
  options.iterations = 1 + decisions.below(10);
  options.robust_width = decisions.flip() ? 2.0 : 0.0;
  SmoothingGraph graph;
  SmoothingResult result;
  try {
    graph = GraphMaker(&decisions).make();
    const SmoothingGraph before = graph;
    result = smooth(options, &graph);
    require(result.fault == SmoothingFault::none || same_estimate(before, graph),
            "without a solution the graph has changed");
  } catch (const Error&) {
    return;
  }
  if (result.fault != SmoothingFault::none) return;
  require(is_finite(graph), "a solution is not finite");
  require(std::isfinite(result.cost), "the cost of a solution is not finite");
  require(result.belief.covariance.allFinite(), "the covariance of a solution is not finite");
  go_on(&decisions, options, result, graph);
}

}  // namespace pf_resampling::fuzz
