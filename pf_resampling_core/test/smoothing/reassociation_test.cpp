#include "pf_resampling_core/smoothing/reassociation.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "pf_resampling_core/test/smoothing/ring_drive.hpp"

namespace pf_resampling {
namespace {

constexpr double kWidth = 4.0;
const SmoothingOptions kSmoothing{20, kWidth};
// The ring's landmarks: 15 on some 400 m^2, seen from 4 m; a twentieth of what is seen is new.
const ReassociationOptions kReassociation{kWidth, std::log(0.05 * 4.0 * 15.0 / 400.0),
                                          std::log(4.0 * 15.0 / 400.0)};

SmoothingGraph smoothed(SmoothingGraph graph) {
  EXPECT_EQ(smooth(kSmoothing, &graph).fault, SmoothingFault::none);
  return graph;
}

std::vector<int> landmarks_of(const SmoothingGraph& graph) {
  std::vector<int> numbers;
  for (const SightingFactor& sighting : graph.sightings) numbers.push_back(sighting.landmark);
  return numbers;
}

// Landmarks are 3 m apart, and a sighting errs by 5 cm and 0.02 rad.
TEST(Reassociation, FindsTheLandmarkOfEachSighting) {
  SmoothingGraph graph = smoothed(RingDrive(120, 15, 1, SensorConstants::Zero()).graph);
  const std::vector<int> right = landmarks_of(graph);
  for (std::size_t s = 0; s < graph.sightings.size(); s += 7) {
    graph.sightings[s].landmark = (graph.sightings[s].landmark + 3) % 15;
  }
  // Some are of nothing as yet.
  SmoothingGraph other = graph;
  graph.sightings.clear();
  for (std::size_t s = 0; s < other.sightings.size(); ++s) {
    SightingFactor sighting = other.sightings[s];
    if (s % 5 == 3) sighting.landmark = -1;
    (s % 5 == 3 ? graph.unassigned : graph.sightings).push_back(sighting);
  }
  EXPECT_GT(reassociate(kReassociation, &graph), 0);
  EXPECT_TRUE(graph.unassigned.empty());
  // A scan's sightings may have changed their order.
  std::multiset<std::pair<double, int>> found, wanted;
  for (const SightingFactor& sighting : graph.sightings) {
    found.emplace(sighting.range, sighting.landmark);
  }
  for (std::size_t s = 0; s < right.size(); ++s) {
    wanted.emplace(other.sightings[s].range, right[s]);
  }
  EXPECT_EQ(found, wanted);
  EXPECT_EQ(reassociate(kReassociation, &graph), 0);
}

TEST(Reassociation, LeavesWhatIsOfNoLandmarkAlone) {
  SmoothingGraph graph = smoothed(RingDrive(60, 15, 2, SensorConstants::Zero()).graph);
  SightingFactor clutter = graph.sightings[10];
  clutter.range += 1.5;  // 30 standard deviations
  graph.unassigned.push_back(clutter);
  EXPECT_EQ(reassociate(kReassociation, &graph), 0);
  ASSERT_EQ(graph.unassigned.size(), 1u);
  EXPECT_EQ(graph.unassigned[0].landmark, -1);
}

TEST(Reassociation, TakesNoLandmarkTwiceInAScan) {
  SmoothingGraph graph = smoothed(RingDrive(60, 15, 3, SensorConstants::Zero()).graph);
  SightingFactor again = graph.sightings[10];
  again.range += 0.02;
  graph.unassigned.push_back(again);
  reassociate(kReassociation, &graph);
  std::set<std::pair<int, int>> seen;
  for (const SightingFactor& sighting : graph.sightings) {
    EXPECT_TRUE(seen.emplace(sighting.pose, sighting.landmark).second);
  }
  EXPECT_EQ(graph.unassigned.size(), 1u);
}

// A sighting more, right on its landmark: its residual is 0, and what is left of its cost is the
// logarithm of its density there, log(2π·0.05·0.02).
TEST(Reassociation, CostsWhatIsUnlikely) {
  const SmoothingGraph graph = RingDrive(60, 15, 4, SensorConstants::Zero()).truth;
  SmoothingGraph with_data = RingDrive(60, 15, 4, SensorConstants::Zero()).graph;
  with_data.sightings.clear();
  const double nothing = association_cost(kReassociation, 0.0, with_data);
  const Pose2 seen =
      relative(with_data.poses[5], {with_data.landmarks[0].x(), with_data.landmarks[0].y(), 0.0});
  const SightingFactor exact = {
      5, 0, std::hypot(seen.x, seen.y), std::atan2(seen.y, seen.x), 25e-4, 4e-4, {}};
  const double expected = std::log(2.0 * kPi * 0.05 * 0.02);
  EXPECT_NEAR(sighting_cost(kReassociation, with_data, exact, 0), expected, 1e-9);
  with_data.sightings.push_back(exact);
  EXPECT_NEAR(association_cost(kReassociation, 0.0, with_data) - nothing, expected, 1e-12);
  with_data.sightings.clear();
  with_data.unassigned.push_back(exact);
  EXPECT_NEAR(association_cost(kReassociation, 0.0, with_data) - nothing,
              -kReassociation.log_density_of_new, 1e-12);
}

// Two rounds, in the second of which every landmark counts as another.
SmoothingGraph two_rounds(std::uint64_t seed) {
  RingDrive drive(400, 15, seed, SensorConstants::Zero());
  SmoothingGraph& graph = drive.graph;
  std::vector<bool> is_seen(15, false);
  for (SightingFactor& sighting : graph.sightings) {
    if (sighting.pose < 215) continue;
    if (graph.landmarks.size() == 15) graph.landmarks.resize(30, Eigen::Vector2d::Zero());
    const std::size_t landmark = static_cast<std::size_t>(sighting.landmark);
    if (!is_seen[landmark]) {
      const Pose2& pose = graph.poses[static_cast<std::size_t>(sighting.pose)];
      const double direction = pose.heading + sighting.bearing;
      graph.landmarks[landmark + 15] = {pose.x + sighting.range * std::cos(direction),
                                        pose.y + sighting.range * std::sin(direction)};
      is_seen[landmark] = true;
    }
    sighting.landmark += 15;
  }
  EXPECT_TRUE(std::all_of(is_seen.begin(), is_seen.end(), [](bool seen) { return seen; }));
  return graph;
}

TEST(Reassociation, FindsLandmarksThatAreOne) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SmoothingGraph graph = two_rounds(seed);
    const SmoothingResult solution = smooth(kSmoothing, &graph);
    ASSERT_EQ(solution.fault, SmoothingFault::none);
    const Duplicates duplicates = find_duplicates(kReassociation, graph, solution.belief);
    EXPECT_EQ(duplicates.pairs.size(), 15u) << seed;
    for (const auto& [older, newer] : duplicates.pairs) EXPECT_EQ(newer, older + 15) << seed;
    SmoothingGraph merged = graph;
    merge_landmarks(duplicates.pairs, &merged);
    for (const SightingFactor& sighting : merged.sightings) EXPECT_LT(sighting.landmark, 15);
    // What was joined is not joined again: the second of each pair is seen no more.
    std::vector<bool> is_removed(30, false);
    std::fill(is_removed.begin() + 15, is_removed.end(), true);
    remove_landmarks(is_removed, &merged);
    const SmoothingResult again = smooth(kSmoothing, &merged);
    ASSERT_EQ(again.fault, SmoothingFault::none);
    EXPECT_TRUE(find_duplicates(kReassociation, merged, again.belief).pairs.empty());
  }
}

// From pose 60 on every sighting has the wrong landmark. What is tracked from there is pure, though
// odometry alone says where the robot is, and what was before stays as it was.
TEST(Reassociation, TracksAnewWhatWasTakenForOtherLandmarks) {
  constexpr int kFrom = 60;
  SmoothingGraph graph = smoothed(RingDrive(120, 15, 5, SensorConstants::Zero()).graph);
  std::vector<double> times;
  for (std::size_t i = 0; i < graph.poses.size(); ++i) times.push_back(static_cast<double>(i));
  std::map<double, int> right;  // by range: no two are the same
  for (SightingFactor& sighting : graph.sightings) {
    right[sighting.range] = sighting.landmark;
    if (sighting.pose >= kFrom)
      sighting.landmark = (sighting.landmark + 1) % static_cast<int>(graph.landmarks.size());
  }
  const int known = static_cast<int>(graph.landmarks.size());
  SmoothingGraph anew = graph;
  anew.poses.back().x += 10.0;
  anew.unassigned.push_back(anew.sightings.back());
  anew.unassigned.back().range += 1e-3;
  right[anew.unassigned.back().range] = right[anew.sightings.back().range];
  SmoothingGraph too_many = anew;
  EXPECT_TRUE(track_anew(kReassociation, kFrom, 120, 10.0, times, &anew));
  ReassociationOptions few = kReassociation;
  few.most_landmarks = anew.landmarks.size() - 1;
  EXPECT_FALSE(track_anew(few, kFrom, 120, 10.0, times, &too_many));
  EXPECT_TRUE(anew.unassigned.empty());
  ASSERT_EQ(anew.sightings.size(), graph.sightings.size() + 1);
  EXPECT_EQ(anew.poses[kFrom].x, graph.poses[kFrom].x);
  EXPECT_NEAR(anew.poses.back().x, graph.poses.back().x, 1.0);
  std::map<int, int> truth_of;
  int tracked = 0;
  for (std::size_t s = 0; s < anew.sightings.size(); ++s) {
    const SightingFactor& sighting = anew.sightings[s];
    if (sighting.pose < kFrom) {
      EXPECT_EQ(sighting.landmark, graph.sightings[s].landmark);
      continue;
    }
    ++tracked;
    EXPECT_GE(sighting.landmark, known);
    const auto found = truth_of.emplace(sighting.landmark, right.at(sighting.range)).first;
    EXPECT_EQ(found->second, right.at(sighting.range)) << s;
  }
  EXPECT_GT(tracked, 50);
}

// From the origin two landmarks are seen 0.1 m apart, two standard deviations, in three scans each;
// in one both; and one that stands alone. Without the second, three sightings are of the first, at
// ½·2² more each, and one is of nothing.
TEST(Reassociation, FindsWhatCanBeDoneWithout) {
  SmoothingGraph graph;
  graph.poses.assign(8, Pose2{});
  graph.motions.assign(7, MotionFactor{});
  graph.prior = prior_at(Pose2{}, SensorConstants::Zero());
  graph.landmarks = {{4.0, 0.0}, {4.1, 0.0}, {-3.0, 0.0}};
  for (int pose = 0; pose < 8; ++pose) {
    if (pose < 4) graph.sightings.push_back({pose, 0, 4.0, 0.0, 25e-4, 4e-4, {}});
    if (pose > 2) graph.sightings.push_back({pose, 1, 4.1, 0.0, 25e-4, 4e-4, {}});
    graph.sightings.push_back({pose, 2, 3.0, -kPi, 25e-4, 4e-4, {}});
  }
  ReassociationOptions options = kReassociation;
  options.robust_width = 0.0;
  const double of_nothing = -options.log_density_of_new - std::log(2.0 * kPi * 0.05 * 0.02);
  const std::vector<Dispensable> found = find_dispensable(options, graph, 50.0);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].landmark, 0);
  EXPECT_EQ(found[0].other, 1);
  EXPECT_NEAR(found[0].cost, 3.0 * 2.0 + of_nothing, 1e-6);
  EXPECT_EQ(found[1].landmark, 1);
  EXPECT_EQ(found[1].other, 0);
  EXPECT_NEAR(found[1].cost, 4.0 * 2.0 + of_nothing, 1e-6);
  EXPECT_EQ(find_dispensable(options, graph, found[0].cost + 1.0).size(), 1u);
  // Three sightings that say as much as one.
  options.redundancy = 3.0;
  EXPECT_NEAR(find_dispensable(options, graph, 50.0)[0].cost, 2.0 + of_nothing, 1e-6);
  // Nothing has shown yet that they are two: find_duplicates() decides.
  graph.sightings.erase(
      std::remove_if(graph.sightings.begin(), graph.sightings.end(),
                     [](const SightingFactor& s) { return s.pose == 3 && s.landmark == 1; }),
      graph.sightings.end());
  EXPECT_TRUE(find_dispensable(options, graph, 50.0).empty());
}

// Two sightings from a place that is known, of one landmark or of two. With ρ the density of
// landmarks per m and rad, one explains them by ρ·N(difference; 0, 2R), two by ρ².
TEST(Reassociation, WeighsOneLandmarkAgainstTwoByTheirEvidence) {
  for (const double difference : {0.0, 0.1, 0.3}) {
    SmoothingGraph one;
    one.poses = {Pose2{}};
    one.prior = prior_at(Pose2{}, SensorConstants::Zero());
    one.landmarks = {{4.0, 0.0}};
    one.sightings = {{0, 0, 4.0 - 0.5 * difference, 0.0, 25e-4, 4e-4, {}},
                     {0, 0, 4.0 + 0.5 * difference, 0.0, 25e-4, 4e-4, {}}};
    SmoothingGraph two = one;
    two.landmarks.push_back(two.landmarks[0]);
    two.sightings[1].landmark = 1;
    ReassociationOptions options = kReassociation;
    options.robust_width = 0.0;
    const SmoothingOptions smoothing{50, 0.0, 1e-12};
    const SmoothingResult of_one = smooth(smoothing, &one);
    const SmoothingResult of_two = smooth(smoothing, &two);
    const double log_likelihood = -std::log(2.0 * kPi * 2.0 * std::sqrt(25e-4 * 4e-4)) -
                                  0.5 * difference * difference / (2.0 * 25e-4);
    EXPECT_NEAR(
        association_evidence(options, of_one, one) - association_evidence(options, of_two, two),
        options.log_density_of_landmarks - log_likelihood, 2e-3)
        << difference;
  }
}

// The same where each sighting is repeated with the same error, and as many say as much as one: the
// copies do not make the fit any worse. That a landmark is known better, each time, speaks against
// there being another: by the logarithm of the copies, half of it for each of its two unknowns.
TEST(Reassociation, SightingsWithTheSameErrorAreWorthOne) {
  std::vector<double> differences;
  for (const int copies : {1, 12}) {
    SmoothingGraph one;
    one.poses = {Pose2{}};
    one.prior = prior_at(Pose2{}, SensorConstants::Zero());
    one.landmarks = {{4.0, 0.0}};
    SmoothingGraph two = one;
    two.landmarks.push_back(two.landmarks[0]);
    for (int copy = 0; copy < copies; ++copy) {
      for (const int landmark : {0, 1}) {
        SightingFactor sighting{0, 0, 3.9 + 0.2 * landmark, 0.0, 25e-4, 4e-4, {}};
        one.sightings.push_back(sighting);
        sighting.landmark = landmark;
        two.sightings.push_back(sighting);
      }
    }
    ReassociationOptions options = kReassociation;
    options.robust_width = 0.0;
    options.redundancy = copies;
    const SmoothingOptions smoothing{50, 0.0, 1e-12};
    const SmoothingResult of_one = smooth(smoothing, &one);
    const SmoothingResult of_two = smooth(smoothing, &two);
    differences.push_back(association_evidence(options, of_one, one) -
                          association_evidence(options, of_two, two));
  }
  EXPECT_NEAR(differences[1], differences[0] - std::log(12.0), 2e-3);
}

// Of seven sightings three passages: landmark 0 is out of view for 11 s, landmark 1 for 10 s.
TEST(Reassociation, CountsSightingsPerPassage) {
  SmoothingGraph graph;
  graph.landmarks.assign(2, Eigen::Vector2d::Zero());
  EXPECT_EQ(redundancy_of(graph, {}, 10.0), 1.0);
  const std::vector<double> times = {0.0, 1.0, 2.0, 11.0, 12.0};
  for (const auto& [pose, landmark] :
       std::vector<std::pair<int, int>>{{0, 0}, {0, 1}, {1, 0}, {1, 1}, {3, 1}, {4, 0}, {4, 1}}) {
    graph.sightings.push_back({pose, landmark, 4.0, 0.0, 25e-4, 4e-4, {}});
  }
  EXPECT_DOUBLE_EQ(redundancy_of(graph, times, 10.0), 7.0 / 3.0);
}

// A belief about landmarks in a row, of which those of `seen` were seen in one scan.
struct Row {
  SmoothingGraph graph;
  JointBelief belief;

  Row(const std::vector<Eigen::Vector2d>& landmarks, const Eigen::MatrixXd& covariance,
      const std::vector<int>& seen) {
    graph.poses = {Pose2{}};
    graph.prior = prior_at(Pose2{}, SensorConstants::Zero());
    graph.landmarks = landmarks;
    for (const int landmark : seen) {
      graph.sightings.push_back({0, landmark, 4.0, 0.0, 25e-4, 4e-4, {}});
    }
    belief.covariance = covariance;
  }
  Duplicates found() const { return find_duplicates(kReassociation, graph, belief); }
};

// Σ = 1 cm² each, independent: S = 2 cm², and with the landmarks' density 15/400 per m², the
// logarithm of the odds is log N(d; 0, S) - log(15/400).
TEST(Reassociation, JoinsByTheOddsOfOneLandmarkAgainstTwo) {
  const Eigen::MatrixXd covariance = 1e-4 * Eigen::MatrixXd::Identity(4, 4);
  const Duplicates found = Row({{4.0, 0.0}, {4.0, 0.02}}, covariance, {0}).found();
  ASSERT_EQ(found.pairs.size(), 1u);
  const double prior = -std::log(2.0 * kPi * 2e-4) - std::log(15.0 / 400.0);
  EXPECT_NEAR(found.log_prior_odds, prior, 1e-9);
  EXPECT_NEAR(found.log_odds, prior - 0.5 * 4e-4 / 2e-4, 1e-9);
  // Four standard deviations apart; too uncertain to be sure; seen side by side.
  EXPECT_TRUE(Row({{4.0, 0.0}, {4.0, 0.06}}, covariance, {0}).found().pairs.empty());
  EXPECT_TRUE(Row({{4.0, 0.0}, {4.0, 0.02}}, 1e4 * covariance, {0}).found().pairs.empty());
  EXPECT_TRUE(Row({{4.0, 0.0}, {4.0, 0.02}}, covariance, {0, 1}).found().pairs.empty());
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
  EXPECT_TRUE(Row(landmarks, covariance_of(6), {4, 5}).found().pairs.empty());
  std::vector<Eigen::Vector2d> more = {clusters[0], clusters[1], clusters[2], clusters[3]};
  more.emplace_back(5.0, 0.0);
  more.emplace_back(5.0, 0.5);
  more.emplace_back(5.3, 0.2);
  more.emplace_back(6.3, 0.2);
  Eigen::MatrixXd covariance = covariance_of(8);
  covariance.row(14).setZero();
  covariance.row(15).setZero();
  covariance.col(14).setZero();
  covariance.col(15).setZero();
  covariance(14, 14) = covariance(15, 15) = 4e-4;
  const Duplicates found = Row(more, covariance, {4, 5, 6}).found();
  std::set<std::pair<int, int>> pairs(found.pairs.begin(), found.pairs.end());
  EXPECT_EQ(pairs, (std::set<std::pair<int, int>>{{2, 4}, {3, 5}, {6, 7}}));
}

// An information matrix and a gradient of this size.
void fill_in(std::uint64_t seed, GaussianPrior* prior) {
  const RandomStream random(seed, RandomPurpose::test, 0);
  const Eigen::Index size = prior->size();
  Eigen::MatrixXd root(size, size);
  random.fill_normal(0, root.size(), root.data());
  prior->information = root * root.transpose() + Eigen::MatrixXd::Identity(size, size);
  prior->gradient = root.col(0);
}

// A prior over landmarks that turn out to be one: the same as a Gaussian given that their
// difference is 0, by the textbook's formula for the moments.
TEST(Reassociation, MergesAsAGaussianIsConditioned) {
  SmoothingGraph graph;
  graph.poses = {Pose2{1.0, 2.0, 0.3}};
  graph.landmarks = {{1.0, 2.0}, {3.0, 4.0}, {1.2, 1.9}};
  GaussianPrior& prior = graph.prior;
  prior.pose = graph.poses[0];
  prior.landmarks = graph.landmarks;
  prior.landmarks_given_path.assign(3, Eigen::Matrix2d::Identity());
  const Eigen::Index size = prior.size();
  fill_in(5, &prior);
  // Moments of the differences to where the prior was linearised, and those given 0 = H·d + h.
  const Eigen::MatrixXd covariance = prior.information.inverse();
  const Eigen::VectorXd mean = -covariance * prior.gradient;
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(2, size);
  h.block<2, 2>(0, 3).setIdentity();
  h.block<2, 2>(0, 7) = -Eigen::Matrix2d::Identity();
  const Eigen::Vector2d offset = graph.landmarks[0] - graph.landmarks[2];
  const Eigen::MatrixXd gain =
      covariance * h.transpose() * (h * covariance * h.transpose()).inverse();
  const Eigen::VectorXd mean_given = mean - gain * (h * mean + offset);
  const Eigen::MatrixXd covariance_given = covariance - gain * h * covariance;

  merge_landmarks({{0, 2}}, &graph);
  remove_landmarks({false, false, true}, &graph);
  ASSERT_EQ(prior.size(), size - 2);
  ASSERT_EQ(graph.landmarks.size(), 2u);
  const Eigen::MatrixXd merged_covariance = prior.information.inverse();
  const Eigen::VectorXd merged_mean = -merged_covariance * prior.gradient;
  // The third landmark is gone: of the rows and columns of before, 7 and 8 are.
  const auto before = [](Eigen::Index i) { return i < 7 ? i : i + 2; };
  for (Eigen::Index i = 0; i < prior.size(); ++i) {
    EXPECT_NEAR(merged_mean[i], mean_given[before(i)], 1e-7) << i;
    for (Eigen::Index j = 0; j < prior.size(); ++j) {
      EXPECT_NEAR(merged_covariance(i, j), covariance_given(before(i), before(j)), 1e-7);
    }
  }
  EXPECT_EQ(prior.landmarks_given_path[0], 2.0 * Eigen::Matrix2d::Identity());
}

// What is left of a Gaussian are the moments of the rest.
TEST(Reassociation, RemovedLandmarksLeaveTheBeliefAboutTheOthers) {
  SmoothingGraph graph;
  graph.poses = {Pose2{}};
  graph.landmarks = {{1.0, 2.0}, {3.0, 4.0}, {5.0, 6.0}};
  GaussianPrior& prior = graph.prior;
  prior.landmarks = {graph.landmarks[0], graph.landmarks[1]};
  prior.landmarks_given_path.assign(2, Eigen::Matrix2d::Identity());
  const Eigen::Index size = prior.size();
  fill_in(6, &prior);
  const Eigen::MatrixXd covariance = prior.information.inverse();
  const Eigen::VectorXd mean = -covariance * prior.gradient;
  graph.sightings = {{0, 0, 1.0, 0.0, 1.0, 1.0, {}}, {0, 2, 2.0, 0.0, 1.0, 1.0, {}}};
  remove_landmarks({true, false, false}, &graph);
  ASSERT_EQ(graph.landmarks.size(), 2u);
  EXPECT_EQ(graph.landmarks[1], Eigen::Vector2d(5.0, 6.0));
  ASSERT_EQ(graph.sightings.size(), 1u);
  EXPECT_EQ(graph.sightings[0].landmark, 1);
  const Eigen::MatrixXd left = prior.information.inverse();
  const Eigen::VectorXd left_mean = -left * prior.gradient;
  const auto before = [](Eigen::Index i) { return i < 3 ? i : i + 2; };
  ASSERT_EQ(left.rows(), size - 2);
  for (Eigen::Index i = 0; i < left.rows(); ++i) {
    EXPECT_NEAR(left_mean[i], mean[before(i)], 1e-7);
    for (Eigen::Index j = 0; j < left.cols(); ++j) {
      EXPECT_NEAR(left(i, j), covariance(before(i), before(j)), 1e-7);
    }
  }
}

}  // namespace
}  // namespace pf_resampling
