// What the figures of a compensation study mean.
#include "compensation_study.hpp"

namespace pf_resampling {

std::string discussion_to_markdown(const CompensationStudy&) {
  return "";
}

}  // namespace pf_resampling
