#include "pf_resampling_core/files/archive.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "pf_resampling_core/test/temporary_directory.hpp"

namespace pf_resampling {
namespace {

struct Part {
  Pose2 pose;
  Eigen::MatrixXd matrix;
};

// Something of everything that has a description.
struct Whole {
  double number = 0.0;
  int count = 0;
  std::uint8_t byte = 0;
  std::int64_t id = 0;
  std::size_t place = 0;
  bool flag = false;
  std::string name;
  Eigen::Vector2d vector = Eigen::Vector2d::Zero();
  Eigen::Matrix<double, 2, 3> block = Eigen::Matrix<double, 2, 3>::Zero();
  Eigen::ArrayXi column;
  Eigen::ArrayXXd table;
  std::vector<bool> flags;
  std::array<Eigen::VectorXd, 2> pair;
  std::vector<std::vector<Part>> parts;
  std::optional<Part> some, none;
  std::shared_ptr<const Part> shared;
};

void describe(Archive& archive, Part& part) {
  PF_RESAMPLING_FIELDS(archive, part.pose, part.matrix);
}

void describe(Archive& archive, Whole& whole) {
  PF_RESAMPLING_FIELDS(archive, whole.number, whole.count, whole.byte, whole.id, whole.place,
                       whole.flag, whole.name, whole.vector, whole.block, whole.column, whole.table,
                       whole.flags, whole.pair, whole.parts);
  archive.sealed("some", whole.some);
  PF_RESAMPLING_FIELDS(archive, whole.none, whole.shared);
}

// Numbers whose decimals do not end, the smallest and the largest, and minus zero.
Whole example() {
  const Part part = {{1.0 / 3.0, -0.0, -kPi},
                     (Eigen::MatrixXd(2, 2) << 1e-300, 5e-324, 1e300, 1.0 / 7.0).finished()};
  Whole whole;
  whole.number = std::nextafter(1.0, 2.0);
  whole.count = std::numeric_limits<int>::max();
  whole.byte = 255;
  whole.id = std::numeric_limits<std::int64_t>::min();
  whole.place = std::size_t{1} << 60;
  whole.flag = true;
  whole.name = "a \"name\"";
  whole.vector = {0.1, -0.2};
  whole.block << 1.5, 2.5, 3.5, 4.0 / 3.0, 5.0 / 3.0, -7.0 / 3.0;
  whole.column = Eigen::ArrayXi::LinSpaced(3, -1, 1);
  whole.table = Eigen::ArrayXXd::Random(4, 3);
  whole.flags = {true, false, true};
  whole.pair = {Eigen::VectorXd::LinSpaced(60, 0.0, 1.0), Eigen::VectorXd()};
  whole.parts = {{part, part}, {}, {part}};
  whole.some = part;
  whole.shared = std::make_shared<const Part>(part);
  return whole;
}

constexpr FileKind kText = {"a file", "thing",        "pf_resampling thing 7",
                            true,     "give another", "mend it"};
constexpr FileKind kBinary = {"a file", "thing",        "pf_resampling thing 7",
                              false,    "give another", "mend it"};

class ArchiveOf : public testing::TestWithParam<FileKind> {
 protected:
  void put(const std::string& content) const {
    std::filesystem::remove(path_);
    std::ofstream(path_, std::ios::binary) << content;
  }
  std::string refusal() const {
    return pf_resampling::refusal([&] { read_saved<Whole>(GetParam(), path_); });
  }

  TemporaryDirectory directory_;
  std::string path_ = directory_.file("file");
};

struct Older {
  double number = 0.0;
};
struct Newer {
  double number = 0.0;
  int count = 5;
};

void describe(Archive& archive, Older& older) {
  PF_RESAMPLING_FIELDS(archive, older.number);
}

void describe(Archive& archive, Newer& newer) {
  PF_RESAMPLING_FIELDS(archive, newer.number);
  archive.if_there("count", newer.count);
}

void expect_same(const Part& a, const Part& b) {
  EXPECT_EQ(a.pose.x, b.pose.x);
  EXPECT_EQ(std::signbit(a.pose.y), std::signbit(b.pose.y));
  EXPECT_EQ(a.pose.heading, b.pose.heading);
  EXPECT_EQ(a.matrix, b.matrix);
}

TEST_P(ArchiveOf, AFieldThatOlderFilesDoNotHaveKeepsItsValue) {
  write_saved(GetParam(), path_, Older{1.5});
  EXPECT_EQ(read_saved<Newer>(GetParam(), path_).number, 1.5);
  EXPECT_EQ(read_saved<Newer>(GetParam(), path_).count, 5);
  write_saved(GetParam(), path_, Newer{1.5, 7});
  EXPECT_EQ(read_saved<Newer>(GetParam(), path_).count, 7);
}

TEST_P(ArchiveOf, EverythingComesBackToTheBit) {
  const Whole whole = example();
  write_saved(GetParam(), path_, whole);
  const Whole read = read_saved<Whole>(GetParam(), path_);
  EXPECT_EQ(read.number, whole.number);
  EXPECT_EQ(read.count, whole.count);
  EXPECT_EQ(read.byte, whole.byte);
  EXPECT_EQ(read.id, whole.id);
  EXPECT_EQ(read.place, whole.place);
  EXPECT_TRUE(read.flag);
  EXPECT_EQ(read.name, whole.name);
  EXPECT_EQ(read.vector, whole.vector);
  EXPECT_EQ(read.block, whole.block);
  EXPECT_TRUE((read.column == whole.column).all());
  ASSERT_EQ(read.table.cols(), 3);
  EXPECT_TRUE((read.table == whole.table).all());
  EXPECT_EQ(read.flags, whole.flags);
  EXPECT_EQ(read.pair[0], whole.pair[0]);
  EXPECT_EQ(read.pair[1].size(), 0);
  ASSERT_EQ(read.parts.size(), 3u);
  ASSERT_EQ(read.parts[0].size(), 2u);
  EXPECT_TRUE(read.parts[1].empty());
  expect_same(read.parts[2].at(0), whole.parts[2][0]);
  ASSERT_TRUE(read.some);
  expect_same(*read.some, *whole.some);
  EXPECT_FALSE(read.none);
  expect_same(*read.shared, *whole.shared);
  const std::string written = directory_.content("file");
  EXPECT_TRUE(GetParam().may_begin_with(written));
  write_saved(GetParam(), path_, read);
  EXPECT_EQ(directory_.content("file"), written);
}

TEST_P(ArchiveOf, WhatIsNotFiniteIsNotWritten) {
  Whole whole = example();
  write_saved(GetParam(), path_, whole);
  const std::string before = directory_.content("file");
  const auto said = [&](const std::function<void(Whole*)>& change) {
    Whole bad = example();
    change(&bad);
    return pf_resampling::refusal([&] { write_saved(GetParam(), path_, bad); });
  };
  EXPECT_EQ(said([](Whole* bad) { bad->parts[0][1].matrix(1, 0) = std::nan(""); }),
            "thing to write: parts[0][1].matrix[1][0]: it is not finite; reset the filter");
  EXPECT_EQ(said([](Whole* bad) { bad->vector[1] = HUGE_VAL; }),
            "thing to write: vector[1]: it is not finite; reset the filter");
  EXPECT_EQ(directory_.content("file"), before);
  EXPECT_THROW(write_saved(GetParam(), directory_.file("none/file"), whole), Error);
}

// Cut off anywhere, it is refused in one line that names the file; a binary one however a bit is
// turned over.
TEST_P(ArchiveOf, DamageIsRefused) {
  write_saved(GetParam(), path_, example());
  const std::string whole = directory_.content("file");
  const auto expect_refused = [&](const std::string& content, std::size_t place) {
    put(content);
    const std::string said = refusal();
    ASSERT_EQ(said.rfind("a file " + path_, 0), 0u) << said << " at byte " << place;
    ASSERT_EQ(said.find_first_of("\n\r"), std::string::npos) << said;
    ASSERT_TRUE(says(said, "; "));
  };
  const std::size_t last = GetParam().is_text ? whole.size() - 2 : whole.size() - 1;
  for (std::size_t place = 0; place <= last; ++place) {
    expect_refused(whole.substr(0, place), place);
    if (GetParam().is_text) continue;
    std::string content = whole;
    content[place] = static_cast<char>(whole[place] ^ (1 << (place % 8)));
    expect_refused(content, place);
  }
  expect_refused(whole + whole, whole.size());
}

TEST_P(ArchiveOf, WhatIsNoSuchFileIsRefusedAndNotTold) {
  for (const char* content : {"", "root:x:0:0", "{\"secret\": 1}", "pf_resampling things secret\n",
                              "[1, 2]", "\x9f\x9f\x9f"}) {
    put(content);
    EXPECT_EQ(refusal(), "a file " + path_ + " is not how a thing begins; give another");
    EXPECT_FALSE(GetParam().may_begin_with(content));
  }
  put("pf_resampling thing 6\nlines\n");
  EXPECT_EQ(refusal(), "a file " + path_ +
                           " is of the format \"pf_resampling thing 6\"; this program reads "
                           "\"pf_resampling thing 7\": give another");
  std::filesystem::remove(path_);
  EXPECT_TRUE(says(refusal(), "cannot be read"));
  std::filesystem::create_directory(path_);
  EXPECT_TRUE(says(refusal(), "is not a file"));
}

std::string name_of(const testing::TestParamInfo<FileKind>& kind) {
  return kind.param.is_text ? "Text" : "Binary";
}
INSTANTIATE_TEST_SUITE_P(Kinds, ArchiveOf, testing::Values(kText, kBinary), name_of);

struct ArchiveOfText : ArchiveOf {};

// A person may have edited it.
TEST_P(ArchiveOfText, SaysWhichValueDoesNotFit) {
  write_saved(GetParam(), path_, example());
  const std::string whole = directory_.content("file");
  const struct {
    const char *from, *to, *said;
  } cases[] = {
      {"\"flag\": true", "\"flag\": 1", "flag: true or false expected"},
      {"\"flag\": true", "\"flga\": true", "\"flag\" is missing"},
      {"\"byte\": 255", "\"byte\": 256", "byte: a whole number from 0 to 255 expected"},
      {"\"byte\": 255", "\"byte\": 2.5", "byte: a whole number from 0 to 255 expected"},
      {"\"place\": 1152921504606846976", "\"place\": 18446744073709551615",
       "place: a whole number from 0 to 9223372036854775807 expected"},
      {"\"name\": \"a \\\"name\\\"\"", "\"name\": 3", "name: a text expected"},
      {"\"vector\": [0.1,-0.2]", "\"vector\": [0.1]", "vector: 2 values expected, 1 found"},
      {"\"vector\": [0.1,-0.2]", "\"vector\": [0.1,null]", "vector[1]: a number expected"},
      {"\"vector\": [0.1,-0.2]", "\"vector\": 0.1", "vector: a list expected"},
      {"[[1.5,2.5,3.5],", "[[1.5,2.5],", "block[0]: 3 values expected, 2 found"},
      {"[[1e-300,5e-324],[1e+300,", "[[1e-300,5e-324],[",
       "parts[0][0].matrix[1]: 2 values expected, 1 found"},
      {"\"shared\": {", "\"shared\": [{}], \"other\": {", "shared: named values expected"},
      {"\"some\": {\"matrix\":[[1e-300", "\"some\": {\"matrix\":[[1e-301",
       "some: its checksum does not fit: it was damaged or edited; null in its place leaves the "
       "rest"},
      {"\"count\": 2147483647", "\"count\": 1e999", "it has a number that is too large"},
      {"\"count\": 2147483647", "\"count\": ", "line 7, column 11: this is not JSON"},
  };
  for (const auto& test : cases) {
    std::string content = whole;
    const std::size_t place = content.find(test.from);
    ASSERT_NE(place, std::string::npos) << test.from << " in " << whole;
    put(content.replace(place, std::string(test.from).size(), test.to));
    EXPECT_EQ(refusal(), "a file " + path_ + ": " + test.said + "; mend it");
  }
  put(whole.substr(0, whole.find("\"some\": {")) + "\"some\": null,\n \"other\": {" +
      whole.substr(whole.find("\"some\": {") + 9));
  EXPECT_FALSE(read_saved<Whole>(GetParam(), path_).some);
}
INSTANTIATE_TEST_SUITE_P(Kinds, ArchiveOfText, testing::Values(kText));

}  // namespace
}  // namespace pf_resampling
