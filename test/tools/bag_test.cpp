#include "tools/common/bag.hpp"
#include "tools/common/bag_writer.hpp"

#include <gtest/gtest.h>
#include <std_msgs/Float64.h>
#include <std_msgs/String.h>
#include <sys/stat.h>

#include <new>
#include <string>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {
namespace {

void write_example(const std::string& path) {
  BagWriter bag(path);
  std_msgs::String text;
  text.data = std::string(1000, 'x');
  std_msgs::Float64 number;
  number.data = 3.5;
  bag.write_latched("/name", ros::Time(1.0), text);
  bag.write("/number", ros::Time(1.0), number);
  bag.write("/number", ros::Time(2.0), number);
  bag.finish();
}

std::string error_of_opening(const std::string& path) {
  return refusal([&] { open_bag(path); });
}

TEST(OpenBag, SaysWhatIsWrongWithTheFile) {
  const TemporaryDirectory directory;
  const std::string good = directory.file("good.bag");
  write_example(good);
  EXPECT_EQ(error_of_opening(good), "");

  EXPECT_EQ(error_of_opening(directory.file("none.bag")),
            directory.file("none.bag") + ": no such file");
  EXPECT_EQ(error_of_opening(directory.path()), directory.path() + ": is a directory, not a bag");
  const std::string pipe = directory.file("pipe.bag");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(error_of_opening(pipe),
            pipe + ": is a pipe or a device, not a bag; copy it into a file");
  const std::string text = directory.write("text.bag", "t,x,y\n1,2,3\n");
  EXPECT_TRUE(says(error_of_opening(text), text + ": is not a bag"));
  const std::string empty = directory.write("empty.bag", "");
  EXPECT_TRUE(says(error_of_opening(empty), empty + ": is not a bag"));
}

TEST(OpenBag, EveryTruncationIsAnErrorThatNamesReindex) {
  const TemporaryDirectory directory;
  write_example(directory.file("good.bag"));
  const std::string bytes = read_file(directory.file("good.bag"));
  for (const double share : {0.2, 0.5, 0.9, 0.99, 0.999}) {
    const auto length = static_cast<std::size_t>(share * static_cast<double>(bytes.size()));
    const std::string path = directory.write("cut.bag", bytes.substr(0, length));
    const std::string message = error_of_opening(path);
    EXPECT_TRUE(says(message, "rosbag reindex " + path));
    EXPECT_FALSE(says(message, "\n"));
  }
}

TEST(ForEachInOrder, NamesTheBagWhateverEndsIt) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("a.bag");
  write_example(path);
  const rosbag::Bag bag = open_bag(path);
  const auto error_with = [&](const auto& thrown) -> std::string {
    return refusal([&] {
      for_each_in_order({&bag}, path, {}, [&](const rosbag::MessageInstance&) { throw thrown; });
    });
  };
  EXPECT_EQ(error_with(std::bad_alloc()), path + ": cannot be read to its end (std::bad_alloc)");
  EXPECT_EQ(error_with(Error("as it is")), "as it is");
}

TEST(BagWriter, LeavesTheOldBagUnlessFinished) {
  const TemporaryDirectory directory;
  const std::string path = directory.write("a.bag", "old");
  {
    BagWriter bag(path);
    bag.write("/number", ros::Time(1.0), std_msgs::Float64());
  }
  EXPECT_EQ(read_file(path), "old");
  EXPECT_EQ(directory.listing(), "a.bag");
  write_example(path);
  EXPECT_EQ(error_of_opening(path), "");
  EXPECT_EQ(directory.listing(), "a.bag");
}

TEST(BagWriter, SaysWhichFileItCannotWrite) {
  EXPECT_THROW(BagWriter("/nonexistent_directory/a.bag"), Error);
  const TemporaryDirectory directory;
  EXPECT_THROW(BagWriter(directory.path()), Error);
}

}  // namespace
}  // namespace pf_resampling
