// In a file of its own, so that a fuzzer needs none but its own target.
#include "test/fuzz/fuzz_target.hpp"

namespace pf_resampling::fuzz {

const std::vector<Target>& targets() {
  static const std::vector<Target> kTargets = {{"map_file", map_file},
                                               {"beacon_mcl_messages", beacon_mcl_messages},
                                               {"fastslam_messages", fastslam_messages}};
  return kTargets;
}

}  // namespace pf_resampling::fuzz
