#include "rviz_panel/view_fit.hpp"

#include <gtest/gtest.h>

namespace pf_resampling {
namespace {

const Eigen::Vector2d kWindow(800.0, 600.0);

visualization_msgs::Marker marker_at(const std::string& name, double x, double y) {
  visualization_msgs::Marker marker;
  marker.ns = name;
  marker.pose.position.x = x;
  marker.pose.position.y = y;
  return marker;
}

TEST(ViewFit, LandmarksBeaconsFindingsAndRobotAreTheScene) {
  Scene scene;
  EXPECT_TRUE(scene.box().isEmpty());
  visualization_msgs::MarkerArray markers;
  markers.markers = {marker_at("landmarks", 0.0, 0.0), marker_at("beacons", 6.0, 1.0),
                     marker_at("pose_heading", 5.0, -2.0), marker_at("landmark_ids", 99.0, 99.0)};
  geometry_msgs::Point landmark;
  landmark.x = 3.0;
  landmark.y = 7.0;
  markers.markers[0].points = {landmark};
  scene.take(markers);
  EXPECT_EQ(scene.box().min(), Eigen::Vector2d(3.0, -2.0));
  EXPECT_EQ(scene.box().max(), Eigen::Vector2d(6.0, 7.0));
  // Beacons do not come each time.
  markers.markers = {marker_at("pose_heading", 4.0, 0.0)};
  scene.take(markers);
  EXPECT_EQ(scene.box().min(), Eigen::Vector2d(3.0, -2.0));
  markers.markers = {marker_at("findings", 6.0, 1.0)};
  markers.markers[0].scale.z = 0.5;
  scene.take(markers);
  EXPECT_GT(scene.box().max().x(), 8.0);
  // After a reset all begins anew.
  markers.markers = {marker_at("landmarks", 0.0, 0.0), marker_at("pose_heading", 1.0, 1.0)};
  markers.markers[0].action = visualization_msgs::Marker::DELETE;
  scene.take(markers);
  EXPECT_EQ(scene.box().sizes(), Eigen::Vector2d(0.0, 0.0));
}

TEST(ViewFit, FourFifthsOfTheWindowAreFilled) {
  const Eigen::AlignedBox2d scene(Eigen::Vector2d(100.0, 0.0), Eigen::Vector2d(140.0, 40.0));
  const TopView view = fitted_view(scene, kWindow, {0.0, 0.0, 22.0});
  EXPECT_DOUBLE_EQ(view.x, 120.0);
  EXPECT_DOUBLE_EQ(view.y, 20.0);
  EXPECT_DOUBLE_EQ(view.scale, 0.8 * 600.0 / 40.0);
}

TEST(ViewFit, AViewThatIsGoodEnoughStays) {
  Eigen::AlignedBox2d scene(Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(30.0, 30.0));
  const TopView view = fitted_view(scene, kWindow, {0.0, 0.0, 1.0});
  scene.max().y() = 32.0;
  EXPECT_EQ(fitted_view(scene, kWindow, view).scale, view.scale);
  scene.max().y() = 36.0;  // outside
  EXPECT_LT(fitted_view(scene, kWindow, view).scale, view.scale);
  scene.max() = Eigen::Vector2d(10.0, 10.0);  // lost in the window
  EXPECT_GT(fitted_view(scene, kWindow, view).scale, view.scale);
}

TEST(ViewFit, ARobotAloneIsNotMagnified) {
  const Eigen::AlignedBox2d scene(Eigen::Vector2d(2.0, 3.0));
  EXPECT_DOUBLE_EQ(fitted_view(scene, kWindow, {0.0, 0.0, 1.0}).scale, 0.8 * 600.0 / 4.0);
}

}  // namespace
}  // namespace pf_resampling
