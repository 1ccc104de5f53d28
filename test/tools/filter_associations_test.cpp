#include "tools/common/filter_associations.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

StampedPose pose(double time, double x, double y, double heading) {
  StampedPose estimate;
  estimate.time = time;
  estimate.pose = {x, y, heading};
  return estimate;
}

PointLandmark landmark(std::int32_t id, double x, double y) {
  PointLandmark found;
  found.id = id;
  found.position = {x, y};
  return found;
}

SeenLandmark sighting(double range, double bearing) {
  SeenLandmark seen;
  seen.id = -1;
  seen.range = range;
  seen.bearing = bearing;
  return seen;
}

/// The robot goes east at 1 m/s for 10 s; the path has its first and its last pose alone. The
/// odometry has a frame of its own, turned by 90 degrees, and measures 10 % too little. The sensor
/// looks to the left. Landmarks stand 2 m apart, so that the gate is 1 m.
struct Drive {
  FilterResult result{{pose(0.0, 0.0, 0.0, 0.0), pose(10.0, 10.0, 0.0, 0.0)},
                      {landmark(7, 4.0, 3.0), landmark(8, 6.0, 3.0), landmark(9, 12.0, 3.0)}};
  Recording recording;

  Drive() {
    recording.frames["laser"] = Eigen::AngleAxisd(std::acos(0.0), Eigen::Vector3d::UnitZ());
    for (int i = 0; i <= 12; ++i) {
      recording.odometry.push_back(pose(i, 5.0, 0.9 * i, std::acos(0.0)));
    }
  }

  std::vector<int> ids_of(double time, const std::vector<SeenLandmark>& seen,
                          const std::string& frame = "laser") {
    StampedScan scan;
    scan.time = time;
    scan.frame = frame;
    scan.landmarks = seen;
    recording.scans = {scan};
    const std::vector<StampedScan> scans = associated_by(result, recording);
    std::vector<int> ids;
    for (const SeenLandmark& each : scans[0].landmarks) ids.push_back(each.id);
    return ids;
  }
};

// At 5 s the robot is at 5 m, where the odometry alone would have it at 4.5.
TEST(FilterAssociations, AreOfTheNearestLandmarkOfPathAndMap) {
  Drive drive;
  const double range = std::hypot(1.0, 3.0);
  const double bearing = std::atan2(1.0, 3.0);
  EXPECT_EQ(drive.ids_of(5.0, {sighting(range, bearing), sighting(range, -bearing)}),
            (std::vector<int>{7, 8}));
  // After the path's last pose by odometry: at 11.8 m.
  EXPECT_EQ(drive.ids_of(12.0, {sighting(3.0, 0.0)}), (std::vector<int>{9}));
}

TEST(FilterAssociations, AreOfNoneThatIsFarAndOfNoneTwice) {
  Drive drive;
  // 0.3, 0.1 and 1.2 m from the landmark at (4, 3).
  EXPECT_EQ(drive.ids_of(4.0, {sighting(3.3, 0.0), sighting(3.1, 0.0), sighting(4.2, 0.0)}),
            (std::vector<int>{-1, 7, -1}));
}

TEST(FilterAssociations, OfAFrameThatIsNotOnTheRobotStayAsTheyAre) {
  Drive drive;
  SeenLandmark seen = sighting(3.0, 0.0);
  seen.id = 3;
  EXPECT_EQ(drive.ids_of(4.0, {seen}, "camera"), (std::vector<int>{3}));
}

TEST(FilterAssociations, NeedAPath) {
  Drive drive;
  drive.result.path.clear();
  EXPECT_THROW(drive.ids_of(4.0, {sighting(3.0, 0.0)}), Error);
}

TEST(FilterAssociations, NeedAMapThatIsNotTooLarge) {
  Drive drive;
  // The gate looks at all pairs: a million landmarks would take an hour.
  drive.result.map.assign(5001, landmark(1, 0.0, 0.0));
  EXPECT_THROW(drive.ids_of(4.0, {sighting(3.0, 0.0)}), Error);
}

TEST(FilterAssociations, OfWhatIsNotFiniteAreOfNone) {
  Drive drive;
  EXPECT_EQ(drive.ids_of(4.0, {sighting(std::nan(""), 0.0), sighting(3.0, 0.0)}),
            (std::vector<int>{-1, 7}));
}

}  // namespace
}  // namespace pf_resampling
