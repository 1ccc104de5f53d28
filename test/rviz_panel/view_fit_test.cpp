#include "rviz_panel/view_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace pf_resampling {
namespace {

using visualization_msgs::Marker;

geometry_msgs::Point point(double x, double y) {
  geometry_msgs::Point point;
  point.x = x;
  point.y = y;
  return point;
}

Marker marker(const char* name, int id, double x, double y) {
  Marker marker;
  marker.header.frame_id = "map";
  marker.ns = name;
  marker.id = id;
  marker.pose.position = point(x, y);
  return marker;
}

Eigen::AlignedBox2d box(double left, double bottom, double right, double top) {
  return {Eigen::Vector2d(left, bottom), Eigen::Vector2d(right, top)};
}

// Whether the view shows the point in a window of that size, not turned.
bool shows(const TopView& view, double width, double height, double x, double y) {
  return std::abs(x - view.x) * view.scale <= width / 2.0 &&
         std::abs(y - view.y) * view.scale <= height / 2.0;
}

TEST(Scene, HoldsLandmarksBeaconsPathAndRobot) {
  Scene scene;
  EXPECT_TRUE(scene.box().isEmpty());
  nav_msgs::Path path;
  path.header.frame_id = "map";
  path.poses.resize(2);
  path.poses[1].pose.position = point(-3.0, 1.0);
  scene.take(path);
  EXPECT_TRUE(scene.box().isApprox(box(-3.0, 0.0, 0.0, 1.0)));
  visualization_msgs::MarkerArray markers;
  markers.markers = {marker("beacons", 0, 9.0, 0.0), marker("beacons", 1, 0.0, 7.0),
                     marker("pose_heading", 0, 0.0, -2.0), marker("ranges", 0, 500.0, 0.0)};
  markers.markers[3].points = {point(900.0, 0.0)};
  Marker landmarks = marker("landmarks", 0, 0.0, 0.0);
  landmarks.points = {point(20.0, 3.0), point(4.0, 30.0)};
  markers.markers.push_back(landmarks);
  scene.take(markers);
  EXPECT_TRUE(scene.box().isApprox(box(-3.0, -2.0, 20.0, 30.0)));
  EXPECT_EQ(scene.frame(), "map");
  // Beacons are not sent each time; a map that is taken away counts no more.
  landmarks.action = Marker::DELETE;
  markers.markers = {landmarks};
  scene.take(markers);
  EXPECT_TRUE(scene.box().isApprox(box(-3.0, -2.0, 9.0, 7.0)));
}

TEST(ViewFit, ShowsAllAndFillsTheWindow) {
  const TopView view = fitted_view(box(100.0, -50.0, 400.0, 150.0), 600.0, 800.0, 0.0, {});
  EXPECT_DOUBLE_EQ(view.x, 250.0);
  EXPECT_DOUBLE_EQ(view.y, 50.0);
  EXPECT_NEAR(view.scale, 0.8 * 600.0 / 300.0, 1e-12);  // the width is what is narrow
  // A quarter of a turn: the 200 m lie along the 600 pixels, the 300 m along the 800.
  const TopView turned = fitted_view(box(100.0, -50.0, 400.0, 150.0), 600.0, 800.0, M_PI / 2.0, {});
  EXPECT_NEAR(turned.scale, 0.8 * 800.0 / 300.0, 1e-9);
}

TEST(ViewFit, APointIsShownWithSomeRoomAroundIt) {
  const TopView view = fitted_view(box(7.0, 8.0, 7.0, 8.0), 500.0, 500.0, 0.0, {});
  EXPECT_NEAR(view.scale, 100.0, 1e-9);  // 5 m
}

TEST(ViewFit, StandsStillWhileAllIsSeenAndNotTooSmall) {
  std::optional<TopView> view;
  int changes = 0;
  for (double reach = 0.0; reach < 300.0; reach += 0.1) {
    const Eigen::AlignedBox2d driven = box(-0.3 * reach, 0.0, reach, 0.5 * reach);
    const TopView next = fitted_view(driven, 700.0, 690.0, 0.0, view);
    if (!view || next.scale != view->scale || next.x != view->x) ++changes;
    view = next;
    ASSERT_TRUE(shows(*view, 700.0, 690.0, driven.min().x(), driven.min().y())) << reach;
    ASSERT_TRUE(shows(*view, 700.0, 690.0, driven.max().x(), driven.max().y())) << reach;
  }
  EXPECT_LT(changes, 60);
  // What is left after a reset is small again.
  EXPECT_GT(fitted_view(box(0.0, 0.0, 3.0, 3.0), 700.0, 690.0, 0.0, view).scale, view->scale);
}

}  // namespace
}  // namespace pf_resampling
