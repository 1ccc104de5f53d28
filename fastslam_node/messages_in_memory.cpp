#include "fastslam_node/messages_in_memory.hpp"

namespace pf_resampling {

void handle(const FastSlamMessage& message, FastSlamPipeline* pipeline) {
  std::visit([pipeline](const auto& pointer) { pipeline->handle(*pointer); }, message);
}

}  // namespace pf_resampling
