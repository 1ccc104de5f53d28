// check_bag: what is in a bag, and which filters can run on it.
#include <iostream>
#include <string>
#include <vector>

#include "tools/checks/bag_findings.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/command_line.hpp"

namespace {

using namespace pf_resampling;
namespace po = boost::program_options;

int check(const std::vector<std::string>& arguments) {
  CheckedTopics topics;
  CommandLine line(
      "check_bag",
      "Says what is in a bag and what is missing for each filter: topics, rates, gaps,\n"
      "stamps, frames, numbers, beacons, landmarks. Exits with 0 if a filter can run on it, with "
      "1 if none can.");
  line.positional("in.bag", "the bag to look at");
  const auto topic_option = [&](const char* name, std::string* topic, const char* what) {
    line.options()(name, po::value<std::string>(topic)->default_value(*topic)->value_name("TOPIC"),
                   what);
  };
  topic_option("odom", &topics.odom, "odometry");
  topic_option("ranges", &topics.ranges, "ranges to beacons");
  topic_option("sensor-ranges", &topics.sensor_ranges, "ranges as sensor_msgs/Range");
  topic_option("beacons", &topics.beacons, "where the beacons are");
  topic_option("landmarks", &topics.landmarks, "observations of landmarks");
  topic_option("ground-truth", &topics.ground_truth, "true poses");
  line.example("check_bag plaza2.bag");
  line.example("check_bag robot.bag --odom /robot/odom --ranges /uwb/ranges");
  line.example("check_bag slam.bag --landmarks /camera/landmarks");
  if (!line.parse(arguments)) return 0;
  for (std::string* topic : {&topics.odom, &topics.ranges, &topics.sensor_ranges, &topics.beacons,
                             &topics.landmarks, &topics.ground_truth}) {
    *topic = absolute_topic(*topic);
  }

  const rosbag::Bag bag = open_bag(line.get<std::string>("in.bag"));
  const BagFindings found = findings_of(bag, topics);
  std::cout << found.text;
  for (const std::string& remark : found.remarks) std::cout << "  remark: " << remark << "\n";
  std::cout << "\n";
  for (const FilterVerdict& verdict : {found.beacon_mcl, found.fastslam}) {
    std::cout << verdict.text() << "\n";
    if (verdict.is_ready()) std::cout << "  " << verdict.command << "\n";
  }
  return found.is_ready_for_any() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  return run_tool("check_bag", argc, argv, check);
}
