// Lines of files, there and back: what is written can be read.
#include "pf_resampling_core/files/line_reader.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/line_writer.hpp"

namespace pf_resampling::text_file {
namespace {

class Lines : public testing::Test {
 protected:
  Lines() {
    std::string folder = testing::TempDir() + "line_reader_XXXXXX";
    folder_ = mkdtemp(folder.data());
    path_ = folder_ + "/a.map";
  }
  ~Lines() override { std::filesystem::remove_all(folder_); }

  std::string folder_;
  std::string path_;
};

TEST_F(Lines, TheLongestComesBack) {
  const std::string word(kLongestLine - 6, 'x');
  LineWriter writer(kMap, path_);
  writer.line("frame " + word);
  writer.finish();
  LineReader reader(kMap, path_);
  reader.take("frame", 1);
  EXPECT_EQ(reader.word(1), word);
  reader.take_end();
}

TEST_F(Lines, NoneThatCouldNotBeReadIsWritten) {
  try {
    LineWriter writer(kMap, path_);
    writer.line("frame " + std::string(kLongestLine - 5, 'x'));
    ADD_FAILURE() << "written";
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()),
              "map file " + path_ + ", line 2, is longer than the " + std::to_string(kLongestLine) +
                  " bytes that a reader takes; take shorter names or fewer landmarks");
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(Lines, ALongerOneIsRefused) {
  std::ofstream(path_, std::ios::binary) << kMap.first_line() << "\n"
                                         << std::string(kLongestLine + 1, 'x') << "\n";
  LineReader reader(kMap, path_);
  try {
    reader.take("frame", 1);
    ADD_FAILURE() << "read";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(", line 2: the line is too long; "), std::string::npos)
        << error.what();
  }
}

TEST_F(Lines, NumbersThatAreNotFiniteAreNotWritten) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(line_of("weight", -infinity, 0.5), "weight -inf 0.5");
  for (const double number : {infinity, std::nan("")}) {
    try {
      line_of("time", 1.0, number);
      ADD_FAILURE() << "written";
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()),
                "line to write: a number after \"time 1\" is not finite; reset the filter");
    }
  }
}

// The largest belief that a redraw starts from: a row of information for each coordinate.
TEST_F(Lines, HoldNumbersOfThousandsOfLandmarks) {
  std::string row = "past_prior_row";
  for (int i = 0; i < 2 * 20000; ++i) append(-1.2345678901234567e-300, &row);
  EXPECT_LE(row.size(), kLongestLine);
}

}  // namespace
}  // namespace pf_resampling::text_file
