#include "tools/common/bag_writer.hpp"

#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <std_msgs/Float64.h>
#include <std_msgs/String.h>

#include "pf_resampling_core/test/temporary_directory.hpp"
#include "tools/common/bag.hpp"

namespace pf_resampling {
namespace {

// rosbag's own reader is the judge: what was put in has to come out, over many chunks, with
// messages larger than a chunk and times out of order.
TEST(BagWriter, RosbagReadsWhatItWrites) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("a.bag");
  std::map<double, std::size_t> texts;
  std::map<double, double> numbers;
  {
    BagWriter bag(path);
    for (int i = 0; i < 3000; ++i) {
      const double time = i % 100 == 99 ? 1.0 + i - 50.5 : 1.0 + i;
      std_msgs::String text;
      text.data = std::string(i == 1234 ? 3000000U : static_cast<std::size_t>(i), 'a');
      bag.write("/text", ros::Time(time), text);
      texts[time] = text.data.size();
      if (i % 3 == 0) {
        std_msgs::Float64 number;
        number.data = 0.1 * i;
        bag.write_latched("/number", ros::Time(time), number);
        numbers[time] = number.data;
      }
    }
    bag.finish();
  }
  const rosbag::Bag bag = open_bag(path);
  rosbag::View view(bag);
  EXPECT_EQ(view.size(), texts.size() + numbers.size());
  ros::Time last;
  for (const rosbag::MessageInstance& message : view) {
    EXPECT_GE(message.getTime(), last);
    last = message.getTime();
    const double time = last.toSec();
    if (const auto text = message.instantiate<std_msgs::String>()) {
      EXPECT_EQ(message.getTopic(), "/text");
      EXPECT_FALSE(message.isLatching());
      ASSERT_EQ(texts.count(time), 1u);
      EXPECT_EQ(text->data.size(), texts[time]);
      texts.erase(time);
    } else if (const auto number = message.instantiate<std_msgs::Float64>()) {
      EXPECT_EQ(message.getTopic(), "/number");
      EXPECT_TRUE(message.isLatching());
      EXPECT_EQ(message.getCallerId(), "/pf_resampling");
      ASSERT_EQ(numbers.count(time), 1u);
      EXPECT_EQ(number->data, numbers[time]);
      numbers.erase(time);
    }
  }
  EXPECT_TRUE(texts.empty());
  EXPECT_TRUE(numbers.empty());
}

TEST(BagWriter, ABagWithoutMessagesIsABag) {
  const TemporaryDirectory directory;
  BagWriter(directory.file("a.bag")).finish();
  EXPECT_EQ(rosbag::View(open_bag(directory.file("a.bag"))).size(), 0u);
}

}  // namespace
}  // namespace pf_resampling
