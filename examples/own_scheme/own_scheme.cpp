// A resampling scheme of one's own: Metropolis resampling (Murray 2012), which never sums the
// weights, so that every slot can be drawn on a processor of its own.
#include "pf_resampling_core/strategy/resampling.hpp"

using namespace pf_resampling;

extern "C" void resampling_scheme(ConstArray weights, int size, const RandomStream& stream,
                                  MutableIndices counts) {
  const int steps = 50;
  for (int slot = 0; slot < size; ++slot) {
    Eigen::Index taken = slot % weights.size();
    for (int step = 0; step < steps; ++step) {
      const auto number = static_cast<std::uint64_t>(2 * (steps * slot + step));
      const auto other = static_cast<Eigen::Index>(stream.uniform(number) * double(weights.size()));
      if (stream.uniform(number + 1) * weights[taken] <= weights[other]) taken = other;
    }
    ++counts[taken];
  }
}
