#include "tools/datasets/mat_file.hpp"

#include <gtest/gtest.h>

#include <string>

#include "pf_resampling_core/error.hpp"
#include "test/mat_file_writer.hpp"
#include "test/temporary_directory.hpp"

namespace pf_resampling {
namespace {

using Writer = MatFileWriter;

std::string header(std::uint32_t flags, const std::string& name) {
  return Writer::element(6, Writer::integers({flags, 0})) +
         Writer::element(5, Writer::integers({1, 1})) + Writer::element(1, name);
}

// A cell holds matrices, which hold whatever they say: here a name of 2 GB.
TEST(MatFile, PassesOverVariablesThatNobodyAskedFor) {
  std::string inner = header(6, "four");
  inner.replace(32 + 4, 4, std::string("\0\0\xf0\x7f", 4));
  const TemporaryDirectory directory;
  const std::string path =
      directory.write("a.mat", Writer()
                                   .add_element(14, header(1, "C") + Writer::element(14, inner))
                                   .add("DR", {{1.0, 2.0}, {3.0, 4.0}, {5.0, 6.0}})
                                   .bytes());
  const MatFile file(path);
  EXPECT_EQ(file.names(), "C, DR");
  const auto matrix = file.matrix("DR", 2);
  ASSERT_TRUE(matrix.has_value());
  EXPECT_EQ(*matrix, (Eigen::MatrixXd(3, 2) << 1.0, 2.0, 3.0, 4.0, 5.0, 6.0).finished());
  EXPECT_FALSE(file.matrix("TD", 2).has_value());
  EXPECT_FALSE(file.matrix("four", 1).has_value());
}

TEST(MatFile, SaysWhichVariableIsNoRealMatrix) {
  const std::string number = Writer::element(9, std::string(8, '\0'));
  const TemporaryDirectory directory;
  const std::string path =
      directory.write("a.mat", Writer()
                                   .add_element(14, header(4, "text"))
                                   .add_element(14, header(6 | 0x800, "waves") + number + number)
                                   .bytes());
  const MatFile file(path);
  const struct {
    std::string name;
    std::string said;
  } cases[] = {{"text", " is not a matrix of numbers"}, {"waves", " is not a real matrix"}};
  for (const auto& test : cases) {
    try {
      file.matrix(test.name, 1);
      ADD_FAILURE() << test.name;
    } catch (const Error& error) {
      EXPECT_EQ(error.what(), path + ": variable " + test.name + test.said);
    }
  }
}

}  // namespace
}  // namespace pf_resampling
