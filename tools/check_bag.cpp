// check_bag: which filters can run on a bag, and what is odd in it.
#include <iostream>
#include <string>
#include <vector>

#include "tools/checks/bag_findings.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/filter_options.hpp"

namespace {

using namespace pf_resampling;

CommandLine command_line() {
  CommandLine line(
      "check_bag",
      "Says which filter can use a bag and by which command, what the other lacks, and what is "
      "odd in\nthe bag. Exits with 0 if a filter can run on it, with 1 if none can.");
  line.positional("in.bag", "the bag to check");
  const CheckedTopics usual;
  add_beacon_mcl_topics(&line);
  line.topic("landmarks", usual.landmarks, "observations of landmarks");
  line.topic("ground-truth", usual.ground_truth, "true poses");
  add_filter_options(&line);
  line.example("check_bag plaza2.bag");
  line.example("check_bag robot.bag --odom /robot/odom --ranges /uwb/ranges");
  line.example("check_bag slam.bag --landmarks /camera/landmarks");
  line.example("check_bag tags.bag --set 'landmark_input/tag_pattern=tag_(\\d+)'");
  line.example("check_bag uwb.bag --config beacons.yaml");
  return line;
}

int check_bag(const std::vector<std::string>& arguments) {
  CommandLine line = command_line();
  if (!line.parse(arguments)) return 0;
  const CheckedTopics topics = {beacon_mcl_topics(line), line.topic("landmarks"),
                                line.topic("ground-truth")};
  const rosbag::Bag bag = open_bag(line.text("in.bag"));
  const CheckedConfiguration configuration = configuration_of(line);
  const BagFindings found =
      naming(line.text("in.bag"), [&] { return findings_of(bag, topics, configuration); });
  std::cout << line.text("in.bag") << ":\n";
  for (const std::string& remark : found.remarks) std::cout << "  remark: " << remark << "\n";
  for (const FilterVerdict& verdict : {found.beacon_mcl, found.fastslam}) {
    std::cout << verdict.text() << "\n";
    if (verdict.is_ready()) std::cout << "  " << verdict.command << "\n";
    if (!verdict.is_worth_a_try()) continue;
    std::cout << "  try: rosrun pf_resampling check_bag";
    for (const std::string& argument : arguments) std::cout << " " << shell_word(argument);
    for (const std::string& word : verdict.advice) std::cout << " " << shell_word(word);
    std::cout << "\n";
  }
  return found.is_ready_for_any() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  return run_tool("check_bag", argc, argv, check_bag);
}
