// Bags: refused in one line that names the file, or read to the end by all that reads bags, and
// copied.
#include "tools/common/bag.hpp"

#include <rosbag/view.h>

#include "pf_resampling_core/error.hpp"
#include "test/fuzz/fuzz_target.hpp"
#include "test/fuzz/saved_text.hpp"
#include "tools/checks/bag_survey.hpp"
#include "tools/common/bag_contents.hpp"

namespace pf_resampling::fuzz {
namespace {

// What is read of a bag, each by itself: an error of one says nothing of the others.
template <typename Read>
void read_or_refuse(const Read& read) {
  try {
    read();
  } catch (const Error& error) {
    require_one_line(error);
  }
}

void read_all(const rosbag::Bag& bag, const std::string& path) {
  read_or_refuse([&] { survey_bag(bag, CheckedTopics(), CheckedConfiguration()); });
  read_or_refuse([&] { read_truth(bag, "/ground_truth"); });
  read_or_refuse([&] { read_odometry(bag, "/odom"); });
  read_or_refuse([&] { read_beacons(bag, "/beacons"); });
  read_or_refuse([&] { read_ranges(bag, "/ranges"); });
  read_or_refuse([&] { read_landmark_scans(bag, "/landmarks"); });
  read_or_refuse([&] { read_landmark_map(bag, "/landmark_map"); });
  read_or_refuse([&] { read_frames_on_robot(bag, "base_link"); });
  const std::string copy = new_file("copy.bag");
  std::size_t messages = 0;
  read_or_refuse([&] {
    BagWriter writer(copy);
    for_each_in_order(bag, path, {}, [&](const rosbag::MessageInstance& message) {
      writer.copy(message);
      ++messages;
    });
    writer.finish();
    require(rosbag::View(open_bag(copy)).size() == messages, "a copy has lost messages");
  });
}

}  // namespace

void bag(const std::uint8_t* bytes, std::size_t size) {
  read_or_refuse([&] {
    const std::string path = file_of(text_of(bytes, size), "input.bag");
    read_all(open_bag(path), path);
  });
}

}  // namespace pf_resampling::fuzz
