#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <sstream>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"

namespace pf_resampling {
namespace {

class MapFile : public testing::Test {
 protected:
  std::string content() const { return directory_.content("a.map"); }

  // That a map is read as it was written: what is read is written as the same.
  void expect_comes_back(const SavedMap& map) const {
    write_map_file(path_, map);
    const std::string written = content();
    write_map_file(path_, read_map_file(path_));
    EXPECT_EQ(content(), written);
  }

  TemporaryDirectory directory_;
  std::string path_ = directory_.file("a.map");
};

// Values whose decimals do not end, the smallest and the largest, and minus zero.
SavedMap small_map() {
  SavedMap map;
  map.frame = "hall_3";
  map.association = DataAssociation::mutual_exclusion;
  map.pose.mean = {1.0 / 3.0, -2.0 / 7.0, 3.0};
  map.pose.covariance << 0.02, 0.001, 1e-5, 0.001, 0.01, -1e-5, 1e-5, -1e-5, 0.003;
  map.view_range = 10.1;
  map.view_bearing = 1.57;
  map.step = 4000000000u;
  map.next_id = 12;
  map.observations_since_renewal = 3;
  for (const std::int64_t id : {3, 11}) {
    SavedLandmark landmark;
    landmark.estimate.id = id;
    landmark.estimate.mean = {static_cast<double>(id) / 3.0, -0.0};
    landmark.estimate.covariance << 0.1, 0.01 / 3.0, 0.01 / 3.0, 0.2;
    landmark.estimate.held = 0.7;
    landmark.estimate.log_odds = -0.9;
    landmark.last_seen = {1e-300, 12345678.9};
    map.landmarks.push_back(landmark);
  }
  resize_columns(2, &map.particles);
  map.particle_maps.resize(2);
  map.particles.x << 0.0, 0.1;
  map.particles.y.setConstant(std::nextafter(1.0, 2.0));
  map.particles.heading.setConstant(-kPi);
  map.particles.weight << 0.3, 0.7;
  map.particles.log_weight << std::log(0.3), std::log(0.7);
  map.odometry_errors.velocity = {1.0 / 3.0, 0.0, -0.7};
  map.odometry_errors.covariance.setConstant(1e-3 / 3.0);
  map.odometry_errors.covariance.diagonal().setConstant(0.01 / 7.0);
  map.odometry_errors.means.setConstant(2, OdometryErrorEstimator::kCount, -0.1 / 3.0);
  for (const SavedLandmark& landmark : map.landmarks) {
    map.particle_maps[1].push_back(
        {landmark.estimate.id, landmark.estimate.mean, landmark.estimate.covariance, 1.0 / 9.0});
  }
  return map;
}

void write(const std::string& path, const std::string& content) {
  // A file that is cut to nothing and written again some file systems bring to the disk each time.
  std::filesystem::remove(path);
  std::ofstream(path, std::ios::binary) << content;
}

// What is said of a file; empty if it is read.
std::string refusal_of_map(const std::string& path) {
  return pf_resampling::refusal([&] { read_map_file(path); });
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t place = text.find(from);
  EXPECT_NE(place, std::string::npos) << from;
  return text.replace(place, from.size(), to);
}

TEST_F(MapFile, ComesBackToTheBit) {
  const SavedMap map = small_map();
  expect_comes_back(map);
  const SavedMap read = read_map_file(path_);
  EXPECT_EQ(read.pose.mean.x, map.pose.mean.x);
  EXPECT_EQ(read.particles.y[1], map.particles.y[1]);
  EXPECT_EQ(read.particle_maps[1][1].log_odds, 1.0 / 9.0);
  EXPECT_EQ(read.landmarks[1].last_seen, map.landmarks[1].last_seen);
  EXPECT_TRUE(std::signbit(read.landmarks[0].estimate.mean.y()));
  EXPECT_EQ(directory_.listing(), "a.map");
}

// The format itself, as doc/saved_files.md has it. Another one needs another number in the first
// line.
TEST_F(MapFile, IsOfTheFormatThatIsDocumented) {
  const std::string documented = R"({
 "format": "pf_resampling map 9",
 "association": "mutual_exclusion",
 "checksum": "552f280ad118a11f",
 "frame": "map",
 "landmarks": [
  {"covariance":[[0.0625,-0.03125],[-0.03125,0.125]],"held":1.0,"id":3,"last_seen":[4.0,2.5],"log_odds":3.6,"mean":[4.0,2.5]},
  {"covariance":[[0.5,0.0],[0.0,0.5]],"held":0.5,"id":8,"last_seen":[-1.75,0.0],"log_odds":-0.9,"mean":[-1.75,0.0]}
 ],
 "pose": {"covariance":[[0.0625,0.0,0.0],[0.0,0.25,0.125],[0.0,0.125,0.5]],"mean":[1.5,-0.25,0.125]},
 "state": {
  "is_lost": false,
  "memory": null,
  "next_id": 9,
  "observations_since_redraw": 5,
  "observations_since_renewal": 2,
  "odometry_errors": {
   "covariance": [
    [0.0625,0.0,0.0,0.0,0.0],
    [0.0,0.125,0.0,-0.125,0.0],
    [0.0,0.0,0.25,0.0,0.0],
    [0.0,-0.125,0.0,0.5,0.0],
    [0.0,0.0,0.0,0.0,1.0]
   ],
   "means": [[0.5,0.0,-0.5,0.25,0.125],[0.25,0.0,1.0,-0.25,0.75]],
   "velocity": [0.5,0.0,-0.25]
  },
  "particle_maps": {
   "id": [3,3,8],
   "landmarks": [1,2],
   "log_odds": [3.6,3.6,-0.9],
   "x": [4.25,3.75,-1.75],
   "xx": [0.0625,0.0625,0.5],
   "xy": [-0.03125,-0.03125,0.0],
   "y": [2.5,2.5,0.0],
   "yy": [0.0625,0.0625,0.5]
  },
  "particles": {"ancestor":[0,0],"heading":[-0.375,0.625],"log_weight":[-0.6931471805599453,-0.6931471805599453],"weight":[0.5,0.5],"x":[1.25,1.75],"y":[-0.75,0.25]},
  "step": 120,
  "unplaced_since": -1.0
 },
 "view_bearing": 1.5,
 "view_range": 8.25
}
)";
  write(path_, documented);
  const SavedMap map = read_map_file(path_);
  EXPECT_EQ(map.frame, "map");
  EXPECT_EQ(map.association, DataAssociation::mutual_exclusion);
  EXPECT_EQ(map.next_id, 9);
  EXPECT_EQ(map.step, 120u);
  EXPECT_EQ(map.observations_since_renewal, 2);
  EXPECT_EQ(map.view_range, 8.25);
  EXPECT_EQ(map.view_bearing, 1.5);
  EXPECT_EQ(map.pose.mean.y, -0.25);
  EXPECT_EQ(map.pose.covariance(1, 2), 0.125);
  ASSERT_EQ(map.landmarks.size(), 2u);
  EXPECT_EQ(map.landmarks[1].estimate.id, 8);
  EXPECT_EQ(map.landmarks[1].estimate.mean, Eigen::Vector2d(-1.75, 0.0));
  EXPECT_EQ(map.landmarks[1].estimate.held, 0.5);
  EXPECT_EQ(map.landmarks[1].estimate.log_odds, -0.9);
  EXPECT_EQ(map.landmarks[0].last_seen, Eigen::Vector2d(4.0, 2.5));
  EXPECT_EQ(map.landmarks[0].estimate.covariance(1, 1), 0.125);
  ASSERT_EQ(map.particles.size(), 2);
  EXPECT_EQ(map.particles.heading[0], -0.375);
  EXPECT_EQ(map.particles.weight[0], 0.5);
  ASSERT_EQ(map.particle_maps[0].size(), 1u);
  ASSERT_EQ(map.particle_maps[1].size(), 2u);
  EXPECT_EQ(map.particle_maps[1][0].mean, Eigen::Vector2d(3.75, 2.5));
  EXPECT_EQ(map.particle_maps[1][1].id, 8);
  EXPECT_EQ(map.particle_maps[1][1].log_odds, -0.9);
  EXPECT_EQ(map.odometry_errors.velocity, Eigen::Vector3d(0.5, 0.0, -0.25));
  EXPECT_EQ(map.odometry_errors.covariance(1, 3), -0.125);
  ASSERT_EQ(map.odometry_errors.means.rows(), 2);
  EXPECT_EQ(map.odometry_errors.means(1, 2), 1.0);
  EXPECT_EQ(map.observations_since_redraw, 5);
  write_map_file(path_, map);
  EXPECT_EQ(content(), documented);
}

TEST_F(MapFile, ComesBackWithoutParticlesAndWithoutLandmarks) {
  SavedMap map = small_map();
  map.particles = {};
  map.particle_maps.clear();
  map.odometry_errors.means.resize(0, OdometryErrorEstimator::kCount);
  expect_comes_back(map);
  map.landmarks.clear();
  expect_comes_back(map);
}

TEST_F(MapFile, AWeightOfZeroComesBack) {
  SavedMap map = small_map();
  map.particles.weight[0] = 0.0;
  map.particles.log_weight[0] = -std::numeric_limits<double>::infinity();
  map.particles.weight[1] = 1.0;
  map.particles.log_weight[1] = 0.0;
  expect_comes_back(map);
}

// Files of the right form, of which the content makes no sense.
TEST_F(MapFile, RefusesWhatCannotBeAndSaysWhere) {
  write_map_file(path_, small_map());
  const std::string whole = content();
  const struct {
    const char* from;
    const char* to;
    const char* said;
  } cases[] = {
      {"map 9\"", "map 10\"", "is of the format \"pf_resampling map 10\""},
      {"mutual_exclusion", "guessing", ": association: \"guessing\" is not a method of data"},
      {"mutual_exclusion", "automatic", "what their ids mean"},
      {"next_id\": 12", "next_id\": 11", ": state: its checksum does not fit"},
      {"view_range\": 10.1", "view_range\": \"10.1\"", ": view_range: a number expected"},
      {"view_range\": 10.1", "view_range\": 1e7", "the farthest range"},
      {"view_range\": 10.1", "view_range\": 1e999", "a number that is too large"},
      {"view_bearing\": 1.57", "view_bearing\": 3.2", "the widest bearing"},
      {",3.0]}", ",3.2]}", "the heading is not in [-pi, pi]"},
      {"[[0.02,", "[[-0.02,", "the covariance of the pose"},
      {"\"id\":11", "\"id\":3", "landmark 3 is there twice"},
      {"\"id\":11", "\"id\":2", "landmark 2 comes after landmark 3"},
      {"[[0.1,", "[[-0.1,", "the covariance of landmark 3"},
      {"[[0.1,", "[[1e-6,", "the covariance of landmark 3"},
      {"[[0.1,", "[[", ": landmarks[0].covariance[0]: 2 values expected, 1 found"},
      {"\"mean\":[1.0,", "\"mean\":[1e10,", "the position of landmark 3"},
      {"\"id\":11", "\"id\":12", "landmark 11 of the particles is not in the list of landmarks"},
  };
  for (const auto& test : cases) {
    write(path_, replaced(whole, test.from, test.to));
    const std::string said = refusal_of_map(path_);
    EXPECT_EQ(said.rfind("map file " + path_, 0), 0u) << said;
    EXPECT_TRUE(says(said, test.said));
    EXPECT_FALSE(says(said, "\n"));
  }
}

TEST_F(MapFile, RefusesWhatIsNoFile) {
  EXPECT_TRUE(says(refusal_of_map(directory_.file("none.map")), "cannot be read"));
  EXPECT_TRUE(says(refusal_of_map(directory_.path()), "is not a file"));
  write(path_, "");
  EXPECT_TRUE(says(refusal_of_map(path_), "is not how a map begins"));
}

TEST_F(MapFile, WritesNothingThatItWouldNotRead) {
  write_map_file(path_, small_map());
  const std::string before = content();
  const struct {
    std::function<void(SavedMap*)> damage;
    std::string said;
  } cases[] = {
      {[](SavedMap* map) { map->landmarks[0].estimate.id = -7; },
       "landmark id -7 is not in [0, 2^62]"},
      {[](SavedMap* map) { map->landmarks[0].estimate.covariance(1, 1) = 1e118; },
       "is not positive definite, or beyond 1e18 m^2"},
      {[](SavedMap* map) { map->pose.covariance(1, 1) = 1e19; }, "the covariance of the pose"},
      {[](SavedMap* map) { map->pose.mean.x = std::nan(""); }, "pose"},
      {[](SavedMap* map) { map->landmarks[0].estimate.mean.x() = HUGE_VAL; }, "position of"},
      {[](SavedMap* map) { map->landmarks[0].estimate.covariance(0, 1) = 1.0; }, "landmark 3"},
      {[](SavedMap* map) { std::swap(map->landmarks[0], map->landmarks[1]); }, "comes after"},
      {[](SavedMap* map) { map->landmarks.pop_back(); }, "is not in the list"},
  };
  for (const auto& test : cases) {
    SavedMap bad = small_map();
    test.damage(&bad);
    const std::string said = pf_resampling::refusal([&] { check_saved_map(bad); });
    EXPECT_TRUE(says(said, test.said));
    EXPECT_TRUE(says(said, "save the map again or repair it"));
    EXPECT_THROW(write_map_file(path_, bad), Error) << test.said;
    EXPECT_EQ(content(), before);
    EXPECT_EQ(directory_.listing(), "a.map");
  }
}

TEST_F(MapFile, HoldsTheMemoryOfADrive) {
  Memory memory;
  memory.start(Pose2{}, SensorConstants::Constant(0.1));
  for (int update = 0; update < 60; ++update) {
    MotionFactor motion;
    motion.mean = {0.1, 0.0, 0.01};
    motion.covariance = 1e-4 * Eigen::Matrix3d::Identity();
    memory.append(motion);
    memory.append_sighting(7 + update % 2, {0, 0, 5.0, 0.1, 0.01, 0.001, Pose2{}});
    if (update == 40) {
      ASSERT_TRUE(memory.solve(4.0));
    }
  }
  SavedMap map = small_map();
  map.memory = memory.state();
  write_map_file(path_, map);
  const MemoryState read = read_map_file(path_).memory;
  const Segment& first = *map.memory.graph.segments.front();
  EXPECT_EQ(read.graph.segments.front()->condensed->information[DataKind::range],
            first.condensed->information[DataKind::range]);
  EXPECT_EQ(read.graph.segments.front()->condensed->between, first.condensed->between);
  EXPECT_EQ(read.open.sightings.size(), map.memory.open.sightings.size());
}

}  // namespace
}  // namespace pf_resampling
