#include "fastslam_node/landmark_markers.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

namespace pf_resampling {
namespace {

using visualization_msgs::Marker;

LandmarkEstimate landmark(std::int64_t id, double x, double y) {
  LandmarkEstimate estimate;
  estimate.id = id;
  estimate.mean = {x, y};
  estimate.covariance = 0.01 * Eigen::Matrix2d::Identity();
  return estimate;
}

const MarkerFrame kFrame = {"map", ros::Time(7.0)};

TEST(LandmarkMarkers, EllipsesHaveTwiceTheSigmasAsRadiiAlongTheAxes) {
  // Sigmas of 0.5 m and 0.1 m, the long axis at 30 degrees.
  LandmarkEstimate estimate = landmark(3, 4.0, -2.0);
  const double angle = kPi / 6.0;
  const Eigen::Vector2d axis(std::cos(angle), std::sin(angle));
  const Eigen::Vector2d across(-axis.y(), axis.x());
  estimate.covariance = 0.25 * axis * axis.transpose() + 0.01 * across * across.transpose();
  const auto array = landmark_markers(kFrame, {estimate}, 0.02);
  ASSERT_EQ(array.markers.size(), 2u);
  EXPECT_EQ(array.markers[0].type, Marker::SPHERE_LIST);
  EXPECT_EQ(array.markers[0].points.size(), 1u);
  EXPECT_EQ(array.markers[0].points[0].x, 4.0);
  const Marker& lines = array.markers[1];
  EXPECT_EQ(lines.type, Marker::LINE_LIST);
  EXPECT_EQ(lines.header.frame_id, "map");
  EXPECT_EQ(lines.scale.x, 0.02);
  ASSERT_EQ(lines.points.size() % 2, 0u);
  double longest = 0.0;
  double shortest = 1e9;
  for (std::size_t i = 0; i < lines.points.size(); ++i) {
    const Eigen::Vector2d offset =
        Eigen::Vector2d(lines.points[i].x, lines.points[i].y) - estimate.mean;
    // On the ellipse: the squared Mahalanobis distance is 2^2.
    EXPECT_NEAR(offset.dot(estimate.covariance.inverse() * offset), 4.0, 1e-9);
    longest = std::max(longest, offset.norm());
    shortest = std::min(shortest, offset.norm());
    if (std::abs(offset.norm() - 1.0) < 1e-9) {
      EXPECT_NEAR(std::abs(offset.dot(axis)), 1.0, 1e-9);
    }
    // A closed line: each piece begins where the last ended.
    const std::size_t next = (i + 1) % lines.points.size();
    if (i % 2 == 1) {
      EXPECT_EQ(lines.points[i].x, lines.points[next].x);
      EXPECT_EQ(lines.points[i].y, lines.points[next].y);
    }
  }
  EXPECT_NEAR(longest, 1.0, 1e-9);
  EXPECT_NEAR(shortest, 0.2, 1e-9);
}

TEST(LandmarkMarkers, AnEmptyMapTakesThemAway) {
  for (const Marker& marker : landmark_markers(kFrame, {}, 0.02).markers) {
    EXPECT_EQ(marker.action, Marker::DELETE);
  }
}

TEST(LandmarkMarkers, LabelsGoWithTheirLandmarks) {
  std::set<std::int64_t> labels;
  const auto first = label_markers(kFrame, {landmark(3, 0, 0), landmark(8, 1, 1)}, 0.5, &labels);
  ASSERT_EQ(first.markers.size(), 2u);
  EXPECT_EQ(first.markers[0].text, "3");
  EXPECT_EQ(first.markers[1].text, "8");
  EXPECT_EQ(first.markers[1].id, 8);
  EXPECT_EQ(first.markers[0].scale.z, 0.5);
  EXPECT_EQ(first.markers[0].action, Marker::ADD);
  const auto second = label_markers(kFrame, {landmark(8, 1, 1), landmark(9, 2, 2)}, 0.5, &labels);
  ASSERT_EQ(second.markers.size(), 3u);
  EXPECT_EQ(second.markers[2].id, 3);
  EXPECT_EQ(second.markers[2].ns, first.markers[0].ns);
  EXPECT_EQ(second.markers[2].action, Marker::DELETE);
  // Once is enough.
  EXPECT_EQ(label_markers(kFrame, {landmark(8, 1, 1)}, 0.5, &labels).markers.size(), 2u);
  EXPECT_EQ(label_markers(kFrame, {landmark(8, 1, 1)}, 0.5, &labels).markers.size(), 1u);
}

TEST(LandmarkMarkers, AssociationLinesAreGreenBlueAndRed) {
  ScanPicture scan;
  scan.robot = {1.0, 2.0, kPi / 2.0};
  scan.sensor = {1.0, 0.0, -kPi / 2.0};  // at (1, 3), looking along x
  scan.observations.resize(3);
  scan.outcomes.resize(3);
  for (std::size_t k = 0; k < 3; ++k) {
    scan.observations[k].range = 2.0;
    scan.observations[k].bearing = kPi / 2.0 * static_cast<double>(k);
  }
  scan.outcomes[0] = {5, false, 1.0};   // seen again
  scan.outcomes[1] = {6, true, 1.0};    // new
  scan.outcomes[2] = {-1, false, 0.2};  // not believed
  const std::vector<LandmarkEstimate> map = {landmark(5, 3.3, 3.1), landmark(6, 1.0, 5.0)};
  const auto array = association_markers(kFrame, scan, map, 0.02, 1.5);
  ASSERT_EQ(array.markers.size(), 3u);
  const double ends[3][2] = {{3.3, 3.1}, {1.0, 5.0}, {-1.0, 3.0}};
  for (std::size_t k = 0; k < 3; ++k) {
    const Marker& lines = array.markers[k];
    ASSERT_EQ(lines.points.size(), 2u);
    EXPECT_NEAR(lines.points[0].x, 1.0, 1e-12);
    EXPECT_NEAR(lines.points[0].y, 3.0, 1e-12);
    EXPECT_NEAR(lines.points[1].x, ends[k][0], 1e-12);
    EXPECT_NEAR(lines.points[1].y, ends[k][1], 1e-12);
    EXPECT_EQ(lines.lifetime, ros::Duration(1.5));
  }
  const auto strongest = [&](std::size_t k) {
    const auto& color = array.markers[k].color;
    return color.r > color.g && color.r > color.b ? 'r' : color.g > color.b ? 'g' : 'b';
  };
  EXPECT_EQ(strongest(0), 'g');
  EXPECT_EQ(strongest(1), 'b');
  EXPECT_EQ(strongest(2), 'r');

  for (const Marker& lines : association_markers(kFrame, {}, map, 0.02, 1.5).markers) {
    EXPECT_EQ(lines.action, Marker::DELETE);
  }
}

TEST(LandmarkMarkers, TheExtentIsTheDiagonalOfTheMap) {
  EXPECT_EQ(extent_of(std::vector<LandmarkEstimate>{}), 1.0);
  EXPECT_EQ(extent_of({landmark(1, 2.0, 2.0)}), 1.0);
  EXPECT_NEAR(extent_of({landmark(1, 2.0, 2.0), landmark(2, 5.0, 6.0)}), 5.0, 1e-12);
}

}  // namespace
}  // namespace pf_resampling
