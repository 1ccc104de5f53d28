#include "pf_resampling_core/filters/fastslam/memory/reassociation.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "pf_resampling_core/filters/fastslam/memory/segment_solver.hpp"
#include "pf_resampling_core/test/filters/fastslam/memory/segmented_drive.hpp"
#include "pf_resampling_core/test/smoothing/ring_drive.hpp"

namespace pf_resampling {
namespace {

constexpr double kWidth = 4.0;
// The ring's landmarks: 15 on some 400 m^2, seen from 4 m; a twentieth of what is seen is new.
const ReassociationOptions kReassociation{kWidth, std::log(0.05 * 4.0 * 15.0 / 400.0),
                                          std::log(4.0 * 15.0 / 400.0), 1000};
// Of the ring's sightings, from 4 m.
const SightingStatistics kStatistics{4.0, 0.5 * (25e-4 + 16.0 * 4e-4), 1.0};

Memory ring(int poses, std::uint64_t seed) {
  return remembered(RingDrive(poses, 15, seed, SensorConstants::Zero()).graph, kWidth);
}

Scans scans_of(const Memory& memory) {
  return newest_scans(memory.graph(), memory.state().begins, 1000000);
}

std::vector<int> landmarks_of(const Scans& scans) {
  std::vector<int> numbers;
  for (const SightingFactor& sighting : scans.sightings) numbers.push_back(sighting.landmark);
  return numbers;
}

// Landmarks are 3 m apart, and a sighting errs by 5 cm and 0.02 rad.
TEST(Reassociation, FindsTheLandmarkOfEachSighting) {
  const Memory memory = ring(120, 1);
  Scans scans = scans_of(memory);
  for (std::size_t s = 0; s < scans.sightings.size(); ++s) {
    int& landmark = scans.sightings[s].landmark;
    if (s % 7 == 0) landmark = (landmark + 3) % 15;
    if (s % 5 == 3) landmark = -1;  // some are of nothing as yet
  }
  EXPECT_EQ(reassociate(kReassociation, memory.graph(), &scans), 0);
  EXPECT_EQ(landmarks_of(scans), scans.before);
}

TEST(Reassociation, LeavesWhatIsOfNoLandmarkAndTakesNoneTwice) {
  const Memory memory = ring(60, 2);
  for (const double beside : {1.5, 0.02}) {  // 30 standard deviations, and less than one
    Scans scans = scans_of(memory);
    SightingFactor another = scans.sightings[10];
    another.range += beside;
    scans.sightings.insert(scans.sightings.begin() + 11, another);
    scans.before.insert(scans.before.begin() + 11, -1);
    reassociate(kReassociation, memory.graph(), &scans);
    EXPECT_EQ(std::count(scans.before.begin(), scans.before.end(), -1), 1);
    const std::vector<int> found = landmarks_of(scans);
    EXPECT_EQ(std::count(found.begin(), found.end(), -1), 1);
    std::set<std::pair<int, int>> seen;
    for (const SightingFactor& sighting : scans.sightings) {
      if (sighting.landmark < 0) continue;
      EXPECT_TRUE(seen.emplace(sighting.pose, sighting.landmark).second);
    }
  }
}

// From pose 60 on every sighting has the wrong landmark. What is tracked from there is pure, though
// odometry alone says where the robot is, and what was before stays as it was.
TEST(Reassociation, TracksAnewWhatWasTakenForOtherLandmarks) {
  constexpr int kFrom = 60;
  const Memory memory = ring(120, 5);
  SegmentGraph graph = memory.graph();
  const int known = static_cast<int>(graph.landmarks.size());
  const Scans right = scans_of(memory);
  Scans scans = right;
  for (SightingFactor& sighting : scans.sightings) {
    if (sighting.pose >= kFrom) sighting.landmark = (sighting.landmark + 1) % known;
  }
  scans.poses.back().x += 10.0;
  Scans too_many = scans;
  ASSERT_TRUE(track_anew(kReassociation, kFrom, &scans, &graph));
  EXPECT_NEAR(scans.poses.back().x, right.poses.back().x, 1.0);
  std::map<int, int> truth_of;
  int tracked = 0;
  for (std::size_t s = 0; s < scans.sightings.size(); ++s) {
    const SightingFactor& sighting = scans.sightings[s];
    if (sighting.pose < kFrom) {
      EXPECT_EQ(sighting.landmark, scans.before[s]);
      continue;
    }
    ++tracked;
    EXPECT_GE(sighting.landmark, known);
    const int truth = right.sightings[s].landmark;
    EXPECT_EQ(truth_of.emplace(sighting.landmark, truth).first->second, truth) << s;
  }
  EXPECT_GT(tracked, 50);
  ReassociationOptions few = kReassociation;
  few.most_landmarks = graph.landmarks.size() - 1;
  SegmentGraph full = memory.graph();
  EXPECT_FALSE(track_anew(few, kFrom, &too_many, &full));
}

// What is put back is solved for like any other drive: with the landmarks of before, it is that.
TEST(Reassociation, WhatIsPutBackIsTheSameDrive) {
  const Memory memory = ring(120, 6);
  SegmentGraph graph = memory.graph();
  Scans scans = scans_of(memory);
  const std::vector<int> right = landmarks_of(scans);
  for (SightingFactor& sighting : scans.sightings) sighting.landmark = -1;
  ASSERT_TRUE(put_back(scans, kWidth, &graph));
  const std::vector<bool> seen = seen_landmarks(graph);
  EXPECT_EQ(std::count(seen.begin(), seen.end(), true), 0);
  EXPECT_EQ(graph.segments[1]->unassigned.size(), memory.graph().segments[1]->sightings.size());
  Scans back = newest_scans(graph, memory.state().begins, 1000);
  ASSERT_EQ(back.sightings.size(), right.size());
  for (std::size_t s = 0; s < right.size(); ++s) back.sightings[s].landmark = right[s];
  ASSERT_TRUE(put_back(back, kWidth, &graph));
  const SegmentSolution solution = solve(kWidth, &graph);
  ASSERT_TRUE(solution.is_solved);
  EXPECT_LT(std::hypot(graph.newest().x - memory.graph().newest().x,
                       graph.newest().y - memory.graph().newest().y),
            1e-2);
}

// A robot that stands, and what it sees, with landmarks where they are seen.
SegmentGraph standing(int updates, const std::vector<Eigen::Vector2d>& landmarks,
                      const std::vector<SightingFactor>& sightings) {
  Segment segment;
  segment.motions.resize(static_cast<std::size_t>(updates));
  segment.poses.resize(static_cast<std::size_t>(updates));
  for (const SightingFactor& sighting : sightings) {
    add_sighting(sighting.landmark, sighting, &segment);
  }
  for (const int landmark : segment.landmarks) {
    segment.tracks.push_back(landmarks[static_cast<std::size_t>(landmark)]);
  }
  SegmentGraph graph;
  EXPECT_TRUE(condense(0.0, &segment));
  graph.segments = {std::make_shared<const Segment>(std::move(segment))};
  graph.bases.resize(2);
  graph.motion_shares = {1.0};
  graph.landmarks = landmarks;
  return graph;
}

// Of two that are two standard deviations apart neither is sure, at four both are: odds of exp(2)
// and exp(8).
TEST(Reassociation, CountsSightingsThatMayAsWellBeOfANeighbour) {
  const auto share = [](double apart) {
    std::vector<SightingFactor> sightings;
    for (int pose = 0; pose < 8; ++pose) {
      sightings.push_back({pose, 0, 4.0, 0.0, 25e-4, 4e-4, {}});
      sightings.push_back({pose, 2, 3.0, -kPi, 25e-4, 4e-4, {}});
    }
    sightings.push_back({7, 1, 4.0 + apart, 0.0, 25e-4, 4e-4, {}});
    const SegmentGraph graph =
        standing(8, {{4.0, 0.0}, {4.0 + apart, 0.0}, {-3.0, 0.0}}, sightings);
    return ambiguous_share(kReassociation, graph, newest_scans(graph, {0.0}, 8));
  };
  EXPECT_NEAR(share(0.1), 9.0 / 17.0, 1e-9);
  EXPECT_EQ(share(0.2), 0.0);
}

// From the origin two landmarks are seen 0.1 m apart, two standard deviations, in three scans each;
// in one both; and one that stands alone. Without the second, three sightings are of the first, at
// ½·2² more each, and one is of nothing.
TEST(Reassociation, FindsWhatCanBeDoneWithout) {
  std::vector<SightingFactor> sightings;
  for (int pose = 0; pose < 8; ++pose) {
    if (pose < 4) sightings.push_back({pose, 0, 4.0, 0.0, 25e-4, 4e-4, {}});
    if (pose > 2) sightings.push_back({pose, 1, 4.1, 0.0, 25e-4, 4e-4, {}});
    sightings.push_back({pose, 2, 3.0, -kPi, 25e-4, 4e-4, {}});
  }
  const std::vector<Eigen::Vector2d> landmarks = {{4.0, 0.0}, {4.1, 0.0}, {-3.0, 0.0}};
  const SegmentGraph graph = standing(8, landmarks, sightings);
  ReassociationOptions options = kReassociation;
  options.robust_width = 0.0;
  const double of_nothing = -options.log_density_of_new - std::log(2.0 * kPi * 0.05 * 0.02);
  const auto dispensable = [&](double redundancy, const SegmentGraph& of, double most) {
    return find_dispensable(options, redundancy, of, newest_scans(of, {0.0}, 8), most);
  };
  const std::vector<Dispensable> found = dispensable(1.0, graph, 50.0);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].landmark, 0);
  EXPECT_EQ(found[0].other, 1);
  EXPECT_NEAR(found[0].cost, 3.0 * 2.0 + of_nothing, 1e-6);
  EXPECT_EQ(found[1].landmark, 1);
  EXPECT_EQ(found[1].other, 0);
  EXPECT_NEAR(found[1].cost, 4.0 * 2.0 + of_nothing, 1e-6);
  EXPECT_EQ(dispensable(1.0, graph, found[0].cost + 1.0).size(), 1u);
  // Three sightings that say as much as one.
  EXPECT_NEAR(dispensable(3.0, graph, 50.0)[0].cost, 2.0 + of_nothing, 1e-6);
  // Nothing has shown yet that they are two: find_duplicates() decides.
  sightings.erase(
      std::remove_if(sightings.begin(), sightings.end(),
                     [](const SightingFactor& s) { return s.pose == 3 && s.landmark == 1; }),
      sightings.end());
  EXPECT_TRUE(dispensable(1.0, standing(8, landmarks, sightings), 50.0).empty());
}

double evidence_of(const SightingStatistics& statistics, SegmentGraph graph) {
  ReassociationOptions options = kReassociation;
  options.robust_width = 0.0;
  const SegmentSolution solution = solve(0.0, &graph);
  EXPECT_TRUE(solution.is_solved);
  return association_evidence(options, statistics, solution.cost, solution.log_determinant, graph);
}

// Two sightings from a place that is known, of one landmark or of two. With ρ the density of
// landmarks per m and rad, one explains them by ρ·N(difference; 0, 2R), two by ρ².
TEST(Reassociation, WeighsOneLandmarkAgainstTwoByTheirEvidence) {
  for (const double difference : {0.0, 0.1, 0.3}) {
    std::vector<SightingFactor> sightings = {{0, 0, 4.0 - 0.5 * difference, 0.0, 25e-4, 4e-4, {}},
                                             {0, 0, 4.0 + 0.5 * difference, 0.0, 25e-4, 4e-4, {}}};
    const SegmentGraph one = standing(1, {{4.0, 0.0}}, sightings);
    sightings[1].landmark = 1;
    const SegmentGraph two =
        standing(1, {{sightings[0].range, 0.0}, {sightings[1].range, 0.0}}, sightings);
    const double log_likelihood = -std::log(2.0 * kPi * 2.0 * std::sqrt(25e-4 * 4e-4)) -
                                  0.5 * difference * difference / (2.0 * 25e-4);
    EXPECT_NEAR(evidence_of(kStatistics, one) - evidence_of(kStatistics, two),
                kReassociation.log_density_of_landmarks - log_likelihood, 5e-3)
        << difference;
  }
}

// The same where each sighting is repeated with the same error, and as many say as much as one: the
// copies do not make the fit any worse. That a landmark is known better, each time, speaks against
// there being another: by the logarithm of the copies, half of it for each of its two unknowns.
TEST(Reassociation, SightingsWithTheSameErrorAreWorthOne) {
  std::vector<double> differences;
  for (const int copies : {1, 12}) {
    std::vector<SightingFactor> of_one, of_two;
    for (int copy = 0; copy < copies; ++copy) {
      for (const int landmark : {0, 1}) {
        SightingFactor sighting{0, 0, 3.9 + 0.2 * landmark, 0.0, 25e-4, 4e-4, {}};
        of_one.push_back(sighting);
        sighting.landmark = landmark;
        of_two.push_back(sighting);
      }
    }
    SightingStatistics statistics = kStatistics;
    statistics.redundancy = copies;
    differences.push_back(evidence_of(statistics, standing(1, {{4.0, 0.0}}, of_one)) -
                          evidence_of(statistics, standing(1, {{3.9, 0.0}, {4.1, 0.0}}, of_two)));
  }
  EXPECT_NEAR(differences[1], differences[0] - std::log(12.0), 5e-3);
}

// Of seven sightings three passages: landmark 0 is out of view for 11 s, landmark 1 for 10 s.
TEST(Reassociation, CountsSightingsPerPassage) {
  EXPECT_EQ(statistics_of(SegmentGraph(), {}).redundancy, 1.0);
  Segment segment;
  double before = 0.0;
  for (const double time : {0.0, 1.0, 2.0, 11.0, 12.0}) {
    segment.motions.emplace_back();
    segment.motions.back().sensitivity(2, SensorConstant::yaw_rate) = time - before;
    before = time;
  }
  for (const auto& [pose, landmark] :
       std::vector<std::pair<int, int>>{{0, 0}, {0, 1}, {1, 0}, {1, 1}, {3, 1}, {4, 0}, {4, 1}}) {
    add_sighting(landmark, {pose, landmark, 4.0, 0.0, 25e-4, 4e-4, {}}, &segment);
  }
  SegmentGraph graph;
  graph.landmarks.resize(2);
  graph.segments = {std::make_shared<const Segment>(segment)};
  const SightingStatistics statistics = statistics_of(graph, {0.0});
  EXPECT_DOUBLE_EQ(statistics.redundancy, 7.0 / 3.0);
  EXPECT_DOUBLE_EQ(statistics.range, 4.0);
  EXPECT_DOUBLE_EQ(statistics.variance, 0.5 * (25e-4 + 16.0 * 4e-4));
}

// A belief about landmarks, of which those of `beside` were seen in one scan.
struct Row {
  SegmentGraph graph;

  Row(const std::vector<Eigen::Vector2d>& landmarks, const Eigen::MatrixXd& covariance,
      const std::vector<std::array<int, 2>>& beside) {
    StartingBelief belief;
    belief.landmarks = landmarks;
    for (std::size_t l = 0; l < landmarks.size(); ++l) {
      belief.landmark_ids.push_back(static_cast<std::int64_t>(l));
    }
    const Eigen::Index count = covariance.rows();
    belief.covariance = 1e-6 * Eigen::MatrixXd::Identity(3 + count + kSensorConstants,
                                                         3 + count + kSensorConstants);
    belief.covariance.block(3, 3, count, count) = covariance;
    Memory memory;
    EXPECT_TRUE(memory.start(belief));
    graph = memory.graph();
    Segment segment = *graph.segments[0];
    segment.beside = beside;
    graph.segments[0] = std::make_shared<const Segment>(segment);
  }
  Duplicates found(const std::vector<int>& in_question) const {
    SegmentEquations equations(graph);
    equations.linearize(graph);
    EXPECT_TRUE(equations.factorize(0.0));
    return find_duplicates(kReassociation, kStatistics, graph, equations, in_question);
  }
};

// Σ = 1 cm² each, independent: S = 2 cm², and with the landmarks' density 15/400 per m², the
// logarithm of the odds is log N(d; 0, S) - log(15/400).
TEST(Reassociation, JoinsByTheOddsOfOneLandmarkAgainstTwo) {
  const Eigen::MatrixXd covariance = 1e-4 * Eigen::MatrixXd::Identity(4, 4);
  const Duplicates found = Row({{4.0, 0.0}, {4.0, 0.02}}, covariance, {}).found({1});
  ASSERT_EQ(found.pairs.size(), 1u);
  const double prior = -std::log(2.0 * kPi * 2e-4) - std::log(15.0 / 400.0);
  EXPECT_NEAR(found.log_prior_odds, prior, 1e-6);
  EXPECT_NEAR(found.log_odds, prior - 0.5 * 4e-4 / 2e-4, 1e-6);
  // Four standard deviations apart; too uncertain to be sure; seen side by side; not asked.
  EXPECT_TRUE(Row({{4.0, 0.0}, {4.0, 0.06}}, covariance, {}).found({1}).pairs.empty());
  EXPECT_TRUE(Row({{4.0, 0.0}, {4.0, 0.02}}, 1e4 * covariance, {}).found({1}).pairs.empty());
  EXPECT_TRUE(Row({{4.0, 0.0}, {4.0, 0.02}}, covariance, {{0, 1}}).found({1}).pairs.empty());
  // Nor if each may be a third, which is far away.
  const Eigen::MatrixXd of_three = 1e-4 * Eigen::MatrixXd::Identity(6, 6);
  const Row three({{4.0, 0.0}, {4.0, 0.02}, {7.0, 0.0}}, of_three, {{0, 1}});
  EXPECT_TRUE(three.found({0, 1}).pairs.empty());
  EXPECT_TRUE(Row({{4.0, 0.0}, {4.0, 0.02}}, covariance, {}).found({}).pairs.empty());
}

// Two are one for sure; that two others are is twice as likely as not (S = 0.6 m², and as above),
// for which the first say nothing.
TEST(Reassociation, JoinsNothingOnTheStrengthOfOthers) {
  Eigen::MatrixXd covariance = 1e-4 * Eigen::MatrixXd::Identity(8, 8);
  covariance.bottomRightCorner<4, 4>() = 0.3 * Eigen::Matrix4d::Identity();
  const Row row({{4.0, 0.0}, {4.0, 0.01}, {7.0, 0.0}, {7.0, 1.2}}, covariance, {});
  const double weak = -std::log(2.0 * kPi * 0.6) - std::log(15.0 / 400.0) - 0.5 * 1.44 / 0.6;
  EXPECT_NEAR(weak, std::log(2.0), 0.1);
  for (const std::vector<int>& in_question : {std::vector<int>{1, 3}, {3, 1}}) {
    const Duplicates found = row.found(in_question);
    EXPECT_EQ(found.pairs, (std::vector<std::pair<int, int>>{{0, 1}}));
  }
}

// Both pairs are sure to be one (S = 2 cm² and 700 cm²), but only the first is as near as two
// sightings of one landmark: 3.7 standard deviations of their distance are 0.35 m.
TEST(Reassociation, TellsTracksOfOneLandmarkFromAnotherPlace) {
  Eigen::MatrixXd covariance = 1e-4 * Eigen::MatrixXd::Identity(8, 8);
  covariance.bottomRightCorner<4, 4>() = 0.035 * Eigen::Matrix4d::Identity();
  const Row row({{4.0, 0.0}, {4.0, 0.01}, {7.0, 0.0}, {7.0, 0.37}}, covariance, {});
  const Duplicates all = row.found({1, 3});
  EXPECT_EQ(all.pairs, (std::vector<std::pair<int, int>>{{0, 1}, {2, 3}}));
  const double near = -std::log(2.0 * kPi * 2e-4) - std::log(15.0 / 400.0) - 0.5 * 1e-4 / 2e-4;
  EXPECT_NEAR(all.log_odds_of_near, near, 1e-6);
}

// Two clusters of two, 2 m apart and alike, and one that was seen later from somewhere between: it
// may be either, so it is neither. With a third landmark beside it that only one cluster has, it is
// that.
TEST(Reassociation, WaitsWhileThereIsAnotherChoice) {
  const std::vector<Eigen::Vector2d> clusters = {{4.0, 0.0}, {4.0, 0.5}, {6.0, 0.0}, {6.0, 0.5}};
  std::vector<Eigen::Vector2d> landmarks = clusters;
  landmarks.emplace_back(5.0, 0.0);
  landmarks.emplace_back(5.0, 0.5);
  const auto covariance_of = [](Eigen::Index count) {
    Eigen::MatrixXd covariance = 4e-4 * Eigen::MatrixXd::Identity(2 * count, 2 * count);
    // What was seen later is shifted as a whole, by 1 m or so.
    for (Eigen::Index i = 8; i < 2 * count; ++i) {
      for (Eigen::Index j = i % 2 + 8; j < 2 * count; j += 2) covariance(i, j) += 1.0;
    }
    return covariance;
  };
  EXPECT_TRUE(Row(landmarks, covariance_of(6), {{4, 5}}).found({4, 5}).pairs.empty());
  std::vector<Eigen::Vector2d> more = landmarks;
  more.emplace_back(5.3, 0.2);
  more.emplace_back(6.3, 0.2);
  Eigen::MatrixXd covariance = covariance_of(8);
  covariance.bottomRows(2).setZero();
  covariance.rightCols(2).setZero();
  covariance(14, 14) = covariance(15, 15) = 4e-4;
  const Duplicates found = Row(more, covariance, {{4, 5}, {4, 6}, {5, 6}}).found({4, 5, 6});
  const std::set<std::pair<int, int>> pairs(found.pairs.begin(), found.pairs.end());
  EXPECT_EQ(pairs, (std::set<std::pair<int, int>>{{2, 4}, {3, 5}, {6, 7}}));
}

// A belief over landmarks that turn out to be one: the same as a Gaussian given that their
// difference is 0, by the textbook's formula for the moments.
TEST(Reassociation, JoinsAsAGaussianIsConditioned) {
  const std::vector<Eigen::Vector2d> landmarks = {{1.0, 2.0}, {3.0, 4.0}, {1.2, 1.9}};
  const RandomStream random(5, RandomPurpose::test, 0);
  Eigen::MatrixXd root(6, 6);
  random.fill_normal(0, root.size(), root.data());
  const Eigen::MatrixXd covariance =
      0.01 * (root * root.transpose() + Eigen::MatrixXd::Identity(6, 6));
  SegmentGraph graph = Row(landmarks, covariance, {}).graph;
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(2, 6);
  h.block<2, 2>(0, 0).setIdentity();
  h.block<2, 2>(0, 4) = -Eigen::Matrix2d::Identity();
  const Eigen::Vector2d offset = landmarks[0] - landmarks[2];
  const Eigen::MatrixXd gain =
      covariance * h.transpose() * (h * covariance * h.transpose()).inverse();
  const Eigen::VectorXd moved = -gain * offset;
  const Eigen::MatrixXd given = covariance - gain * h * covariance;

  ASSERT_TRUE(renumber({0, 1, 0}, 0.0, &graph));
  std::unique_ptr<SegmentEquations> equations;
  ASSERT_TRUE(solve(0.0, &graph, &equations).is_solved);
  EXPECT_LT((graph.landmarks[0] - landmarks[0] - moved.head<2>()).norm(), 1e-4);
  EXPECT_LT((graph.landmarks[1] - landmarks[1] - moved.segment<2>(2)).norm(), 1e-4);
  EXPECT_EQ(graph.landmarks[2], landmarks[2]);  // nothing is said of it any more
  EXPECT_LT((equations->covariance_of({0, 1}) - given.topLeftCorner(4, 4)).norm(), 1e-6);
}

}  // namespace
}  // namespace pf_resampling
