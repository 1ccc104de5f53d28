#include "pf_resampling_core/filters/fastslam/memory/memory.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "pf_resampling_core/models/odometry_motion.hpp"
#include "pf_resampling_core/smoothing/smoother.hpp"
#include "pf_resampling_core/test/smoothing/ring_drive.hpp"

namespace pf_resampling {
namespace {

constexpr double kWidth = 4.0;
constexpr double kPeriod = 0.25;  // s
constexpr int kUpdatesPerSegment = 25;

// A robot that drives circles among landmarks of which it sees the nearest ones, so that it closes
// a loop with each lap.
struct Drive {
  std::vector<Eigen::Vector2d> landmarks;
  std::vector<Pose2> poses;
  std::vector<MotionFactor> motions;
  std::vector<std::vector<SightingFactor>> sightings;  // of each motion's end
};

Drive drive(int laps, std::uint64_t seed, double slip_from = -1.0, double odometry_noise = 1.0) {
  constexpr int kPerLap = 200;
  Drive drive;
  for (int l = 0; l < 16; ++l) {
    const double angle = 2.0 * kPi * l / 16.0;
    const double radius = l % 2 == 0 ? 11.0 : 6.0;
    drive.landmarks.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  const RandomStream noise(seed, RandomPurpose::test, 0);
  std::uint64_t next = 0;
  const Pose2 step = {2.0 * 8.0 * std::sin(kPi / kPerLap), 0.0, 2.0 * kPi / kPerLap};
  Pose2 pose = {8.0, 0.0, 0.5 * kPi};
  drive.poses = {pose};
  for (int i = 0; i < laps * kPerLap; ++i) {
    pose = compose(pose, step);
    drive.poses.push_back(pose);
    const double time = (i + 1) * kPeriod;
    const bool slips = slip_from >= 0.0 && time > slip_from && time <= slip_from + 3.0;
    MotionFactor motion;
    const Eigen::Vector3d sigma = odometry_noise * Eigen::Vector3d(0.02, 0.01, 0.01);
    motion.mean = {
        step.x + sigma.x() * noise.normal(next) + (slips ? 0.8 * kPeriod : 0.0),
        step.y + sigma.y() * noise.normal(next + 1),
        step.heading + sigma.z() * noise.normal(next + 2) + (slips ? 0.4 * kPeriod : 0.0)};
    next += 3;
    motion.covariance = sigma.cwiseAbs2().asDiagonal();
    motion.sensitivity(2, SensorConstant::yaw_rate) = kPeriod;
    drive.motions.push_back(motion);
    drive.sightings.emplace_back();
    for (std::size_t l = 0; l < drive.landmarks.size(); ++l) {
      const Pose2 seen = relative(pose, {drive.landmarks[l].x(), drive.landmarks[l].y(), 0.0});
      const double range = std::hypot(seen.x, seen.y);
      if (range > 5.0) continue;
      SightingFactor sighting;
      sighting.landmark = static_cast<int>(l);
      sighting.range = range + 0.05 * noise.normal(next);
      sighting.bearing = std::atan2(seen.y, seen.x) + 0.02 * noise.normal(next + 1);
      next += 2;
      sighting.range_variance = 0.05 * 0.05;
      sighting.bearing_variance = 0.02 * 0.02;
      drive.sightings.back().push_back(sighting);
    }
  }
  return drive;
}

Memory remember(const Drive& drive) {
  Memory memory;
  memory.start(drive.poses.front(), SensorConstants::Zero());
  for (std::size_t i = 0; i < drive.motions.size(); ++i) {
    memory.append(drive.motions[i]);
    for (const SightingFactor& sighting : drive.sightings[i]) {
      memory.append_sighting(sighting.landmark, sighting);
    }
    if ((i + 1) % kUpdatesPerSegment != 0) continue;
    EXPECT_TRUE(memory.solve(kWidth)) << i;
  }
  return memory;
}

// The same data as one graph.
SmoothingGraph whole_graph(const Drive& drive) {
  SmoothingGraph graph;
  graph.prior = prior_at(drive.poses.front(), SensorConstants::Zero());
  graph.poses = drive.poses;
  graph.landmarks = drive.landmarks;
  graph.motions = drive.motions;
  for (std::size_t i = 0; i < drive.sightings.size(); ++i) {
    for (SightingFactor sighting : drive.sightings[i]) {
      sighting.pose = static_cast<int>(i) + 1;
      graph.sightings.push_back(sighting);
    }
  }
  return graph;
}

const Eigen::Vector2d& place_of(const Memory& memory, std::size_t landmark) {
  const int number = memory.number_of(static_cast<std::int64_t>(landmark));
  return memory.graph().landmarks.at(static_cast<std::size_t>(number));
}

double distance(const Pose2& a, const Pose2& b) {
  return std::hypot(a.x - b.x, a.y - b.y);
}

// That of least squares.
void expect_path(const SmoothingGraph& graph, double tolerance, const std::vector<Pose2>& path) {
  ASSERT_EQ(path.size() + 1, graph.poses.size());
  for (std::size_t i = 0; i < path.size(); ++i) {
    EXPECT_LT(distance(path[i], graph.poses[i + 1]), tolerance) << i;
  }
}

TEST(Memory, SolvesLikeLeastSquaresOfAllData) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Drive data = drive(2, seed);
    const Memory memory = remember(data);
    SmoothingGraph graph = whole_graph(data);
    ASSERT_TRUE(smooth(kWidth, &graph));
    const Eigen::MatrixXd covariance = joint_covariance(graph, kWidth);
    const Pose2& newest = memory.graph().newest();
    // The loss of whole segments moves it by a part of a standard deviation.
    EXPECT_NEAR(newest.x, graph.poses.back().x, 0.02);
    EXPECT_NEAR(newest.y, graph.poses.back().y, 0.02);
    EXPECT_NEAR(newest.heading, graph.poses.back().heading, 0.005);
    for (std::size_t l = 0; l < graph.landmarks.size(); ++l) {
      const Eigen::Index at = 2 * static_cast<Eigen::Index>(l);
      const double sigma = std::sqrt(covariance.block<2, 2>(at, at).trace());
      EXPECT_LT((place_of(memory, l) - graph.landmarks[l]).norm(), 0.3 * sigma) << l;
    }
    expect_path(graph, 0.05, memory.path());
  }
}

// Of a robot that stands, with that variance.
MotionFactor motion_of(double variance) {
  MotionFactor motion;
  motion.sensitivity(2, SensorConstant::yaw_rate) = kPeriod;
  motion.covariance = variance * Eigen::Matrix3d::Identity();
  return motion;
}

// A robot that stands and sees so many landmarks in turn, each as often as is said.
Memory stand(int landmarks, int times) {
  Memory memory;
  memory.start(Pose2{}, SensorConstants::Zero());
  for (int time = 0; time < times; ++time) {
    for (int l = 0; l < landmarks; ++l) {
      memory.append(motion_of(1e-4));
      memory.append_sighting(l, {0, 0, 5.0, 0.5 * l, 0.01, 0.001, Pose2{}});
    }
  }
  return memory;
}

SightingFactor sighting_of(int landmark, const Pose2& robot) {
  const Eigen::Vector2d seen = seen_from(robot, place_seen({}, 5.0, 0.5 * landmark));
  return {0, 0, seen.norm(), std::atan2(seen.y(), seen.x()), 0.01, 0.001, Pose2{}};
}

const SightingFactor kThere = sighting_of(5, {});
const Pose2 kCarried = {4.0, -3.0, 0.0};
const SightingFactor kElsewhere = {0, 0, 9.0, -2.0, 0.01, 0.001, Pose2{}};

std::size_t sightings_in(const Memory& memory) {
  std::size_t count = 0;
  for (const auto& segment : memory.graph().segments) count += segment->sightings.size();
  return count;
}

// One or two ids that are not where they were take no part, however often; several do.
TEST(Memory, LeavesOutWhatDoesNotFitUnlessMuchDoesNot) {
  for (const int ids : {1, 2, 3}) {
    Memory memory = stand(6, 10);
    ASSERT_TRUE(memory.solve(kWidth));
    for (int time = 0; time < 4; ++time) {
      memory.append(motion_of(1e-4));
      for (int id = 0; id < ids; ++id) {
        memory.append_doubtful_sighting(id, sighting_of(id, kCarried));
      }
      if (ids < 3) memory.append_sighting(5, kThere);
    }
    EXPECT_EQ(memory.belief_is_wrong(), ids == 3);
    ASSERT_TRUE(memory.solve(kWidth));
    EXPECT_EQ(sightings_in(memory), ids < 3 ? 64u : 72u) << ids;
  }
}

// What was in view and does not fit may be of another landmark that has its id, or the robot is
// elsewhere: what it sees next tells.
TEST(Memory, WaitsForTheNextLandmarkWhereWhatIsInViewDoesNotFit) {
  const MotionFactor still = motion_of(1e-4);
  for (const bool is_carried : {true, false}) {
    Memory memory = stand(6, 10);
    ASSERT_TRUE(memory.solve(kWidth));
    for (int time = 0; time < 3; ++time) {
      EXPECT_FALSE(memory.belief_is_wrong());
      memory.append(still);
      memory.append_doubtful_sighting(5, sighting_of(5, kCarried));
    }
    EXPECT_TRUE(memory.belief_is_wrong());
    EXPECT_TRUE(memory.distrusts_odometry());
    EXPECT_FALSE(memory.solve(kWidth));
    for (int time = 0; time < 3; ++time) {
      memory.append(still);
      if (is_carried) {
        memory.append_doubtful_sighting(4, sighting_of(4, kCarried));
      } else {
        memory.append_sighting(4, sighting_of(4, {}));
      }
    }
    EXPECT_EQ(memory.belief_is_wrong(), is_carried);
    ASSERT_TRUE(memory.solve(kWidth));
    EXPECT_FALSE(memory.belief_is_wrong());
    EXPECT_EQ(memory.state().landmarks[5].doubted, is_carried ? 0 : 3);
    EXPECT_EQ(sightings_in(memory), is_carried ? 66u : 63u);
    for (int time = 0; time < 16; ++time) memory.append(still);
    EXPECT_FALSE(memory.distrusts_odometry());
  }
}

// The robot comes back, uncertain where it is, and takes a landmark for another that has its id:
// then what it sees next does not fit.
TEST(Memory, LeavesOutALandmarkWhoseIdHasMisledTheBelief) {
  Memory memory = stand(6, 10);
  ASSERT_TRUE(memory.solve(kWidth));
  for (int time = 0; time < 4; ++time) {
    memory.append(motion_of(time == 0 ? 100.0 : 1e-4));
    memory.append_sighting(5, sighting_of(5, kCarried));
  }
  ASSERT_TRUE(memory.solve(kWidth));
  EXPECT_NEAR(distance(memory.graph().newest(), {}), 5.0, 0.3);
  for (int time = 0; time < 3; ++time) {
    memory.append(motion_of(1e-4));
    for (const int id : {1, 2}) memory.append_doubtful_sighting(id, sighting_of(id, {}));
  }
  ASSERT_TRUE(memory.belief_is_wrong());
  ASSERT_TRUE(memory.solve(kWidth));
  EXPECT_LT(distance(memory.graph().newest(), {}), 0.1);
  EXPECT_LE(sightings_in(memory), 66u);
}

// Two tags in one scan have the same id: what does not fit says nothing of the robot.
TEST(Memory, IsNotWrongWhereScansHaveSeenAnIdTwice) {
  for (const bool are_seen_together : {false, true}) {
    Memory memory = stand(6, 10);
    for (int time = 0; time < 6; ++time) {
      memory.append(motion_of(1e-4));
      if (time < 3) memory.append_sighting(5, kThere);
      if (time < 3 && are_seen_together) memory.note_twice(5);
      memory.append_doubtful_sighting(5, sighting_of(5, kCarried));
    }
    EXPECT_EQ(memory.belief_is_wrong(), !are_seen_together);
  }
}

// A camera that passes a tag sees it a few times at best: where two in a row are elsewhere, however
// rarely they were seen, it is the robot that is.
TEST(Memory, DoubtsTheBeliefWhereLandmarksHardlySeenDoNotFit) {
  const MotionFactor still = motion_of(1e-4);
  Memory memory = stand(6, 1);
  for (const std::int64_t id : {0, 0, 1}) {
    EXPECT_FALSE(memory.belief_is_wrong());
    memory.append(still);
    memory.append_doubtful_sighting(id, kElsewhere);
  }
  EXPECT_TRUE(memory.belief_is_wrong());
}

// What was seen twice, and then elsewhere again and again, is elsewhere.
TEST(Memory, PutsALandmarkElsewhereThatWasMisreadAtFirst) {
  Memory memory = stand(6, 2);
  ASSERT_TRUE(memory.solve(kWidth));
  const int before = memory.number_of(3);
  const MotionFactor still = motion_of(1e-4);
  for (int time = 0; time < 20; ++time) {
    memory.append(still);
    memory.append_sighting(1, {0, 0, 5.0, 0.5, 0.01, 0.001, Pose2{}});
    memory.append_doubtful_sighting(3, kElsewhere);
  }
  ASSERT_TRUE(memory.solve(kWidth));
  const int number = memory.number_of(3);
  EXPECT_NE(number, before);
  const Eigen::Vector2d& place = memory.graph().landmarks[static_cast<std::size_t>(number)];
  EXPECT_NEAR(place.x(), 9.0 * std::cos(-2.0), 0.3);
  EXPECT_NEAR(place.y(), 9.0 * std::sin(-2.0), 0.3);
  EXPECT_EQ(memory.state().landmarks[static_cast<std::size_t>(before)].id, -1);
}

// A landmark that was misread at first and seen at once where it is says nothing about the robot.
TEST(Memory, IsNotWrongWhereAnIdWasMisreadAtFirst) {
  Memory memory = stand(6, 5);
  const MotionFactor still = motion_of(1e-4);
  memory.append(still);
  memory.append_sighting(7, kThere);
  for (int time = 0; time < 10; ++time) {
    memory.append(still);
    memory.append_doubtful_sighting(7, kElsewhere);
    EXPECT_FALSE(memory.belief_is_wrong()) << time;
  }
}

// 4000 draws: a variance is off by more than 15 % with a chance of 1e-10.
TEST(Memory, DrawsHaveTheCovarianceOfLeastSquares) {
  const Drive data = drive(1, 4);
  const Memory memory = remember(data);
  SmoothingGraph graph = whole_graph(data);
  ASSERT_TRUE(smooth(kWidth, &graph));
  const Eigen::MatrixXd covariance = joint_covariance(graph, kWidth);
  const MemoryDraw draw = memory.draw(4000, RandomStream(1, RandomPurpose::redraw, 0));
  const Eigen::MatrixXd& deviations = draw.deviations;
  const auto variance = [&](Eigen::Index column) {
    return deviations.col(column).squaredNorm() / static_cast<double>(deviations.rows());
  };
  for (std::size_t l = 0; l < graph.landmarks.size(); ++l) {
    const std::size_t number =
        static_cast<std::size_t>(memory.number_of(static_cast<std::int64_t>(l)));
    for (const int k : {0, 1}) {
      const Eigen::Index column = 2 * static_cast<Eigen::Index>(number) + k;
      const Eigen::Index of_whole = 2 * static_cast<Eigen::Index>(l) + k;
      const double expected = covariance(of_whole, of_whole);
      EXPECT_NEAR(variance(column) + draw.landmarks_given_path[number](k, k), expected,
                  0.2 * expected)
          << l;
    }
  }
  for (const int k : {1, 2, 3}) {
    const double expected = covariance.diagonal().tail(4)[k];
    EXPECT_NEAR(variance(deviations.cols() - 4 + k), expected, 0.2 * expected);
  }
}

// The less noise the odometry has, the more it costs to doubt it: not the landmarks are to be
// blamed.
TEST(Memory, NamesASlipAndIsNotBentByIt) {
  for (const double odometry_noise : {1.0, 0.1}) {
    for (const std::uint64_t seed : {5u, 6u, 7u}) {
      const Drive data = drive(2, seed, 40.0, odometry_noise);
      const Memory memory = remember(data);
      for (std::size_t l = 0; l < data.landmarks.size(); ++l) {
        EXPECT_LT((place_of(memory, l) - data.landmarks[l]).norm(), 0.4) << l;
      }
      const std::vector<Slip> slips = memory.slips();
      ASSERT_EQ(slips.size(), 1u);
      EXPECT_NEAR(slips[0].begin, 40.0, 1.5);
      EXPECT_NEAR(slips[0].end, 43.0, 1.5);
      EXPECT_TRUE(remember(drive(2, seed, -1.0, odometry_noise)).slips().empty());
    }
  }
}

// 25 minutes, 30 laps: what is old has lost its data, but little of what they said.
TEST(Memory, StaysBoundedOverALongDrive) {
  const Drive data = drive(30, 1);
  const Memory memory = remember(data);
  EXPECT_LT(memory.graph().segments.size(), 100u);
  SmoothingGraph graph = whole_graph(data);
  ASSERT_TRUE(smooth(kWidth, &graph));
  for (std::size_t l = 0; l < graph.landmarks.size(); ++l) {
    EXPECT_LT((place_of(memory, l) - graph.landmarks[l]).norm(), 0.02) << l;
  }
  expect_path(graph, 0.1, memory.path());
}

TEST(Memory, StillKnowsASlipOfLongAgo) {
  const Memory memory = remember(drive(30, 1, 100.0));
  EXPECT_LT(memory.graph().segments.size(), 100u);
  ASSERT_EQ(memory.slips().size(), 1u);
  EXPECT_NEAR(memory.slips().front().begin, 100.0, 1.0);
}

// Segments in which wheels slipped are joined, too: each of them alone is loose, and would have to
// be condensed in every redraw.
TEST(Memory, JoinsWhereWheelsSlippedLongAgo) {
  const auto remember_slip = [](double slips_at) {
    Drive data = drive(4, 5, slips_at, 0.1);
    for (std::size_t i = 0; i < data.motions.size(); ++i) {
      const double time = kPeriod * static_cast<double>(i + 1);
      if (std::abs(time - slips_at - 1.5) > 3.0) continue;
      data.motions[i].slip_covariance = slip_covariance(2.0, kPeriod);
    }
    return remember(data);
  };
  const Memory slipped = remember_slip(40.0);
  EXPECT_LE(slipped.graph().segments.size(), remember_slip(-10.0).graph().segments.size());
  ASSERT_EQ(slipped.slips().size(), 1u);
  EXPECT_NEAR(slipped.slips()[0].begin, 40.0, 1.5);
}

// Distrusted odometry and hardly a sighting: what is solved for is far from the odometry by chance.
TEST(Memory, NamesNoSlipWhereTheSolutionIsLoose) {
  for (const std::uint64_t seed : {5u, 6u, 7u}) {
    Drive data = drive(2, seed);
    for (std::size_t i = 0; i < data.motions.size(); ++i) {
      const double time = kPeriod * static_cast<double>(i + 1);
      if (time < 40.0 || time > 46.0) continue;
      data.motions[i].slip_covariance = slip_covariance(2.0, kPeriod);
      if (data.sightings[i].size() > 1) data.sightings[i].resize(1);
    }
    EXPECT_TRUE(remember(data).slips().empty()) << seed;
  }
}

TEST(Memory, GoesOnFromABelief) {
  StartingBelief belief;
  belief.pose = {1.0, 2.0, 0.3};
  belief.landmarks = {{5.0, 2.0}, {1.0, 6.0}};
  belief.landmark_ids = {7, 9};
  const Eigen::Index size = 3 + 4 + kSensorConstants;
  belief.covariance = 0.01 * Eigen::MatrixXd::Identity(size, size);
  Memory memory;
  ASSERT_TRUE(memory.start(belief));
  ASSERT_TRUE(memory.solve(kWidth));
  EXPECT_NEAR(memory.graph().newest().x, 1.0, 1e-9);
  EXPECT_LT((memory.graph().landmarks[1] - belief.landmarks[1]).norm(), 1e-9);
  belief.covariance(0, 0) = -1.0;
  EXPECT_FALSE(memory.start(belief));
  EXPECT_EQ(memory.number_of(9), 1) << "nothing changes";
}

// A drive whose odometry counts distances and turns wrong by these factors.
Drive scaled(double distance, double turn) {
  Drive data = drive(2, 5);
  for (MotionFactor& motion : data.motions) {
    Pose2& mean = motion.mean;
    const double half = 0.5 * (turn - 1.0) * mean.heading;
    mean = {distance * (std::cos(half) * mean.x - std::sin(half) * mean.y),
            distance * (std::sin(half) * mean.x + std::cos(half) * mean.y), turn * mean.heading};
    const Eigen::Vector3d factors(distance, distance, turn);
    motion.covariance = factors.asDiagonal() * motion.covariance * factors.asDiagonal();
    motion.sensitivity.col(SensorConstant::distance_scale) << mean.x, mean.y, 0.0;
    motion.sensitivity.col(SensorConstant::turn_scale) << -0.5 * mean.heading * mean.y,
        0.5 * mean.heading * mean.x, mean.heading;
  }
  return data;
}

TEST(Memory, OdometryOfAnyScaleIsRecognizedWithinSeconds) {
  const std::vector<std::pair<double, double>> factors = {
      {1.0, 1.0}, {1.2, 0.8}, {1.0, -1.0}, {3.0, 1.0}, {0.25, 1.0}, {1.0, 0.4}, {2.0, -1.5}};
  for (const auto& [along, turn] : factors) {
    const Drive data = scaled(along, turn);
    SensorConstants sigma = SensorConstants::Zero();
    sigma[SensorConstant::distance_scale] = 0.05;
    sigma[SensorConstant::turn_scale] = 0.1;
    Memory memory;
    memory.start(data.poses.front(), sigma);
    for (std::size_t i = 0; i < data.motions.size(); ++i) {
      memory.append(data.motions[i]);
      for (const SightingFactor& sighting : data.sightings[i]) {
        memory.append_sighting(sighting.landmark, sighting);
      }
      memory.check_odometry_scales();
      if (memory.needs_solution() || (i + 1) % kUpdatesPerSegment == 0) {
        EXPECT_TRUE(memory.solve(kWidth)) << i;
      }
    }
    const SegmentGraph& graph = memory.graph();
    EXPECT_NEAR(1.0 + graph.constants[SensorConstant::distance_scale], 1.0 / along, 0.03 / along);
    EXPECT_NEAR(1.0 + graph.constants[SensorConstant::turn_scale], 1.0 / turn,
                0.03 / std::abs(turn));
    EXPECT_LT(distance(graph.newest(), data.poses.back()), 0.1) << along << ", " << turn;
    EXPECT_TRUE(memory.slips().empty()) << along << ", " << turn;
    const bool is_gross = std::abs(1.0 / along - 1.0) > 0.4 || std::abs(1.0 / turn - 1.0) > 0.4;
    EXPECT_EQ(graph.constants_mean.norm() > 0.0, is_gross) << along << ", " << turn;
  }
}

// Remembers a drive in which some landmarks have the ids of others; what is seen more than 1 m from
// where the belief has its landmark does not fit.
Memory remember_doubting(const Drive& drive, const std::map<int, int>& ids) {
  Memory memory;
  memory.start(drive.poses.front(), SensorConstants::Zero());
  Pose2 believed = drive.poses.front();
  std::map<int, Eigen::Vector2d> places;  // as first seen, until the memory has them
  for (std::size_t i = 0; i < drive.motions.size(); ++i) {
    memory.append(drive.motions[i]);
    believed = compose(believed, drive.motions[i].mean);
    for (const SightingFactor& sighting : drive.sightings[i]) {
      const auto other = ids.find(sighting.landmark);
      const int id = other == ids.end() ? sighting.landmark : other->second;
      const int number = memory.number_of(id);
      const Eigen::Vector2d seen = place_seen(believed, sighting.range, sighting.bearing);
      const std::size_t landmarks = memory.state().landmarks.size();
      const Eigen::Vector2d place =
          number < 0 ? places.try_emplace(id, seen).first->second
                     : memory.graph().landmarks[static_cast<std::size_t>(number)];
      const bool fits = (place - seen).norm() < 1.0;
      fits ? memory.append_sighting(id, sighting) : memory.append_doubtful_sighting(id, sighting);
      if (memory.state().landmarks.size() > landmarks) places[id] = seen;
    }
    if (!memory.needs_solution() && (i + 1) % kUpdatesPerSegment != 0) continue;
    if (memory.solve(kWidth)) {
      believed = memory.graph().newest();
    } else {
      memory.note_refusal();
    }
  }
  return memory;
}

TEST(Memory, SeveralWrongIdsAreNoSlip) {
  const Drive data = drive(2, 7);
  const Memory memory = remember_doubting(data, {{12, 1}, {13, 2}, {14, 5}});
  EXPECT_TRUE(memory.slips().empty());
  EXPECT_LT(distance(memory.graph().newest(), data.poses.back()), 0.1);
}

// Wheels slip while nothing is seen: of what fits when that is over, the slip has more evidence
// than a bent lap.
TEST(Memory, FindsASlipOfSecondsAgo) {
  for (const std::uint64_t seed : {5u, 6u}) {
    for (const double seen_again : {110.0, 125.0}) {
      Drive data = drive(4, seed, 104.0, 0.1);
      for (std::size_t i = 0; i < data.sightings.size(); ++i) {
        const double time = kPeriod * static_cast<double>(i + 1);
        if (time > 103.0 && time < seen_again) data.sightings[i].clear();
      }
      const Memory memory = remember_doubting(data, {});
      EXPECT_LT(distance(memory.graph().newest(), data.poses.back()), 0.1) << seed;
      ASSERT_EQ(memory.slips().size(), 1u) << seed;
      EXPECT_NEAR(memory.slips()[0].begin, 104.0, 2.0);
      EXPECT_NEAR(memory.slips()[0].end, 107.0, 5.0);  // nothing tells when
    }
  }
}

// Wheels are locked while the robot slides on: they say that it stands.
TEST(Memory, FindsASlipOfLockedWheels) {
  for (const std::uint64_t seed : {5u, 6u, 7u}) {
    Drive data = drive(4, seed, -1.0, 0.1);
    for (std::size_t i = 0; i < data.motions.size(); ++i) {
      const double time = kPeriod * static_cast<double>(i + 1);
      if (time > 104.0 && time <= 107.0) data.motions[i].mean = Pose2{};
      if (time > 103.0 && time < 110.0) data.sightings[i].clear();
    }
    const Memory memory = remember_doubting(data, {});
    EXPECT_LT(distance(memory.graph().newest(), data.poses.back()), 0.1) << seed;
    for (std::size_t l = 0; l < data.landmarks.size(); ++l) {
      EXPECT_LT((place_of(memory, l) - data.landmarks[l]).norm(), 0.2) << seed << ", " << l;
    }
    ASSERT_EQ(memory.slips().size(), 1u) << seed;
    EXPECT_NEAR(memory.slips()[0].begin, 104.0, 2.0);
  }
}

// A landmark is first seen while wheels slip, alone, and is elsewhere again and again. What closes
// the lap half a minute later does not tell when they slipped; that does.
TEST(Memory, FindsASlipWhereWhatWasJustSeenWasElsewhere) {
  for (const std::uint64_t seed : {5u, 6u, 7u}) {
    Drive data = drive(2, seed, 20.0, 0.1);
    data.motions.resize(220);
    for (std::size_t i = 0; i < data.motions.size(); ++i) {
      const double time = kPeriod * static_cast<double>(i + 1);
      const auto is_hidden = [&](const SightingFactor& sighting) {
        if (time < 20.1) return sighting.landmark >= 8;
        if (time < 23.6) return sighting.landmark != 8;
        return time < 42.0 ? sighting.landmark <= 8 : time < 52.0;
      };
      auto& seen = data.sightings[i];
      seen.erase(std::remove_if(seen.begin(), seen.end(), is_hidden), seen.end());
    }
    const Memory memory = remember_doubting(data, {});
    for (std::size_t l = 0; l < data.landmarks.size(); ++l) {
      EXPECT_LT((place_of(memory, l) - data.landmarks[l]).norm(), 0.5) << seed << ", " << l;
    }
  }
}

}  // namespace
}  // namespace pf_resampling
