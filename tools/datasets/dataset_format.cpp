#include "tools/datasets/dataset_format.hpp"

namespace pf_resampling {

double metres_per(const std::string& unit) {
  if (unit == "m") return 1.0;
  if (unit == "ft") return kMetresPerFoot;
  throw UsageError("--range-unit " + unit + ": known are m and ft");
}

}  // namespace pf_resampling
