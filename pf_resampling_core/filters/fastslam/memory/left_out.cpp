#include "pf_resampling_core/filters/fastslam/memory/left_out.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "pf_resampling_core/filters/fastslam/memory/memory.hpp"
#include "pf_resampling_core/filters/fastslam/memory/reassociation.hpp"
#include "pf_resampling_core/filters/fastslam/memory/segment_equations.hpp"
#include "pf_resampling_core/smoothing/residuals.hpp"

namespace pf_resampling {
namespace {

constexpr double kWindow = 25.0;          // s
constexpr double kLongestPassage = 30.0;  // s
// A prediction so many times less certain than the observations tells nothing.
constexpr double kNoPrediction = 1e7;
constexpr double kFar = 1e4;       // m
constexpr double kNextScan = 1.0;  // s
constexpr std::size_t kFewestPairs = 100;
constexpr double kMedianOfNormal = 0.6745;
constexpr std::size_t kMostPredicted = 300;  // blocks of each kind
// Blocks that are predicted at a time, a factorisation each; and how much of the drive passes from
// one time to the next: their number grows with its logarithm. Of so many landmarks half as many,
// of twice as many a third, and so on.
constexpr std::size_t kMostPassages = 8;
constexpr std::size_t kMostWindows = 4;
constexpr std::size_t kMostOfWindow = 30;  // landmarks
constexpr double kValidationStride = 0.02;
constexpr std::size_t kManyLandmarks = 200;
// Factor that the noise may fall by at a time: what the drive is linearised at follows it.
constexpr double kMostNoiseFall = 1.25;
constexpr double kNoiseStep = 1.05;  // factor below which noise stays as it was found to be

// A segment without what is left out, at the graph's estimate.
struct Remainder {
  Segment whole;  // with it, not condensed
  Segment segment;
  SegmentLinearization linear;
  ChainCholesky between;  // of the poses between, summed over kinds
  Eigen::VectorXd pull;   // their gradient
};
using Remainders = std::map<std::size_t, Remainder>;

bool leave_out(const SegmentGraph& graph, double robust_width, const LeftOutSightings& block,
               Remainders* remainders) {
  std::map<std::size_t, std::vector<std::size_t>> left_out;
  for (const SightingPlace& place : block.sightings) {
    left_out[place.segment].push_back(place.sighting);
  }
  for (auto& [s, sightings] : left_out) {
    if (!graph.segments[s]->has_data()) return false;
    std::sort(sightings.begin(), sightings.end());
    Remainder& rest = (*remainders)[s];
    rest.whole = at_estimate(graph, s);
    rest.segment = without(sightings, rest.whole);
    if (!condense(robust_width, &rest.segment, &rest.linear)) return false;
    const Eigen::Index size = rest.segment.condensed->between.rows();
    if (size == 0) continue;
    rest.pull = rest.linear.whole_gradient().head(size);
    rest.between.compute(rest.linear.whole_hessian());
  }
  return true;
}

// The mean residual of a group, scaled to unit variance, and how it follows the poses between of
// the segments that it is in.
struct GroupMean {
  Eigen::Vector2d value = Eigen::Vector2d::Zero();
  std::map<std::size_t, Eigen::MatrixXd> by_between;  // two columns
};

// `by_unknowns`: two columns, how it follows the unknowns of the graph.
GroupMean mean_of(const SegmentGraph& graph, double robust_width,
                  const std::vector<SightingPlace>& group, const Remainders& remainders,
                  const SegmentEquations& equations, Eigen::Ref<Eigen::MatrixXd> by_unknowns) {
  GroupMean mean;
  by_unknowns.setZero();
  Eigen::Array2d information = Eigen::Array2d::Zero();
  for (const SightingPlace& place : group) {
    const Remainder& rest = remainders.at(place.segment);
    const Segment& whole = rest.whole;
    const SightingFactor& sighting = whole.sightings[place.sighting];
    const std::size_t track = static_cast<std::size_t>(sighting.landmark);
    const SightingResidual r = sighting_residual(
        sighting, graph.noise, whole.poses[static_cast<std::size_t>(sighting.pose)],
        whole.tracks[track], graph.constants);
    const double root = std::sqrt(robust_weight(r.value.squaredNorm(), robust_width));
    const Eigen::Array2d share(root / std::sqrt(sighting.range_variance),
                               root / std::sqrt(sighting.bearing_variance));
    information += share.square();
    const Eigen::Matrix2d factor = (root * share).matrix().asDiagonal();
    mean.value += factor * r.value;
    // As of a segment that has this track alone.
    Segment alone;
    alone.landmarks = {whole.landmarks[track]};
    alone.tracks = {whole.tracks[track]};
    Eigen::MatrixXd local = Eigen::MatrixXd::Zero(alone.size(), 2);
    local.middleRows<2>(3) = (factor * r.by_landmark).transpose();
    local.bottomRows<2>() = (factor * r.by_constants).transpose();
    const Eigen::Matrix<double, 3, 2> by_pose = (factor * r.by_pose).transpose();
    if (static_cast<std::size_t>(sighting.pose) + 1 == whole.poses.size()) {
      local.topRows<3>() = by_pose;
    } else {
      Eigen::MatrixXd& by_between = mean.by_between[place.segment];
      if (by_between.size() == 0) by_between.setZero(rest.segment.condensed->between.rows(), 2);
      by_between.middleRows<3>(3 * sighting.pose) += by_pose;
    }
    equations.from_segment(graph, place.segment, alone, local, by_unknowns);
  }
  const Eigen::Matrix2d scale = information.rsqrt().matrix().asDiagonal();
  mean.value = (scale * mean.value).eval();
  by_unknowns = (by_unknowns * scale).eval();
  for (auto& [s, by_between] : mean.by_between) {
    by_between = (by_between * scale).eval();
    const Remainder& rest = remainders.at(s);
    mean.value -= by_between.transpose() * rest.between.solve(rest.pull);
    equations.from_segment(graph, s, rest.segment,
                           rest.segment.condensed->between.transpose() * by_between, by_unknowns);
  }
  return mean;
}

// Of a group: its mean, and what that is once its block is left out.
struct LeftOutMean {
  std::size_t block;
  GroupMean mean;
  Eigen::Vector2d residual;
};

using Parts = std::array<Eigen::Matrix2d, kDataKinds>;

// What each kind of data says along `spread`, two columns for each mean, from a segment that is
// whole: of all means at once, since the data are many.
void add_parts(const SegmentGraph& graph, std::size_t s, const SegmentEquations& equations,
               const Eigen::MatrixXd& spread, const std::vector<bool>& takes_part,
               std::vector<Parts>* parts) {
  const Segment& segment = *graph.segments[s];
  const std::array<double, kDataKinds> weights = weights_of(graph, s, segment);
  const Eigen::MatrixXd along = equations.to_segment(graph, s, segment, spread);
  for (std::size_t kind = 0; kind < kDataKinds; ++kind) {
    const Eigen::MatrixXd& information = segment.condensed->information[kind];
    if (information.size() == 0) continue;
    const Eigen::MatrixXd pull = weights[kind] * information * along;
    for (std::size_t i = 0; i < parts->size(); ++i) {
      const Eigen::Index at = 2 * static_cast<Eigen::Index>(i);
      if (!takes_part[i]) continue;
      (*parts)[i][kind] += along.middleCols<2>(at).transpose() * pull.middleCols<2>(at);
    }
  }
}

// The same from one of which something is left out, with its poses between.
void add_parts(const SegmentGraph& graph, std::size_t s, const SegmentEquations& equations,
               const Eigen::MatrixXd& spread, const Remainder& rest, const GroupMean& mean,
               Parts* parts) {
  const Eigen::MatrixXd along = equations.to_segment(graph, s, rest.segment, spread);
  const Eigen::MatrixXd& follow = rest.segment.condensed->between;
  const Eigen::Index between = follow.rows();
  Eigen::MatrixXd all(between + along.rows(), 2);
  all.bottomRows(along.rows()) = along;
  if (between > 0) {
    all.topRows(between) = follow * along;
    const auto by_between = mean.by_between.find(s);
    if (by_between != mean.by_between.end()) {
      all.topRows(between) += rest.between.solve(by_between->second);
    }
  }
  for (std::size_t kind = 0; kind < SegmentLinearization::kKinds; ++kind) {
    (*parts)[kind] += all.transpose() * rest.linear.hessian[kind].times(all);
  }
}

PredictionError prediction_error(const NoiseScales& noise, const Eigen::Vector2d& residual,
                                 Parts parts) {
  parts[DataKind::range](0, 0) += 1.0;
  parts[DataKind::bearing](1, 1) += 1.0;
  // From standard deviations as they are taken to be back to those stated.
  const Eigen::Vector2d unit(noise.range, noise.bearing);
  const auto stated = [&](const Eigen::Matrix2d& covariance, double scale) -> Eigen::Matrix2d {
    return unit.asDiagonal() * covariance * unit.asDiagonal() / (scale * scale);
  };
  PredictionError error;
  error.error = unit.cwiseProduct(residual);
  error.by_ranges = stated(parts[DataKind::range], noise.range);
  error.by_bearings = stated(parts[DataKind::bearing], noise.bearing);
  error.by_motions = stated(parts[DataKind::motion], noise.motion);
  error.by_prior = stated(parts[DataKind::given], 1.0);
  return error;
}

void append_newest(const std::vector<PredictedBlock>& blocks, std::vector<PredictedBlock>* all) {
  all->insert(all->end(), blocks.begin(), blocks.end());
  if (all->size() > kMostPredicted) {
    all->erase(all->begin(), all->end() - static_cast<std::ptrdiff_t>(kMostPredicted));
  }
}

// Evenly over all of them.
template <typename Item>
void keep_evenly(std::size_t most, std::vector<Item>* items) {
  if (items->size() <= most) return;
  for (std::size_t i = 0; i < most; ++i) {
    (*items)[i] = std::move((*items)[i * items->size() / most]);
  }
  items->resize(most);
}

}  // namespace

std::vector<LeftOutSightings> completed_passages(const SegmentGraph& graph,
                                                 const std::vector<double>& begins, double since,
                                                 double until) {
  struct Passage {
    double begin = 0.0, last = 0.0;  // s
    std::vector<SightingPlace> sightings;
  };
  std::vector<LeftOutSightings> passages;
  const auto end = [&](Passage* passage, double at) {
    if (!passage->sightings.empty() && at > since && at <= until) {
      passages.push_back({passage->sightings, {passage->sightings}});
    }
    passage->sightings.clear();
  };
  std::vector<Passage> open(graph.landmarks.size());
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    const Segment& segment = *graph.segments[s];
    const std::vector<double> times = times_of(segment, begins[s]);
    for (std::size_t i = 0; i < segment.sightings.size(); ++i) {
      const SightingFactor& sighting = segment.sightings[i];
      const double now = times[static_cast<std::size_t>(sighting.pose)];
      Passage& passage = open[static_cast<std::size_t>(
          segment.landmarks[static_cast<std::size_t>(sighting.landmark)])];
      if (now > passage.last + kPassageGap) {
        end(&passage, passage.last + kPassageGap);
      } else if (now > passage.begin + kLongestPassage) {
        end(&passage, passage.begin + kLongestPassage);
      }
      if (passage.sightings.empty()) passage.begin = now;
      passage.last = now;
      passage.sightings.push_back({s, i});
    }
  }
  for (Passage& passage : open) end(&passage, passage.last + kPassageGap);
  return passages;
}

std::vector<LeftOutSightings> completed_windows(const SegmentGraph& graph,
                                                const std::vector<double>& begins, double since,
                                                double until) {
  constexpr double kStride = 0.5 * kWindow;
  struct Seen {
    double time;
    int landmark;
    SightingPlace place;
  };
  std::vector<Seen> all;
  std::set<double> windows;  // where they begin: sightings may be ages apart
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    const Segment& segment = *graph.segments[s];
    if (begins[s] + segment.duration() + kWindow + kStride <= since - kWindow) continue;
    const std::vector<double> times = times_of(segment, begins[s]);
    for (std::size_t i = 0; i < segment.sightings.size(); ++i) {
      const SightingFactor& sighting = segment.sightings[i];
      const double at = times[static_cast<std::size_t>(sighting.pose)];
      all.push_back({at, segment.landmarks[static_cast<std::size_t>(sighting.landmark)], {s, i}});
      const double begin = (std::round(at / kStride) - 1.0) * kStride;
      const double known = begin + kWindow + kStride;
      if (begin >= 0.0 && known > since && known <= until) windows.insert(begin);
    }
  }
  std::vector<LeftOutSightings> blocks;
  for (const double begin : windows) {
    LeftOutSightings block;
    std::map<int, std::vector<SightingPlace>> groups;
    for (const Seen& seen : all) {
      if (seen.time < begin || seen.time >= begin + kWindow) continue;
      block.sightings.push_back(seen.place);
      if (std::round(seen.time / kStride) != std::round(begin / kStride) + 1.0) continue;
      groups[seen.landmark].push_back(seen.place);
    }
    for (auto& [landmark, group] : groups) block.groups.push_back(std::move(group));
    blocks.push_back(std::move(block));
  }
  return blocks;
}

std::vector<PredictedBlock> predict(const SegmentGraph& graph, double robust_width,
                                    const std::vector<LeftOutSightings>& blocks) {
  std::vector<PredictedBlock> predicted_blocks;
  if (blocks.empty()) return predicted_blocks;
  SegmentEquations equations(graph);
  equations.linearize(graph);
  equations.add_to_landmarks(kFar);
  const SegmentEquations::Mark whole = equations.mark();
  std::vector<Remainders> remainders(blocks.size());
  std::vector<LeftOutMean> means;
  std::vector<Eigen::MatrixXd> spreads;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (!leave_out(graph, robust_width, blocks[b], &remainders[b])) continue;
    for (const auto& [s, rest] : remainders[b]) {
      equations.add(graph, s, *graph.segments[s], -1.0);
      equations.add(graph, s, rest.segment, 1.0);
    }
    if (equations.factorize(0.0)) {
      const Eigen::VectorXd step = equations.step();
      const std::size_t count = blocks[b].groups.size();
      Eigen::MatrixXd by_unknowns(equations.size(), 2 * static_cast<Eigen::Index>(count));
      std::vector<GroupMean> of_block;
      for (const std::vector<SightingPlace>& group : blocks[b].groups) {
        const Eigen::Index at = 2 * static_cast<Eigen::Index>(of_block.size());
        of_block.push_back(mean_of(graph, robust_width, group, remainders[b], equations,
                                   by_unknowns.middleCols<2>(at)));
      }
      const Eigen::MatrixXd of_unknowns = equations.solve(by_unknowns);
      for (std::size_t i = 0; i < count; ++i) {
        const Eigen::Index at = 2 * static_cast<Eigen::Index>(i);
        const Eigen::MatrixXd spread = of_unknowns.middleCols<2>(at);
        const Eigen::Matrix2d predicted = by_unknowns.middleCols<2>(at).transpose() * spread;
        if (!predicted.allFinite() || predicted.maxCoeff() > kNoPrediction) continue;
        const Eigen::Vector2d residual =
            of_block[i].value + by_unknowns.middleCols<2>(at).transpose() * step;
        means.push_back({b, std::move(of_block[i]), residual});
        spreads.push_back(spread);
      }
    }
    equations.take_back(whole);
  }
  Eigen::MatrixXd spread(equations.size(), 2 * static_cast<Eigen::Index>(means.size()));
  std::vector<Parts> parts(means.size());
  for (std::size_t i = 0; i < means.size(); ++i) {
    spread.middleCols<2>(2 * static_cast<Eigen::Index>(i)) = spreads[i];
    parts[i].fill(Eigen::Matrix2d::Zero());
  }
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    std::vector<bool> is_whole(means.size(), true);
    for (std::size_t i = 0; i < means.size(); ++i) {
      const Remainders& of_block = remainders[means[i].block];
      const auto rest = of_block.find(s);
      if (rest == of_block.end()) continue;
      is_whole[i] = false;
      add_parts(graph, s, equations, spreads[i], rest->second, means[i].mean, &parts[i]);
    }
    add_parts(graph, s, equations, spread, is_whole, &parts);
  }
  const Eigen::Index constants = equations.constants_at();
  for (std::size_t i = 0; i < means.size(); ++i) {
    const Eigen::MatrixXd along = spreads[i].middleRows<kSensorConstants>(constants);
    parts[i][DataKind::given] +=
        along.transpose() * constants_information(graph).asDiagonal() * along;
    if (i == 0 || means[i].block != means[i - 1].block) predicted_blocks.emplace_back();
    predicted_blocks.back().push_back(prediction_error(graph.noise, means[i].residual, parts[i]));
  }
  return predicted_blocks;
}

NoiseScales scatter(const SegmentGraph& graph) {
  std::vector<double> ranges, bearings;
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    if (!graph.segments[s]->has_data()) continue;
    const Segment segment = at_estimate(graph, s);
    const std::vector<double> times = times_of(segment, 0.0);
    struct Seen {
      double time = -std::numeric_limits<double>::infinity();
      std::size_t pose = 0;
      Eigen::Vector2d residual;
    };
    std::vector<Seen> before(segment.tracks.size());
    for (const SightingFactor& sighting : segment.sightings) {
      const auto pose = static_cast<std::size_t>(sighting.pose);
      const auto track = static_cast<std::size_t>(sighting.landmark);
      const auto residual_from = [&](const Pose2& from) -> Eigen::Vector2d {
        return sighting_residual(sighting, NoiseScales{}, from, segment.tracks[track],
                                 graph.constants)
            .value;
      };
      Seen& last = before[track];
      if (times[pose] > last.time && times[pose] <= last.time + kNextScan) {
        // As the odometry has it: the solution's poses follow what is seen.
        Pose2 from = segment.poses[last.pose];
        for (std::size_t i = last.pose + 1; i <= pose; ++i) {
          from = compose(from, segment.motions[i].mean);
        }
        const Eigen::Vector2d difference = residual_from(from) - last.residual;
        ranges.push_back(std::abs(difference[0]));
        bearings.push_back(std::abs(difference[1]));
      }
      last = {times[pose], pose, residual_from(segment.poses[pose])};
    }
  }
  if (ranges.size() < kFewestPairs) return {};
  const auto scale = [](std::vector<double>* differences) {
    const auto middle = differences->begin() + static_cast<std::ptrdiff_t>(differences->size() / 2);
    std::nth_element(differences->begin(), middle, differences->end());
    return std::clamp(*middle / (kMedianOfNormal * std::sqrt(2.0)), kSmallestNoiseScale, 1.0);
  };
  return {scale(&ranges), scale(&bearings), 1.0};
}

void Memory::validate(double robust_width) {
  const SegmentGraph& graph = state_.graph;
  const bool are_windows_left = state_.windows_validated < state_.validated;
  const bool is_due = state_.time >= (1.0 + kValidationStride) * state_.validated;
  const std::size_t parts = 1 + graph.landmarks.size() / kManyLandmarks;
  const bool is_large = parts > 1;
  if (equations_ == nullptr || !(is_due || are_windows_left)) return;
  std::vector<LeftOutSightings> passages, windows;
  if (are_windows_left || !is_large) {
    windows = completed_windows(graph, state_.begins, state_.windows_validated, state_.time);
    state_.windows_validated = state_.time;
  }
  if (is_due && !(is_large && are_windows_left)) {
    passages = completed_passages(graph, state_.begins, state_.validated, state_.time);
    state_.validated = state_.time;
  }
  if (passages.empty() && windows.empty()) return;
  const auto share = [&](std::size_t most) { return std::max<std::size_t>(1, most / parts); };
  keep_evenly(share(kMostPassages), &passages);
  keep_evenly(share(kMostWindows), &windows);
  for (LeftOutSightings& window : windows) keep_evenly(share(kMostOfWindow), &window.groups);
  append_newest(predict(graph, robust_width, passages), &state_.passages);
  append_newest(predict(graph, robust_width, windows), &state_.windows);
  const NoiseScales found = noise_scales(state_.passages, state_.windows, scatter(graph));
  const auto approach = [](double from, double to) { return std::max(to, from / kMostNoiseFall); };
  NoiseScales& noise = state_.graph.noise;
  const NoiseScales next = {approach(noise.range, found.range),
                            approach(noise.bearing, found.bearing),
                            approach(noise.motion, found.motion)};
  const auto is_new = [](double from, double to) {
    return to > kNoiseStep * from || from > kNoiseStep * to;
  };
  if (is_new(noise.range, next.range) || is_new(noise.bearing, next.bearing) ||
      is_new(noise.motion, next.motion)) {
    noise = next;
  }
}

}  // namespace pf_resampling
