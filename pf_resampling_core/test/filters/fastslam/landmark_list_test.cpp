#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "pf_resampling_core/test/says.hpp"

namespace pf_resampling {
namespace {

std::string path_of(const std::string& content) {
  std::string path = testing::TempDir() + "landmark_list_test.csv";
  std::ofstream(path, std::ios::binary) << content;
  return path;
}

std::string refusal_of_list(const std::string& content) {
  return pf_resampling::refusal([&] { read_landmark_list(path_of(content), "map"); });
}

TEST(LandmarkList, ReadsLandmarksAndComments) {
  const SavedMap map = read_landmark_list(path_of("# surveyed by hand\r\n"
                                                  "id, x,y\r\n"
                                                  "\n"
                                                  "7,1e1,2.5  # the door\n"
                                                  "2,3,-0.25"),
                                          "site");
  EXPECT_EQ(map.frame, "site");
  EXPECT_EQ(map.association, DataAssociation::known);
  EXPECT_EQ(map.particles.size(), 0);
  ASSERT_EQ(map.landmarks.size(), 2u);
  EXPECT_EQ(map.landmarks[0].estimate.id, 2);
  EXPECT_EQ(map.landmarks[0].estimate.mean, Eigen::Vector2d(3.0, -0.25));
  EXPECT_EQ(map.landmarks[1].estimate.id, 7);
  EXPECT_EQ(map.landmarks[1].estimate.mean, Eigen::Vector2d(10.0, 2.5));
  // Good to a millimetre, where nothing else is said.
  EXPECT_DOUBLE_EQ(map.landmarks[1].estimate.covariance(0, 0), 1e-6);
  EXPECT_DOUBLE_EQ(map.landmarks[1].estimate.covariance(0, 1), 0.0);
  EXPECT_NO_THROW(check_saved_map(map));
}

TEST(LandmarkList, ReadsStandardDeviations) {
  const SavedMap map = read_landmark_list(path_of("id,x,y,sigma\n4,1,2,0.5\n5,1,3,0\n"), "map");
  ASSERT_EQ(map.landmarks.size(), 2u);
  EXPECT_EQ(map.landmarks[0].estimate.covariance, 0.25 * Eigen::Matrix2d::Identity());
  // Zero says nothing of the accuracy.
  EXPECT_EQ(map.landmarks[1].estimate.covariance, 1e-6 * Eigen::Matrix2d::Identity());
}

TEST(LandmarkList, IsReadWhereAMapIs) {
  const SavedMap list = read_map(path_of("# by hand\n\n id, x, y\n4,1,2\n"), "site");
  EXPECT_EQ(list.frame, "site");
  ASSERT_EQ(list.landmarks.size(), 1u);
  EXPECT_EQ(list.landmarks[0].estimate.mean, Eigen::Vector2d(1.0, 2.0));
  const std::string path = testing::TempDir() + "landmark_list_test.map";
  write_map_file(path, list);
  const SavedMap file = read_map(path, "elsewhere");
  EXPECT_EQ(file.frame, "site");
  EXPECT_EQ(file.landmarks.size(), 1u);
  EXPECT_THROW(read_map("/no/such/list.csv", "map"), Error);
  EXPECT_THROW(read_map(path_of(""), "map"), Error);
  EXPECT_THROW(read_map(path_of("1 2 3\n4,5,6\n"), "map"), Error);
}

TEST(LandmarkList, RefusesWhatItCannotUseAndSaysWhere) {
  const struct {
    const char* content;
    const char* said;
  } cases[] = {
      {"", "line 1: there is no header"},
      {"id,x,y\n# none\n", "there are no landmarks"},
      {"id,x\n1,2\n", "line 1: this is not the header"},
      {"1,2,3\n", "line 1: this is not the header"},
      {"id,x,y,sigma\n1,2,3,-1\n", "line 2: sigma is negative"},
      {"id,x,y,sigma\n1,2,3,nan\n", "line 2: an id and three numbers"},
      {"id,x,y,sigma\n1,2,3\n", "line 2: an id and three numbers"},
      {"id,x,y\n1,2\n", "line 2: an id and two numbers"},
      {"id,x,y\n1,2,3,4\n", "line 2: an id and two numbers"},
      {"id,x,y\n1,2,3\n1,2,3\n", "line 3: landmark 1 is there twice"},
      {"id,x,y\n-1,2,3\n", "line 2: landmark id -1 is not in"},
      {"id,x,y\n1.5,2,3\n", "line 2: an id and two numbers"},
      {"id,x,y\n1,nan,3\n", "line 2: an id and two numbers"},
      {"id,x,y\n1,2,inf\n", "line 2: an id and two numbers"},
      {"id,x,y\n1,2,1e10\n", "line 2: the position of landmark 1"},
      {"id,x,y\n1,,3\n", "line 2: an id and two numbers"},
      {"id,x,y\n1,,3,4\n", "line 2: an id and two numbers"},
      {"id,x,y\n1,2,3,\n", "line 2: an id and two numbers"},
      {"id,x,y\n1 2,3,4\n", "line 2: an id and two numbers"},
      {"id,x,y,sigma\n1,2,3 4,0.1\n", "line 2: an id and three numbers"},
      {"id,x,y\n1;2;3\n", "line 2: an id and two numbers"},
  };
  for (const auto& test : cases) {
    const std::string said = refusal_of_list(test.content);
    EXPECT_TRUE(says(said, test.said));
    EXPECT_FALSE(says(said, "\n"));
  }
  EXPECT_THROW(read_landmark_list("/no/such/list.csv", "map"), Error);
}

// The first line of a file that is no list may be a secret; so are its words.
TEST(LandmarkList, SaysNothingOfWhatIsInAFileThatIsNoList) {
  for (const char* content : {"user,password\nroot,secret\n", "id,x,y,secret\n", "secret,id\n"}) {
    const std::string said = refusal_of_list(content);
    EXPECT_TRUE(says(said, "line 1: this is not the header"));
    for (const char* word : {"user", "password", "secret"}) {
      EXPECT_FALSE(says(said, word));
    }
  }
}

// Reading its own memory at address 0 fails: EIO.
TEST(LandmarkList, WhatCannotBeReadIsNoEnd) {
  const std::string said = [] {
    return pf_resampling::refusal([&] { read_landmark_list("/proc/self/mem", "map"); });
  }();
  EXPECT_TRUE(says(said, "cannot be read"));
}

}  // namespace
}  // namespace pf_resampling
