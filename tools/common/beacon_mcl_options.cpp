#include "beacon_mcl_options.hpp"

#include "bag.hpp"
#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

void add_beacon_mcl_options(CommandLine* line) {
  namespace po = boost::program_options;
  line->repeatable_option(
      "config", "FILE",
      "YAML file of parameters, beacons, calibration; may be repeated, later ones win");
  line->repeatable_option(
      "set", "NAME=VALUE",
      "one parameter, for instance population/resampling/scheme=stratified; may be repeated");
  line->options()("odom", po::value<std::string>()->default_value("/odom")->value_name("TOPIC"),
                  "odometry")(
      "ranges", po::value<std::string>()->default_value("/ranges")->value_name("TOPIC"), "ranges")(
      "beacons", po::value<std::string>()->default_value("/beacons")->value_name("TOPIC"),
      "beacons");
}

BeaconMclPipelineOptions read_beacon_mcl_options(const CommandLine& line) {
  BeaconMclPipelineOptions options;
  if (line.has("config")) {
    for (const std::string& path : line.get<std::vector<std::string>>("config")) {
      const Configuration configuration = read_configuration(path);
      try {
        apply(configuration, &options);
      } catch (const Error& error) {
        throw Error(path + ": " + error.what());
      }
    }
  }
  if (line.has("set")) {
    for (const std::string& assignment : line.get<std::vector<std::string>>("set")) {
      apply(parse_assignment(assignment), &options);
    }
  }
  return options;
}

BeaconMclTopics beacon_mcl_topics(const CommandLine& line) {
  BeaconMclTopics topics;
  topics.odom = absolute_topic(line.get<std::string>("odom"));
  topics.ranges = absolute_topic(line.get<std::string>("ranges"));
  topics.beacons = absolute_topic(line.get<std::string>("beacons"));
  return topics;
}

}  // namespace pf_resampling
