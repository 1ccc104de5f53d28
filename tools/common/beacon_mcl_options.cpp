#include "tools/common/beacon_mcl_options.hpp"

#include "tools/common/bag.hpp"
#include "tools/common/filter_options.hpp"

namespace pf_resampling {

void add_beacon_mcl_topics(CommandLine* line) {
  namespace po = boost::program_options;
  line->options()("ranges", po::value<std::string>()->default_value("/ranges")->value_name("TOPIC"),
                  "ranges")(
      "sensor-ranges",
      po::value<std::string>()->default_value("/sensor_ranges")->value_name("TOPIC"),
      "ranges as sensor_msgs/Range")(
      "beacons", po::value<std::string>()->default_value("/beacons")->value_name("TOPIC"),
      "beacons");
}

void add_beacon_mcl_options(CommandLine* line) {
  namespace po = boost::program_options;
  add_filter_options(line);
  line->options()("odom", po::value<std::string>()->default_value("/odom")->value_name("TOPIC"),
                  "odometry");
  add_beacon_mcl_topics(line);
}

BeaconMclPipelineOptions read_beacon_mcl_options(const CommandLine& line) {
  BeaconMclPipelineOptions options;
  apply_filter_options(line, &options);
  return options;
}

BeaconMclTopics beacon_mcl_topics(const CommandLine& line) {
  BeaconMclTopics topics;
  topics.odom = absolute_topic(line.get<std::string>("odom"));
  topics.ranges = absolute_topic(line.get<std::string>("ranges"));
  topics.sensor_ranges = absolute_topic(line.get<std::string>("sensor-ranges"));
  topics.beacons = absolute_topic(line.get<std::string>("beacons"));
  return topics;
}

}  // namespace pf_resampling
