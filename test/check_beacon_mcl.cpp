// Plays a bag to the running beacon_mcl_node and checks what it publishes against the truth in the
// bag. Private parameters: make_bag (a program of this package that writes the bag, with BAG for
// its name), needs (a file without which the test is skipped), rate and seconds (of playing),
// maximum_error (m), inside_share, switch (a node whose strategies are switched meanwhile).
#include <geometry_msgs/PoseArray.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <nav_msgs/Path.h>
#include <pf_resampling/FilterStatus.h>
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/MarkerArray.h>

#include <Eigen/LU>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <set>

#include "pf_resampling/conversions.hpp"
#include "strategy_switcher.hpp"
#include "temporary_directory.hpp"

namespace pf_resampling {
namespace {

// Squared Mahalanobis distance within which 99.73 % of a planar Gaussian lie: what 3 sigma is in
// one dimension (chi-square, 2 degrees of freedom: -2 ln 0.0027).
constexpr double kThreeSigma = 11.829;
// From when the filter itself believes to know the position this well, it has converged.
constexpr double kConvergedSigma = 1.0;  // m

struct Belief {
  Pose2 pose;
  Eigen::Matrix2d covariance;
};

/// What was heard. Callbacks come from a thread of their own.
class Listener {
 public:
  explicit Listener(ros::NodeHandle* node) {
    subscribers_ = {
        listen<geometry_msgs::PoseWithCovarianceStamped>(
            node, "pose",
            [this](const auto& m) {
              const Eigen::Matrix3d covariance = to_covariance3(m.pose.covariance);
              note("pose", is_finite(m.pose.pose) && covariance.allFinite());
              beliefs[m.header.stamp.toSec()] = {to_pose2(m.pose.pose),
                                                 covariance.topLeftCorner<2, 2>()};
              ++poses;
            }),
        listen<geometry_msgs::PoseStamped>(
            node, "ground_truth",
            [this](const auto& m) { truth[m.header.stamp.toSec()] = to_pose2(m.pose); }),
        listen<nav_msgs::Odometry>(
            node, "odom", [this](const auto& m) { odometry.insert(m.header.stamp.toSec()); }),
        listen<tf2_msgs::TFMessage>(node, "/tf",
                                    [this](const auto& m) {
                                      for (const auto& transform : m.transforms) {
                                        const auto& t = transform.transform.translation;
                                        if (transform.header.frame_id != "map") continue;
                                        note("tf", std::isfinite(t.x + t.y + t.z) &&
                                                       is_unit(transform.transform.rotation));
                                      }
                                    }),
        listen<nav_msgs::Path>(node, "path",
                               [this](const auto& m) {
                                 for (const auto& pose : m.poses)
                                   note("path", is_finite(pose.pose));
                               }),
        listen<geometry_msgs::PoseArray>(node, "particlecloud",
                                         [this](const auto& m) {
                                           for (const auto& pose : m.poses)
                                             note("particlecloud", is_finite(pose));
                                         }),
        listen<sensor_msgs::PointCloud2>(
            node, "particles", [this](const auto& m) { note("particles", is_finite(m)); }),
        listen<visualization_msgs::MarkerArray>(
            node, "markers",
            [this](const auto& m) {
              for (const auto& marker : m.markers) {
                bool good = is_finite(marker.pose) &&
                            std::isfinite(marker.scale.x + marker.scale.y + marker.scale.z);
                for (const auto& point : marker.points) {
                  good = good && std::isfinite(point.x + point.y + point.z);
                }
                note("markers", good);
              }
            }),
        listen<FilterStatus>(node, "status", [this](const auto& m) {
          bool good = std::isfinite(m.effective_sample_size + m.entropy_sample_size +
                                    m.log_likelihood + m.innovation + m.innovation_sigma +
                                    m.update_time + m.yaw_rate_bias + m.yaw_rate_bias_sigma);
          for (const auto& radio : m.calibration) {
            good = good &&
                   std::isfinite(radio.scale + radio.scale_sigma + radio.bias + radio.bias_sigma);
          }
          note("status", good);
          status = m;
        })};
  }

  std::map<double, Belief> beliefs;
  std::map<double, Pose2> truth;
  std::set<double> odometry;
  FilterStatus status;
  int poses = 0;
  std::map<std::string, int> finite, not_finite;  // by topic

 private:
  template <typename Message>
  ros::Subscriber listen(ros::NodeHandle* node, const std::string& topic,
                         const std::function<void(const Message&)>& take) {
    const boost::function<void(const typename Message::ConstPtr&)> callback =
        [take](const typename Message::ConstPtr& message) { take(*message); };
    return node->subscribe<Message>(topic, 10000, callback);
  }
  void note(const std::string& topic, bool is_finite_message) {
    ++(is_finite_message ? finite : not_finite)[topic];
  }

  std::vector<ros::Subscriber> subscribers_;
};

/// Runs a line of the shell while messages come in; returns whether it succeeded.
bool run(const std::string& line) {
  ros::AsyncSpinner spinner(1);
  spinner.start();
  const bool good = std::system(line.c_str()) == 0;
  ros::WallDuration(2.0).sleep();
  spinner.stop();
  return good;
}

std::string replaced(std::string text, const std::string& word, const std::string& by) {
  const std::size_t place = text.find(word);
  return place == std::string::npos ? text : text.replace(place, word.size(), by);
}

/// Error and squared Mahalanobis distance of what was believed at a true pose.
struct Comparison {
  double error = 0.0;
  double distance = 0.0;
};

/// Beliefs within half a second around the truth are interpolated; otherwise nothing.
std::optional<Comparison> compare(const std::map<double, Belief>& beliefs, double time,
                                  const Pose2& truth) {
  const auto after = beliefs.lower_bound(time - 1e-6);
  if (after == beliefs.end()) return std::nullopt;
  Eigen::Vector2d place(after->second.pose.x, after->second.pose.y);
  if (after->first > time + 1e-6) {
    if (after == beliefs.begin()) return std::nullopt;
    const auto before = std::prev(after);
    if (after->first - before->first > 0.5) return std::nullopt;
    const double share = (time - before->first) / (after->first - before->first);
    place = share * place +
            (1.0 - share) * Eigen::Vector2d(before->second.pose.x, before->second.pose.y);
  }
  const Eigen::Vector2d error = place - Eigen::Vector2d(truth.x, truth.y);
  return Comparison{error.norm(), error.dot(after->second.covariance.inverse() * error)};
}

TEST(BeaconMclNode, FollowsTheTruth) {
  ros::NodeHandle node;
  ros::NodeHandle settings("~");
  const auto needs = settings.param<std::string>("needs", "");
  if (!needs.empty() && !std::filesystem::exists(needs)) {
    GTEST_SKIP() << needs << " is not there";
  }
  const TemporaryDirectory directory;
  const std::string bag = directory.file("in.bag");
  const auto make_bag = settings.param<std::string>("make_bag", "");
  ASSERT_EQ(std::system((std::string(PF_RESAMPLING_PROGRAMS) + "/" +
                         replaced(make_bag, "BAG", bag) + " > /dev/null")
                            .c_str()),
            0);
  Listener heard(&node);
  // The pause lets all subscribers connect.
  const auto switched = settings.param<std::string>("switch", "");
  std::optional<StrategySwitcher> switcher;
  if (!switched.empty()) switcher.emplace(switched, 0.2);
  ASSERT_TRUE(run("rosbag play --quiet --clock --delay 3 --rate " +
                  std::to_string(settings.param("rate", 1.0)) + " --duration " +
                  std::to_string(settings.param("seconds", 1000.0)) + " " + bag + " > /dev/null"));

  if (switcher) {
    EXPECT_GE(switcher->stop(), 1) << "not every strategy had its turn";
  }

  ASSERT_GT(heard.odometry.size(), 100u) << "the bag did not arrive";
  ASSERT_GT(heard.beliefs.size(), 100u) << "the node gave no poses";

  // At odometry rate: from the first pose on, one for every message of odometry, at its stamp.
  const double first = heard.beliefs.begin()->first;
  const double last = heard.beliefs.rbegin()->first;
  EXPECT_LT(first - *heard.odometry.begin(), 20.0) << "the filter took too long to start";
  EXPECT_LT(*heard.odometry.rbegin() - last, 0.5);
  int expected = 0;
  int given = 0;
  for (const double stamp : heard.odometry) {
    if (stamp < first || stamp > last) continue;
    ++expected;
    given += static_cast<int>(heard.beliefs.count(stamp));
  }
  EXPECT_EQ(given, expected);
  EXPECT_EQ(heard.poses, static_cast<int>(heard.beliefs.size())) << "a stamp came twice";

  const auto converged =
      std::find_if(heard.beliefs.begin(), heard.beliefs.end(), [](const auto& entry) {
        return std::sqrt(entry.second.covariance.trace()) < kConvergedSigma;
      });
  ASSERT_NE(converged, heard.beliefs.end()) << "the filter never converged";
  int compared = 0;
  int inside = 0;
  double sum = 0.0;
  double worst = 0.0;
  for (auto truth = heard.truth.upper_bound(converged->first); truth != heard.truth.end();
       ++truth) {
    const auto comparison = compare(heard.beliefs, truth->first, truth->second);
    if (!comparison) continue;
    ++compared;
    inside += comparison->distance <= kThreeSigma ? 1 : 0;
    sum += comparison->error;
    worst = std::max(worst, comparison->error);
  }
  std::printf(
      "converged %.1f s after the start; %d true poses: error mean %.3f m, maximum %.3f m, "
      "inside 3 sigma %.1f %%; %d poses for %d odometry messages\n",
      converged->first - *heard.odometry.begin(), compared, sum / compared, worst,
      100.0 * inside / compared, given, expected);
  EXPECT_GT(compared, 0.9 * expected);
  EXPECT_LT(worst, settings.param("maximum_error", 2.0));
  EXPECT_GE(inside, settings.param("inside_share", 0.95) * compared);

  for (const char* topic :
       {"pose", "tf", "path", "particlecloud", "particles", "markers", "status"}) {
    EXPECT_GT(heard.finite[topic], 3) << topic;
    EXPECT_EQ(heard.not_finite[topic], 0) << topic;
  }
  std::uint64_t rejected = 0;
  for (const RejectCount& reject : heard.status.rejects) rejected += reject.count;
  EXPECT_GT(heard.status.updates, 50 * rejected);
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "check_beacon_mcl");
  return RUN_ALL_TESTS();
}
