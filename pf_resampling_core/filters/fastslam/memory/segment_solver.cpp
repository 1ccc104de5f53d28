#include "pf_resampling_core/filters/fastslam/memory/segment_solver.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "pf_resampling_core/smoothing/residuals.hpp"

namespace pf_resampling {
namespace {

constexpr double kLeastDamping = 1e-6;
constexpr double kLargestDamping = 1e8;
constexpr double kTolerance = 0.01;  // of the cost, that a step promises
constexpr double kSmallPromise = 1.0;
// Of what a step promises: the damping falls, or rises.
constexpr double kMuch = 0.75;
constexpr double kLittle = 0.25;
constexpr int kMostSteps = 100;
constexpr int kMostRounds = 24;
// New condensations are no news if the cost changes by less.
constexpr double kNoNews = 0.5;
// How far what a segment is linearised in may move.
constexpr double kTurned = 0.02;        // rad
constexpr double kMoved = 0.1;          // m
constexpr double kMovedShare = 0.02;    // of a track's distance
constexpr double kShareChanged = 1.25;  // factor
constexpr double kNoiseChanged = 1.1;   // factor
// Cauchy's width for the odometry of a whole segment.
constexpr double kSlipWidth = 4.0;
constexpr double kNoSlip = 16.0;
constexpr std::size_t kNewest = 3;  // segments
// What a slip costs, and the weight of the odometry that is one.
constexpr double kSlipCost = 5.0;
constexpr double kSlippingShare = 0.5;

bool is_near(double a, double b, double factor) {
  return a < factor * b && b < factor * a;
}

bool has_moved(const SegmentGraph& graph, std::size_t s, const Eigen::VectorXd& moved) {
  const Segment& segment = *graph.segments[s];
  if (std::abs(moved[2]) > kTurned || moved.head<2>().norm() > kMoved) return true;
  for (std::size_t k = 0; k < segment.tracks.size(); ++k) {
    const double distance = std::max(1.0, segment.tracks[k].norm());
    if (moved.segment<2>(3 + 2 * static_cast<Eigen::Index>(k)).norm() > kMovedShare * distance) {
      return true;
    }
  }
  return !is_near(segment.motion_share, graph.motion_shares[s], kShareChanged) ||
         !is_near(segment.noise.range, graph.noise.range, kNoiseChanged) ||
         !is_near(segment.noise.bearing, graph.noise.bearing, kNoiseChanged) ||
         !is_near(segment.noise.motion, graph.noise.motion, kNoiseChanged);
}

struct Descent {
  bool is_solved = false;
  bool is_factorized = false;  // where the last step began, without damping
  bool has_news = false;       // new condensations changed the cost
  double cost = 0.0;
};

// From where a step promises little, the next keeps its factorisation.
Descent descend(SegmentEquations* equations, SegmentGraph* graph) {
  Descent descent;
  double damping = 0.0;
  bool is_fresh = false;  // factorised
  descent.cost = equations->linearize(*graph);
  for (int i = 0; i < kMostSteps && std::isfinite(descent.cost); ++i) {
    if (!equations->gradient().allFinite()) return descent;
    double promise = 0.0;
    double gain = 0.0;
    for (bool is_better = false; !is_better;) {
      if (damping > kLargestDamping) return descent;
      if (is_fresh || equations->factorize(damping)) {
        descent.is_factorized = damping == 0.0;
        const Eigen::VectorXd step = equations->step();
        promise = -0.5 * step.dot(equations->gradient());
        const Eigen::VectorXd gradient = equations->gradient();
        SegmentGraph moved;
        moved.bases = graph->bases;
        moved.landmarks = graph->landmarks;
        moved.constants = graph->constants;
        equations->move(step, &moved);
        const auto swap = [&] {
          std::swap(moved.bases, graph->bases);
          std::swap(moved.landmarks, graph->landmarks);
          std::swap(moved.constants, graph->constants);
        };
        swap();
        const double cost = equations->linearize_gradient(*graph);
        gain = (descent.cost - cost) / promise;
        is_better = cost <= descent.cost;
        if (is_better) {
          descent.cost = cost;
        } else {
          swap();
          equations->set_gradient(gradient);
        }
        if (promise < kTolerance) {
          descent.is_solved = std::isfinite(promise);
          return descent;
        }
        if (is_fresh && !is_better) {  // the factorisation is too old
          is_fresh = false;
          equations->linearize(*graph);
          continue;
        }
      }
      is_fresh = false;
      if (gain > kMuch) damping *= 0.1;
      if (!(gain >= kLittle)) damping = std::max(kLeastDamping, 10.0 * damping);  // nor a number
      if (damping < kLeastDamping) damping = 0.0;
    }
    is_fresh = promise < kSmallPromise && descent.is_factorized;
    if (!is_fresh) equations->linearize(*graph);
  }
  return descent;
}

// Weight of the odometry of a segment under Cauchy's loss, but for what chance does.
double share_of(double square) {
  return robust_weight(std::max(0.0, square - kNoSlip), kSlipWidth);
}

// Whether the odometry of any segment is to have another weight; takes it over.
bool update_shares(SegmentGraph* graph) {
  bool has_changed = false;
  for (std::size_t s = 0; s < graph->segments.size(); ++s) {
    if (!graph->segments[s]->has_data()) continue;
    const OdometryError error = odometry_error(*graph, s, s + 1);
    const double share = share_of(error.square(error.slip_covariance));
    if (is_near(share, graph->motion_shares[s], kShareChanged)) continue;
    graph->motion_shares[s] = share;
    has_changed = true;
  }
  return has_changed;
}

// Whether the odometry of one of the newest segments gets another weight. What was refused of
// others is refused again as long as nothing moves.
bool has_new_doubt(const SegmentGraph& before, const SegmentGraph& doubted) {
  const std::size_t count = before.segments.size();
  for (std::size_t s = count - std::min(count, kNewest); s < count; ++s) {
    if (doubted.motion_shares[s] != before.motion_shares[s]) return true;
  }
  return false;
}

// Moves the estimate a share of the way to another.
void move_towards(const SegmentGraph& to, double share, SegmentGraph* graph) {
  for (std::size_t s = 0; s < graph->bases.size(); ++s) {
    const Pose2 way = relative(graph->bases[s], to.bases[s]);
    graph->bases[s] = compose(graph->bases[s], {share * way.x, share * way.y, share * way.heading});
  }
  for (std::size_t l = 0; l < graph->landmarks.size(); ++l) {
    graph->landmarks[l] += share * (to.landmarks[l] - graph->landmarks[l]);
  }
  graph->constants += share * (to.constants - graph->constants);
}

// Steps and new condensations in turn, until both rest; the weights of the odometry too where
// `with_shares`. What is robust, or slips, may go to and fro: then the next condensation is half of
// the way from the last, then a quarter, and so on. What is loose may, too, and costs nothing.
// `descent`: that led to the graph's estimate; not solved, if none did.
Descent settle(double robust_width, bool with_shares, Descent descent, SegmentEquations* equations,
               SegmentGraph* graph) {
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  bool has_news = false;
  double condensed_cost = kUnknown;
  double last_cost = kUnknown;
  double cost_before = kUnknown;
  double stride = 1.0;
  for (int round = 0; round < kMostRounds; ++round) {
    bool has_changed = with_shares && update_shares(graph);
    const SegmentGraph from = *graph;
    if (round > 0 || !descent.is_solved) descent = descend(equations, graph);
    if (!descent.is_solved) return descent;
    if (has_changed) {  // what is seen keeps its weight until the odometry has its own
      condensed_cost = kUnknown;
      continue;
    }
    const double change = std::abs(descent.cost - condensed_cost);
    if (change < kNoNews) break;
    has_news |= std::isfinite(change) && change > kSlipCost;
    condensed_cost = descent.cost;
    const SegmentGraph found = *graph;
    const bool is_last = round + 1 == kMostRounds;  // nothing would descend from part of the way
    if (descent.cost > cost_before - kTolerance) stride *= 0.5;
    if (stride < 1.0 && !is_last) move_towards(from, 1.0 - stride, graph);
    cost_before = std::exchange(last_cost, descent.cost);
    for (std::size_t s = 0; s < graph->segments.size(); ++s) {
      const Segment& segment = *graph->segments[s];
      if (!segment.has_data() || !has_moved(*graph, s, difference(*graph, s, segment))) continue;
      if (!relinearize(robust_width, s, graph)) continue;
      has_changed = true;
      descent.is_factorized = false;
    }
    if (!has_changed) {
      *graph = found;
      break;
    }
  }
  descent.has_news = has_news;
  return descent;
}

double log_root(const Eigen::Matrix3d& root) {
  return root.diagonal().array().log().sum();
}

// What slips add to the cost of data: the logarithms of the normalisers of motions that are trusted
// less than odometry states, and what a slip costs.
double slip_loss(const SegmentGraph& graph) {
  double loss = 0.0;
  bool slipped = false;
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    const double share = graph.motion_shares[s];
    const double scale = graph.noise.motion / std::sqrt(share);
    for (const MotionFactor& motion : graph.segments[s]->motions) {
      loss -= 1.5 * std::log(share);
      const bool may_slip = !motion.slip_covariance.isZero();
      if (may_slip) {
        MotionFactor sound = motion;
        sound.slip_covariance.setZero();
        loss += log_root(motion_root(sound, scale)) - log_root(motion_root(motion, scale));
      }
      const bool slips = may_slip || share < kSlippingShare;
      if (slips && !slipped) loss += kSlipCost;
      slipped = slips;
    }
  }
  return loss;
}

// What is known of an estimate where all rests; the equations are factorised there.
void complete(const SegmentGraph& graph, const Descent& descent, SegmentEquations* equations,
              SegmentSolution* solution) {
  solution->is_solved = descent.is_solved;
  if (descent.is_solved && !descent.is_factorized) {
    equations->linearize(graph);
    solution->is_solved = equations->factorize(0.0);
  }
  if (!solution->is_solved) return;
  solution->cost = descent.cost + slip_loss(graph);
  solution->log_determinant = equations->log_determinant();
  for (const auto& segment : graph.segments) {
    solution->log_determinant += segment->condensed->log_determinant;
  }
  solution->is_solved = std::isfinite(solution->log_determinant);
}

}  // namespace

bool relinearize(double robust_width, std::size_t s, SegmentGraph* graph) {
  Segment segment = at_estimate(*graph, s);
  if (!fit(FreePart::between, robust_width, &segment) || !condense(robust_width, &segment)) {
    return false;
  }
  graph->segments[s] = std::make_shared<const Segment>(std::move(segment));
  return true;
}

SegmentSolution solve(double robust_width, SegmentGraph* graph,
                      std::unique_ptr<SegmentEquations>* result) {
  SegmentSolution solution;
  auto equations = std::make_unique<SegmentEquations>(*graph);
  SegmentGraph solved = *graph;
  const Descent first = descend(equations.get(), &solved);
  SegmentGraph doubted = solved;
  const bool is_doubted = update_shares(&doubted);
  Descent as_believed = settle(robust_width, false, first, equations.get(), &solved);
  complete(solved, as_believed, equations.get(), &solution);
  if (!is_doubted) doubted = solution.is_solved ? solved : *graph;
  if ((is_doubted || update_shares(&doubted)) &&
      (!solution.is_solved || as_believed.has_news || has_new_doubt(*graph, doubted))) {
    SegmentSolution other = solution;
    const Descent descent = settle(robust_width, true, {}, equations.get(), &doubted);
    complete(doubted, descent, equations.get(), &other);
    if (other.negative_log_evidence() < solution.negative_log_evidence()) {
      solution = other;
      solved = std::move(doubted);
    } else if (solution.is_solved) {
      as_believed.is_factorized = false;
      complete(solved, as_believed, equations.get(), &solution);
    }
  }
  if (!solution.is_solved) return solution;
  *graph = std::move(solved);
  if (result != nullptr) *result = std::move(equations);
  return solution;
}

Eigen::MatrixXd draw_deviations(const SegmentEquations& equations, const SegmentGraph& graph,
                                int particles, const RandomStream& stream) {
  const Eigen::Index pairs = (particles + 1) / 2;
  Eigen::MatrixXd draws;
  Eigen::MatrixXd pulled;
  equations.draw(static_cast<int>(pairs), stream, &draws, &pulled);
  const Eigen::Index landmarks = 2 * static_cast<Eigen::Index>(graph.landmarks.size());
  Eigen::MatrixXd half(pairs, landmarks + kSensorConstants + 3);
  // A landmark given all the rest is independent of it, and what the particles keep.
  for (std::size_t l = 0; l < graph.landmarks.size(); ++l) {
    const int at = equations.landmark_at(l);
    half.middleCols<2>(2 * static_cast<Eigen::Index>(l)) =
        (draws.middleRows<2>(at) -
         equations.landmark_information(l).inverse() * pulled.middleRows<2>(at))
            .transpose();
  }
  const int constants = equations.constants_at();
  half.middleCols<kSensorConstants>(landmarks) =
      draws.middleRows<kSensorConstants>(constants).transpose();
  half.middleCols<kOdometryConstants>(landmarks) -=
      (equations.odometry_information().inverse() *
       pulled.middleRows<kOdometryConstants>(constants))
          .transpose();
  half.rightCols<3>() = draws.middleRows<3>(equations.base_at(graph.bases.size() - 1)).transpose();
  Eigen::MatrixXd deviations(particles, half.cols());
  for (Eigen::Index i = 0; i < particles; ++i) {
    deviations.row(i) = (i % 2 == 0 ? 1.0 : -1.0) * half.row(i / 2);
  }
  // An odd one out is the estimate itself, so that the mean stays.
  if (particles % 2 == 1) deviations.row(particles - 1).setZero();
  return deviations;
}

}  // namespace pf_resampling
