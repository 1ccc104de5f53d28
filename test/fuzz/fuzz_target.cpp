#include "test/fuzz/fuzz_target.hpp"

#include <filesystem>
#include <limits>

#include "pf_resampling_core/test/temporary_directory.hpp"

namespace pf_resampling::fuzz {
namespace {

const TemporaryDirectory& scratch() {
  static const TemporaryDirectory directory;
  return directory;
}

}  // namespace

double Bytes::number() {
  using Limits = std::numeric_limits<double>;
  static const double kSpecial[] = {0.0,
                                    -0.0,
                                    1.0,
                                    -1.0,
                                    1e-9,
                                    1e-160,
                                    1e-300,
                                    Limits::denorm_min(),
                                    1e3,
                                    1e6,
                                    1e9,
                                    1e15,
                                    1e30,
                                    1e100,
                                    1e160,
                                    1e300,
                                    -1e6,
                                    -1e160,
                                    Limits::max(),
                                    Limits::lowest(),
                                    Limits::infinity(),
                                    -Limits::infinity(),
                                    Limits::quiet_NaN(),
                                    3.14159265358979323846};
  switch (below(4)) {
    case 0:
      return kSpecial[below(static_cast<int>(std::size(kSpecial)))];
    case 1:
      return raw<double>();
    default:
      return moderate();
  }
}

std::string file_of(const std::string& bytes, const std::string& name) {
  return scratch().write(name, bytes);
}

std::string new_file(const std::string& name) {
  std::filesystem::remove(scratch().file(name));
  return scratch().file(name);
}

}  // namespace pf_resampling::fuzz
