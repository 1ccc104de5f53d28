#include "pf_resampling_core/smoothing/smoother.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pf_resampling_core/benchmark/report.hpp"
#include "pf_resampling_core/smoothing/normal_equations.hpp"
#include "pf_resampling_core/smoothing/residuals.hpp"

#if defined(PF_RESAMPLING_WITH_CERES)
#include <ceres/ceres.h>
#endif

/// What a redraw costs, by poses and landmarks: the solution with the joint covariance of landmarks
/// and newest pose, its parts, and the draw of 1000 particles. Beside Ceres, which gets the same
/// residuals and derivatives from the same functions, and starts from the same estimate: the last
/// redraw's. The robot drives round and round a ring that landmarks stand along, and sees those
/// within 6 m.
namespace pf_resampling {
namespace {

constexpr int kParticles = 1000;
constexpr double kSee = 6.0;          // m
constexpr double kAdvance = 1.0 / 3;  // m from pose to pose, if that is enough for
constexpr double kRounds = 1.5;       // at least
constexpr double kRobustWidth = 4.0;
constexpr int kNew = 25;  // poses since the last redraw

// The truth is its estimate.
SmoothingGraph ring_drive(int poses, int landmarks) {
  const RandomStream random(1, RandomPurpose::test, 0);
  std::uint64_t next = 0;
  const auto noise = [&](double sigma) { return sigma * random.normal(next++); };
  const double radius = std::max(10.0, landmarks / 6.0);
  SmoothingGraph graph;
  SensorConstants sigma;
  sigma << 0.02, 0.02, 0.005, 0.0005, 0.02, 0.01, 0.01;
  graph.prior = prior_at(Pose2{}, sigma);
  for (int l = 0; l < landmarks; ++l) {
    const double angle = 2.0 * kPi * l / landmarks;
    const double off = l % 2 == 0 ? radius - 2.0 : radius + 3.0;
    graph.landmarks.emplace_back(off * std::sin(angle), radius - off * std::cos(angle));
  }
  const double advance = std::max(kAdvance, kRounds * 2.0 * kPi * radius / poses);
  const Pose2 step = {advance, 0.0, advance / radius};
  graph.poses.emplace_back();
  for (int i = 1; i < poses; ++i) {
    graph.poses.push_back(compose(graph.poses.back(), step));
    MotionFactor motion;
    motion.mean = {step.x + noise(0.02), noise(0.02), step.heading + noise(0.01)};
    motion.covariance.diagonal() << 4e-4, 4e-4, 1e-4;
    motion.sensitivity(0, SensorConstant::distance_scale) = step.x;
    motion.sensitivity(2, SensorConstant::turn_scale) = step.heading;
    motion.sensitivity(2, SensorConstant::drift) = step.x;
    motion.sensitivity(2, SensorConstant::yaw_rate) = 1.0;
    motion.sensitivity(0, SensorConstant::delay) = noise(0.1);
    graph.motions.push_back(motion);
    for (int l = 0; l < landmarks && i % 2 == 0; ++l) {
      const Eigen::Vector2d& place = graph.landmarks[static_cast<std::size_t>(l)];
      const Pose2 seen = relative(graph.poses.back(), {place.x(), place.y(), 0.0});
      const double range = std::hypot(seen.x, seen.y);
      if (range > kSee) continue;
      SightingFactor sighting;
      sighting.pose = i;
      sighting.landmark = l;
      sighting.range = range + noise(0.05);
      sighting.bearing = wrap_angle(std::atan2(seen.y, seen.x) + noise(0.02));
      sighting.range_variance = 25e-4;
      sighting.bearing_variance = 4e-4;
      graph.sightings.push_back(sighting);
    }
  }
  return graph;
}

// Where a redraw starts from: the solution without the newest poses, and these by odometry.
void start_as_a_redraw(SmoothingGraph* graph) {
  SmoothingGraph before = *graph;
  const std::size_t poses = graph->poses.size() - kNew;
  before.poses.resize(poses);
  before.motions.resize(poses - 1);
  while (before.sightings.back().pose >= static_cast<int>(poses)) before.sightings.pop_back();
  smooth({50, kRobustWidth}, &before);
  graph->landmarks = before.landmarks;
  graph->constants = before.constants;
  for (std::size_t i = 0; i < poses; ++i) graph->poses[i] = before.poses[i];
  for (std::size_t i = poses; i < graph->poses.size(); ++i) {
    graph->poses[i] =
        compose(graph->poses[i - 1], corrected_motion(graph->motions[i - 1], graph->constants));
  }
}

// What all measurements of one size share; made when it is their turn.
class Drive {
 public:
  Drive(int poses, int landmarks) : graph(ring_drive(poses, landmarks)), equations(graph) {
    start_as_a_redraw(&graph);
    moved = graph;
    result = smooth({20, kRobustWidth}, &moved);
    equations.linearize(graph, kRobustWidth);
    equations.factorize(0.0);
  }

  SmoothingGraph graph;
  NormalEquations equations;
  SmoothingGraph moved;
  SmoothingResult result;
};

std::shared_ptr<Drive> drive_of(int poses, int landmarks) {
  static std::shared_ptr<Drive> drive;
  static int of_poses = 0;
  static int of_landmarks = 0;
  if (of_poses != poses || of_landmarks != landmarks) {
    drive.reset();
    drive = std::make_shared<Drive>(poses, landmarks);
    of_poses = poses;
    of_landmarks = landmarks;
  }
  return drive;
}

#if defined(PF_RESAMPLING_WITH_CERES)

template <int kRows, int kColumns>
void copy(const Eigen::Matrix<double, kRows, kColumns>& derivative, double* to) {
  if (to == nullptr) return;
  Eigen::Map<Eigen::Matrix<double, kRows, kColumns, Eigen::RowMajor>> there(to);
  there = derivative;
}

/// The same least squares in Ceres. The problem is laid out once, as one would that lets it grow.
class CeresProblem {
 public:
  CeresProblem(const SmoothingGraph& graph, ceres::SparseLinearAlgebraLibraryType library)
      : library_(library), graph_(graph) {
    for (const Pose2& pose : graph.poses) poses_.push_back({pose.x, pose.y, pose.heading});
    for (const Eigen::Vector2d& place : graph.landmarks) landmarks_.push_back(place);
    for (std::size_t i = 0; i < graph.motions.size(); ++i) {
      problem_.AddResidualBlock(new Motion(graph.motions[i], graph.noise.motion), nullptr,
                                poses_[i].data(), poses_[i + 1].data(), constants_.data());
    }
    for (const SightingFactor& sighting : graph.sightings) {
      problem_.AddResidualBlock(new Sighting(sighting, graph.noise),
                                new ceres::CauchyLoss(kRobustWidth),
                                poses_[static_cast<std::size_t>(sighting.pose)].data(),
                                landmarks_[static_cast<std::size_t>(sighting.landmark)].data(),
                                constants_.data() + kOdometryConstants);
    }
    const SensorConstants roots =
        graph.prior.information.diagonal().tail<kSensorConstants>().cwiseSqrt();
    problem_.AddResidualBlock(new Prior<kOdometryConstants>(roots.head<kOdometryConstants>()),
                              nullptr, constants_.data());
    problem_.AddResidualBlock(new Prior<2>(roots.tail<2>()), nullptr,
                              constants_.data() + kOdometryConstants);
    problem_.SetParameterBlockConstant(poses_.front().data());
    start_poses_ = poses_;
    start_landmarks_ = landmarks_;
  }
  CeresProblem(const CeresProblem&) = delete;
  CeresProblem& operator=(const CeresProblem&) = delete;

  /// From the graph's estimate to the least cost, where smooth() ends: a step that changes the cost
  /// by less than 1e-4.
  ceres::Solver::Summary solve() {
    std::copy(start_poses_.begin(), start_poses_.end(), poses_.begin());
    std::copy(start_landmarks_.begin(), start_landmarks_.end(), landmarks_.begin());
    constants_ = graph_.constants;
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.sparse_linear_algebra_library_type = library_;
    options.max_num_iterations = 20;
    options.function_tolerance =
        1e-4 / (static_cast<double>(graph_.motions.size() + graph_.sightings.size()));
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary;
  }

  /// Of landmarks and newest pose, together.
  bool covariance() {
    std::vector<const double*> wanted;
    for (const Eigen::Vector2d& landmark : landmarks_) wanted.push_back(landmark.data());
    wanted.push_back(poses_.back().data());
    ceres::Covariance::Options options;
    options.sparse_linear_algebra_library_type = library_;
    ceres::Covariance covariance(options);
    if (!covariance.Compute(wanted, &problem_)) return false;
    const Eigen::Index size = 2 * static_cast<Eigen::Index>(landmarks_.size()) + 3;
    Eigen::MatrixXd joint(size, size);
    return covariance.GetCovarianceMatrix(wanted, joint.data());
  }

 private:
  class Motion : public ceres::SizedCostFunction<3, 3, 3, kOdometryConstants> {
   public:
    Motion(const MotionFactor& motion, double scale)
        : motion_(motion), root_(motion_root(motion, scale)) {}
    bool Evaluate(double const* const* at, double* residuals, double** jacobians) const override {
      SensorConstants constants = SensorConstants::Zero();
      constants.head<kOdometryConstants>() = Eigen::Map<const OdometryConstants>(at[2]);
      const MotionResidual r = motion_residual(motion_, root_, {at[0][0], at[0][1], at[0][2]},
                                               {at[1][0], at[1][1], at[1][2]}, constants);
      Eigen::Map<Eigen::Vector3d>{residuals} = r.value;
      if (jacobians == nullptr) return true;
      copy<3, 3>(r.by_from, jacobians[0]);
      copy<3, 3>(r.by_to, jacobians[1]);
      copy<3, kOdometryConstants>(r.by_constants, jacobians[2]);
      return true;
    }

   private:
    using OdometryConstants = Eigen::Matrix<double, kOdometryConstants, 1>;
    MotionFactor motion_;
    Eigen::Matrix3d root_;
  };

  class Sighting : public ceres::SizedCostFunction<2, 3, 2, 2> {
   public:
    Sighting(const SightingFactor& sighting, const NoiseScales& noise)
        : sighting_(sighting), noise_(noise) {}
    bool Evaluate(double const* const* at, double* residuals, double** jacobians) const override {
      SensorConstants constants = SensorConstants::Zero();
      constants.tail<2>() << at[2][0], at[2][1];
      const SightingResidual r = sighting_residual(
          sighting_, noise_, {at[0][0], at[0][1], at[0][2]}, {at[1][0], at[1][1]}, constants);
      Eigen::Map<Eigen::Vector2d>{residuals} = r.value;
      if (jacobians == nullptr) return true;
      copy<2, 3>(r.by_pose, jacobians[0]);
      copy<2, 2>(r.by_landmark, jacobians[1]);
      copy<2, 2>(r.by_constants, jacobians[2]);
      return true;
    }

   private:
    SightingFactor sighting_;
    NoiseScales noise_;
  };

  template <int kSize>
  class Prior : public ceres::SizedCostFunction<kSize, kSize> {
   public:
    using Values = Eigen::Matrix<double, kSize, 1>;
    explicit Prior(const Values& roots) : roots_(roots) {}
    bool Evaluate(double const* const* at, double* residuals, double** jacobians) const override {
      Eigen::Map<Values>{residuals} = roots_.cwiseProduct(Eigen::Map<const Values>(at[0]));
      if (jacobians == nullptr) return true;
      copy<kSize, kSize>(roots_.asDiagonal().toDenseMatrix(), jacobians[0]);
      return true;
    }

   private:
    Values roots_;
  };

  ceres::SparseLinearAlgebraLibraryType library_;
  const SmoothingGraph& graph_;
  std::vector<Eigen::Vector3d> poses_, start_poses_;
  std::vector<Eigen::Vector2d> landmarks_, start_landmarks_;
  SensorConstants constants_ = SensorConstants::Zero();
  ceres::Problem problem_;
};

void measure_ceres(const std::string& section, int poses, int landmarks,
                   ceres::SparseLinearAlgebraLibraryType library, const std::string& name,
                   bool with_covariance) {
  // Kept from repetition to repetition, and no longer than it is its turn.
  static std::shared_ptr<CeresProblem> current;
  static int next_id = 0;
  static int current_id = -1;
  const int id = next_id++;
  measure(
      section, "solution", name, landmarks,
      [=] {
        current->solve();
        if (with_covariance) current->covariance();
      },
      false,
      [=] {
        if (current_id == id) return;
        current.reset();
        const auto drive = drive_of(poses, landmarks);
        current = std::make_shared<CeresProblem>(drive->graph, library);
        current_id = id;
        const ceres::Solver::Summary summary = current->solve();
        const double difference = summary.final_cost - drive->result.cost;
        if (summary.termination_type != ceres::CONVERGENCE || std::abs(difference) > 1e-3) {
          std::fprintf(stderr, "%s, %s, %d landmarks: %s; its cost is larger by %.1e\n",
                       section.c_str(), name.c_str(), landmarks, summary.message.c_str(),
                       difference);
        }
      });
}

#endif

void measure_all(int poses, int landmarks) {
  const std::string section = std::to_string(poses) + " poses";
  const auto prepare = [=] { drive_of(poses, landmarks); };
  const auto ours = [&](const std::string& row, const std::function<void(Drive&)>& run) {
    measure(
        section, row, "ours", landmarks, [=] { run(*drive_of(poses, landmarks)); }, false, prepare);
  };
  ours("solution", [](Drive& drive) {
    drive.moved = drive.graph;
    drive.result = smooth({20, kRobustWidth}, &drive.moved);
  });
#if defined(PF_RESAMPLING_WITH_CERES)
  for (const auto& [library, name] : {std::make_pair(ceres::SUITE_SPARSE, "SuiteSparse"),
                                      std::make_pair(ceres::EIGEN_SPARSE, "Eigen")}) {
    const std::string contender = std::string("Ceres, ") + name;
    if (!ceres::IsSparseLinearAlgebraLibraryTypeAvailable(library)) continue;
    measure_ceres(section, poses, landmarks, library, contender, false);
    // By Eigen's sparse QR it would take minutes.
    if (library == ceres::SUITE_SPARSE) {
      measure_ceres(section, poses, landmarks, library, contender + ", cov.", true);
    }
  }
#endif
  ours("  layout", [](Drive& drive) { NormalEquations equations(drive.graph); });
  ours("  derivatives, assembly",
       [](Drive& drive) { drive.equations.linearize(drive.graph, kRobustWidth); });
  ours("  factorisation", [](Drive& drive) { drive.equations.factorize(0.0); });
  ours("draw of 1000 particles", [](Drive& drive) {
    draw_deviations(drive.result.belief, kParticles, RandomStream(1, RandomPurpose::test, 1));
  });
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  using namespace pf_resampling;
  for (const int poses : {250, 500, 1000, 2000, 4000, 7000}) {
    for (const int landmarks : {15, 100, 300}) measure_all(poses, landmarks);
  }
  TableUnit unit;
  unit.text = "ms of processor time; columns: landmarks in the map";
  unit.per_particle = false;
  unit.nanoseconds = 1e6;
  return run_and_report(argc, argv, "Smoothing", unit);
}
