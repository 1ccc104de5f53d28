// What `make fuzz` begins with, and all that it ever found: test/fuzz/corpora.
#include <gtest/gtest.h>

#include <filesystem>
#include <ostream>
#include <set>

#include "pf_resampling_core/filters/fastslam/saved_map.hpp"
#include "test/fuzz/fuzz_target.hpp"
#include "test/places.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {
namespace fuzz {

void PrintTo(const Target& target, std::ostream* stream) {
  *stream << target.name;
}

}  // namespace fuzz
namespace {

const std::filesystem::path kCorpora = std::filesystem::path(kSourceFolder) / "test/fuzz/corpora";

class FuzzCorpora : public testing::TestWithParam<fuzz::Target> {};

TEST_P(FuzzCorpora, NothingIsThrownAndAllHolds) {
  const fuzz::Target target = GetParam();
  std::set<std::filesystem::path> inputs;
  for (const auto& entry : std::filesystem::directory_iterator(kCorpora / target.name)) {
    inputs.insert(entry.path());
  }
  ASSERT_FALSE(inputs.empty());
  for (const std::filesystem::path& input : inputs) {
    const std::string bytes = read_file(input.string());
    EXPECT_NO_THROW(target.run(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()))
        << input.filename();
  }
}

std::string name_of(const testing::TestParamInfo<fuzz::Target>& target) {
  return target.param.name;
}
INSTANTIATE_TEST_SUITE_P(Of, FuzzCorpora, testing::ValuesIn(fuzz::targets()), name_of);

TEST(FuzzCorporaFolder, HoldsNothingButTheTargets) {
  std::set<std::string> folders;
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(kCorpora)) {
    if (entry.is_directory()) folders.insert(entry.path().filename().string());
  }
  for (const fuzz::Target& target : fuzz::targets()) names.insert(target.name);
  EXPECT_EQ(folders, names);
}

// A fuzzer that begins with what is refused in its first lines reaches little. If the format of
// files has changed, change these with it.
TEST(FuzzCorporaFolder, WholeMapsAreOfThePresentFormat) {
  EXPECT_NO_THROW(read_map_file((kCorpora / "map_file/whole").string()));
}

}  // namespace
}  // namespace pf_resampling
