// Drives a robot in a circle for a node that this program starts, in real time. Private parameters:
// filter (beacon_mcl or fastslam), check: `checkpoint` (the node is killed and started again),
// `pose` (likewise, with its pose alone), `overload` (it gets more than it can compute, for
// `seconds`, with `particles`) or `services` (that write and read files).
#include <diagnostic_msgs/DiagnosticArray.h>
#include <gtest/gtest.h>
#include <pf_resampling/Checkpoint.h>
#include <pf_resampling/FilterStatus.h>
#include <pf_resampling/LoadMap.h>
#include <pf_resampling/SaveMap.h>
#include <ros/ros.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"
#include "test/beacon_mcl_drive.hpp"
#include "test/fastslam_drive.hpp"
#include "test/node_process.hpp"
#include "test/places.hpp"
#include "test/run_program.hpp"

namespace pf_resampling {
namespace {

/// The drives of both filters, as topics.
class Robot {
 public:
  Robot(ros::NodeHandle* node, bool is_fastslam)
      : is_fastslam_(is_fastslam),
        odom_(node->advertise<nav_msgs::Odometry>("odom", 1000)),
        observations_(is_fastslam ? node->advertise<LandmarkObservationArray>("landmarks", 10000)
                                  : node->advertise<BeaconRange>("ranges", 10000)) {
    if (is_fastslam) return;
    beacons_ = node->advertise<BeaconArray>("beacons", 1, true);
    beacons_.publish(BeaconMclDrive::beacon_array());
  }

  /// Waits for the node: it has its frame where the robot is at the first odometry.
  void begin() {
    while (odom_.getNumSubscribers() == 0 || observations_.getNumSubscribers() == 0) {
      ros::WallDuration(0.02).sleep();
    }
    begin_ = ros::Time::now();
  }

  /// True pose at a time, where the filter has its frame.
  Pose2 truth(ros::Time stamp) const {
    return is_fastslam_ ? FastSlamDrive::truth(in_drive(stamp))
                        : BeaconMclDrive::truth(in_drive(stamp));
  }

  void publish_odometry(ros::Time now) const {
    nav_msgs::Odometry odometry = is_fastslam_ ? FastSlamDrive::odometry(in_drive(now))
                                               : BeaconMclDrive::odometry(in_drive(now));
    odometry.header.stamp = now;
    odom_.publish(odometry);
  }

  void publish_observation(ros::Time now) {
    ++observed;
    if (is_fastslam_) {
      LandmarkObservationArray scan = FastSlamDrive::scan(in_drive(now));
      scan.header.stamp = now;
      observations_.publish(scan);
    } else {
      BeaconRange range = BeaconMclDrive::range(in_drive(now), static_cast<int>(observed % 4));
      range.header.stamp = now;
      observations_.publish(range);
    }
  }

  std::atomic<std::uint64_t> observed{0};

 private:
  ros::Time in_drive(ros::Time stamp) const {
    return ros::Time(BeaconMclDrive::kStart) + (stamp - begin_);
  }

  bool is_fastslam_;
  ros::Publisher odom_, observations_, beacons_;
  ros::Time begin_;
};

/// Publishes odometry at 50 Hz and observations at a rate of choice, by a thread of its own.
class Driving {
 public:
  explicit Driving(Robot* robot) {
    robot->begin();
    thread_ = std::thread([this, robot] { drive(robot); });
  }
  ~Driving() {
    is_over_ = true;
    thread_.join();
  }
  void set_observation_rate(double rate) { period_ = 1.0 / rate; }

 private:
  void drive(Robot* robot) {
    ros::Time odometry = ros::Time::now();
    ros::Time observation = odometry;
    while (!is_over_) {
      const ros::Time now = ros::Time::now();
      if (now >= odometry) {
        robot->publish_odometry(now);
        odometry += ros::Duration(0.02);
      } else if (now >= observation) {
        robot->publish_observation(now);
        observation += ros::Duration(period_);
      } else {
        (std::min(odometry, observation) - now).sleep();
      }
    }
  }

  std::atomic<bool> is_over_{false};
  std::atomic<double> period_{0.2};
  std::thread thread_;
};

struct HeardPose {
  ros::Time stamp;
  double age = 0.0;    // s, when it was heard
  double error = 0.0;  // m
  geometry_msgs::PoseWithCovariance pose;
};

class Listener {
 public:
  Listener(ros::NodeHandle* node, const Robot* robot) {
    const boost::function<void(const geometry_msgs::PoseWithCovarianceStamped::ConstPtr&)> pose =
        [this, robot](const geometry_msgs::PoseWithCovarianceStamped::ConstPtr& m) {
          const Pose2 truth = robot->truth(m->header.stamp);
          const double error =
              std::hypot(m->pose.pose.position.x - truth.x, m->pose.pose.position.y - truth.y);
          const std::lock_guard<std::mutex> lock(mutex_);
          poses_.push_back(
              {m->header.stamp, (ros::Time::now() - m->header.stamp).toSec(), error, m->pose});
        };
    const boost::function<void(const FilterStatus::ConstPtr&)> status =
        [this](const FilterStatus::ConstPtr& m) {
          const std::lock_guard<std::mutex> lock(mutex_);
          statuses_.push_back(*m);
        };
    const boost::function<void(const diagnostic_msgs::DiagnosticArray::ConstPtr&)> diagnostics =
        [this](const diagnostic_msgs::DiagnosticArray::ConstPtr& m) {
          const std::lock_guard<std::mutex> lock(mutex_);
          for (const auto& entry : m->status) diagnostics_.push_back(entry);
        };
    subscribers_ = {node->subscribe("pose", 10000, pose), node->subscribe("status", 10000, status),
                    node->subscribe("/diagnostics", 10000, diagnostics)};
  }

  /// What has come since the last call.
  std::vector<HeardPose> poses() { return take(&poses_); }
  std::vector<FilterStatus> statuses() { return take(&statuses_); }
  std::vector<diagnostic_msgs::DiagnosticStatus> diagnostics() { return take(&diagnostics_); }

 private:
  template <typename Item>
  std::vector<Item> take(std::vector<Item>* items) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::exchange(*items, {});
  }

  std::mutex mutex_;
  std::vector<HeardPose> poses_;
  std::vector<FilterStatus> statuses_;
  std::vector<diagnostic_msgs::DiagnosticStatus> diagnostics_;
  std::vector<ros::Subscriber> subscribers_;
};

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

double worst_error(const std::vector<HeardPose>& poses) {
  double worst = 0.0;
  for (const HeardPose& pose : poses) worst = std::max(worst, pose.error);
  return worst;
}

class LiveFilter : public testing::Test {
 protected:
  void SetUp() override { spinner_.start(); }

  void start(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "__name:=" + filter_);
    process_.emplace(std::string(kProgramsFolder) + "/" + filter_ + "_node", arguments);
    ASSERT_TRUE(ros::service::waitForService("checkpoint", ros::Duration(20.0)));
  }
  static void wait(double seconds) { ros::WallDuration(seconds).sleep(); }

  ros::NodeHandle node_;
  ros::NodeHandle settings_{"~"};
  std::string filter_ = settings_.param<std::string>("filter", "");
  ros::AsyncSpinner spinner_{2};
  Robot robot_{&node_, filter_ == "fastslam"};
  Listener heard_{&node_, &robot_};
  std::optional<NodeProcess> process_;

  /// Whether run_bag gives out the same as the node that has recorded this flight, to the last bit.
  void expect_replayed(const std::string& flight, const std::vector<HeardPose>& live) const {
    const ProgramResult run = run_program("run_bag " + filter_ + " " + flight + ".bag " + flight +
                                          ".out --resume " + flight + ".checkpoint --pose-only");
    ASSERT_EQ(run.exit_code, 0) << run.error;
    std::map<ros::Time, geometry_msgs::PoseWithCovariance> poses;
    for (const HeardPose& pose : live) poses[pose.stamp] = pose.pose;
    const rosbag::Bag bag(flight + ".out");
    int same = 0;
    for (const rosbag::MessageInstance& instance : rosbag::View(bag, rosbag::TopicQuery("/pose"))) {
      const auto pose = instance.instantiate<geometry_msgs::PoseWithCovarianceStamped>();
      const auto heard = poses.find(pose->header.stamp);
      if (heard == poses.end()) continue;
      EXPECT_EQ(pose->pose, heard->second) << pose->header.stamp;
      ++same;
    }
    EXPECT_GT(same, 200);
  }

  /// The message of the first entry of this name that is not OK, else of the last, and how the node
  /// says it started.
  std::string started(const std::string& entry_name) {
    std::string how;
    for (const auto& entry : heard_.diagnostics()) {
      if (entry.name != filter_ + ": " + entry_name) continue;
      how = entry.message;
      for (const auto& value : entry.values) {
        if (value.key == "started") how += "; started " + value.value;
      }
      if (entry.level != diagnostic_msgs::DiagnosticStatus::OK) break;
    }
    return how;
  }
};

/// What a service answers to the name of a file.
template <typename Service>
std::pair<bool, std::string> ask(const std::string& service, const std::string& file) {
  Service call;
  call.request.file = file;
  if (!ros::service::call(service, call)) return {false, service + " did not answer"};
  return {call.response.success, call.response.message};
}

// Killed as by a loss of power while it drives, and there again two seconds later: right from its
// first pose on, which comes with the first odometry. Then the same with a file that is damaged.
TEST_F(LiveFilter, Checkpoint) {
  const TemporaryDirectory directory;
  const std::string file = directory.file("robot.checkpoint");
  const std::vector<std::string> arguments = {"_checkpoint/file:=" + file,
                                              "_checkpoint/period:=0.3",
                                              "_map_file/directory:=" + directory.file("")};
  const auto started = [&] { return LiveFilter::started("checkpoint"); };
  ASSERT_NO_FATAL_FAILURE(start(arguments));
  const Driving driving(&robot_);
  wait(8.0);
  EXPECT_EQ(started(), "fine; started from nothing");
  const std::vector<HeardPose> poses = heard_.poses();
  EXPECT_GT(poses.size(), 300u);
  const auto [success, message] = ask<pf_resampling::Checkpoint>("save_flight", "flight");
  EXPECT_TRUE(success) << message;

  process_->kill_it();
  expect_replayed(directory.file("flight"), poses);
  wait(2.0);
  heard_.poses();
  heard_.statuses();
  ASSERT_NO_FATAL_FAILURE(start(arguments));
  const ros::Time there = ros::Time::now();
  wait(4.0);
  const std::vector<HeardPose> after = heard_.poses();
  ASSERT_GT(after.size(), 100u);
  std::printf(
      "first pose %.2f s after the node was there, errors until 4 s later: first %.3f m, "
      "largest %.3f m\n",
      (after.front().stamp - there).toSec(), after.front().error, worst_error(after));
  EXPECT_LT((after.front().stamp - there).toSec(), 1.0);
  // The chord of 2.3 s of the circle is 0.11 m off it.
  EXPECT_LT(worst_error(after), 0.6);
  EXPECT_EQ(started(), "fine; started from " + file);

  process_->kill_it();
  std::ofstream(file, std::ios::app) << "more\n";
  heard_.diagnostics();
  // The next is not written before the damage has been told of.
  ASSERT_NO_FATAL_FAILURE(start({arguments[0], "_checkpoint/period:=5"}));
  wait(3.0);
  const std::string said = started();
  EXPECT_EQ(said.rfind("started from nothing: checkpoint " + file + ": its checksum does not", 0),
            0u)
      << said;
  EXPECT_TRUE(process_->is_running());
}

// Files without a folder are in that of the node; what is there and of another kind stays.
TEST_F(LiveFilter, ServicesOfFiles) {
  const TemporaryDirectory directory;
  const std::string folder = directory.file("made/by/the/node");
  ASSERT_NO_FATAL_FAILURE(start({"_map_file/directory:=" + folder}));
  const Driving driving(&robot_);
  for (int i = 0; i < 200 && heard_.poses().empty(); ++i) wait(0.1);

  using Ask = std::pair<bool, std::string> (*)(const std::string&, const std::string&);
  std::map<std::string, Ask> services = {{"checkpoint", ask<pf_resampling::Checkpoint>}};
  if (filter_ == "fastslam") {
    services["save_map"] = ask<SaveMap>;
    services["load_map"] = ask<LoadMap>;
  } else {
    services["save_beacons"] = ask<SaveMap>;
  }
  const std::map<std::string, std::string> begins = {{"checkpoint", "pf_resampling checkpoint "},
                                                     {"save_map", "{"},
                                                     {"save_beacons", "# pf_resampling beacons "}};
  const auto content = [](const std::string& file) {
    std::ostringstream all;
    all << std::ifstream(file, std::ios::binary).rdbuf();
    return all.str();
  };
  for (const auto& [service, answer_of] : services) {
    if (service == "load_map") continue;
    const std::string file = folder + "/" + service + ".saved";
    for (const std::string& name : {service + ".saved", file}) {
      const auto [success, message] = answer_of(service, name);
      EXPECT_TRUE(success) << message;
      EXPECT_TRUE(says(message, " " + file));
      EXPECT_EQ(content(file).rfind(begins.at(service), 0), 0u);
    }
  }

  const std::string mine = directory.write("mine", "a thesis");
  ASSERT_EQ(mkfifo((folder + "/fifo").c_str(), 0600), 0);
  const std::string before = directory.listing();
  for (const auto& [service, answer_of] : services) {
    for (const std::string& name : {mine, std::string("/dev/null"), std::string("fifo")}) {
      EXPECT_FALSE(answer_of(service, name).first) << service << " " << name;
    }
  }
  EXPECT_EQ(directory.listing(), before);
  EXPECT_EQ(content(mine), "a thesis");
  if (services.count("load_map") > 0) {
    const auto [loaded, what] = ask<LoadMap>("load_map", "save_map.saved");
    EXPECT_TRUE(loaded) << what;
    EXPECT_TRUE(says(what, " " + folder + "/save_map.saved"));
  }
  EXPECT_TRUE(process_->is_running());
}

// Twenty times as many observations as can be computed: what is published stays up to date, what is
// dropped is counted and told of, memory does not grow.
TEST_F(LiveFilter, Overload) {
  const double seconds = settings_.param("seconds", 10.0);
  std::vector<std::string> arguments = {
      "_particles:=" + std::to_string(settings_.param("particles", 100000)),
      "_output/cloud_period:=1000"};
  if (filter_ == "fastslam") arguments.push_back("_preset:=fast");  // no redraws beside it
  ASSERT_NO_FATAL_FAILURE(start(arguments));
  Driving driving(&robot_);
  wait(5.0);
  std::vector<double> times;
  for (const FilterStatus& status : heard_.statuses()) times.push_back(status.update_time);
  ASSERT_GT(times.size(), 5u);
  const double update_time = median(times);
  heard_.poses();
  driving.set_observation_rate(20.0 / update_time);
  // What can be in queues is in them.
  wait(3.0);
  const std::uint64_t observed = robot_.observed;
  const double memory = resident_megabytes(process_->pid());
  heard_.poses();
  heard_.diagnostics();
  const std::size_t before = heard_.statuses().back().updates;
  // Of what grows to a bound, as the paths of the particles, half of the time is left to do so. A
  // tenth more is left for what few updates need: columns of a population that is resampled.
  double memory_half_way = memory;
  double most_afterwards = 0.0;
  for (double waited = 0.0; waited < seconds; waited += 0.1) {
    wait(0.1);
    const double now = resident_megabytes(process_->pid());
    if (waited <= 0.5 * seconds) {
      memory_half_way = std::max(memory_half_way, now);
    } else {
      most_afterwards = std::max(most_afterwards, now);
    }
  }
  const auto count = static_cast<double>(robot_.observed - observed);
  const std::vector<HeardPose> poses = heard_.poses();
  const std::vector<FilterStatus> statuses = heard_.statuses();
  ASSERT_FALSE(statuses.empty());
  ASSERT_GT(poses.size(), 100u);
  const FilterStatus& last = statuses.back();
  std::uint64_t dropped = 0;
  for (const RejectCount& reject : last.rejects) {
    if (reject.reason == "overload" || reject.reason == "queue_full") dropped += reject.count;
  }
  std::vector<double> ages;
  for (const HeardPose& pose : poses) ages.push_back(pose.age);
  const double oldest = *std::max_element(ages.begin(), ages.end());
  double latency = 0.0;
  for (const FilterStatus& status : statuses) latency = std::max(latency, status.latency);
  std::printf(
      "%s, %u particles: updates of %.1f ms alone; for %.0f s %.0f observations/s, of which %.1f/s "
      "were used; %zu poses, %.1f ms old (median), %.1f ms (oldest); observations up to %.2f s "
      "behind; %lu dropped; resident %.1f MiB, at most %.1f until half way, %.1f afterwards; "
      "largest error %.3f m\n",
      filter_.c_str(), last.particles, 1e3 * update_time, seconds, count / seconds,
      static_cast<double>(last.updates - before) / seconds, poses.size(), 1e3 * median(ages),
      1e3 * oldest, latency, static_cast<unsigned long>(dropped), memory, memory_half_way,
      most_afterwards, worst_error(poses));
  EXPECT_GT(count / seconds * update_time, 10.0) << "that was no overload";
  EXPECT_GT(static_cast<double>(last.updates - before), 0.2 * seconds / update_time);
  EXPECT_GT(static_cast<double>(dropped), 0.5 * count);
  // Poses wait for an update and those that came before; an observation for max_latency (1 s).
  EXPECT_LT(median(ages), 0.1 + 3.0 * update_time);
  EXPECT_LT(oldest, 0.5 + 10.0 * update_time);
  EXPECT_LT(latency, 1.0 + 0.5 + 10.0 * update_time);
  EXPECT_GT(static_cast<double>(poses.size()), 0.8 * 50.0 * seconds) << "poses are missing";
  EXPECT_LT(most_afterwards, 1.1 * memory_half_way + 4.0);
  EXPECT_LT(worst_error(poses), 1.0);
  bool is_told = false;
  for (const auto& entry : heard_.diagnostics()) {
    is_told = is_told || (entry.name == filter_ + ": timing" &&
                          entry.level == diagnostic_msgs::DiagnosticStatus::WARN);
  }
  EXPECT_TRUE(is_told);
  EXPECT_TRUE(process_->is_running());
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "check_live_filter");
  const auto check = ros::NodeHandle("~").param<std::string>("check", "checkpoint");
  testing::GTEST_FLAG(filter) = check == "overload"   ? "*.Overload"
                                : check == "services" ? "*.ServicesOfFiles"
                                                      : "*.Checkpoint";
  return RUN_ALL_TESTS();
}
