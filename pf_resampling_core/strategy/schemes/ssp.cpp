#include <algorithm>

#include "pf_resampling_core/strategy/schemes/schemes.hpp"

namespace pf_resampling {

// Srinivasan sampling process: Gerber, Chopin and Whiteley, "Negative association, ordering and
// convergence of resampling methods", Annals of Statistics 47(4), 2019, section 5.3.
//
// Every particle has the whole copies of M w; the fractions left over are settled two at a time. Of
// the two, one rises and the other falls by the same amount, until one of them is 0 or 1, which
// settles it; the other goes on to meet the next particle. Which rises is drawn such that both keep
// their means. Counts are floor or ceil of M w, as in systematic(), but for every order of the
// particles negatively associated. In integers the fraction that remains at the end is exactly 0,
// where the listing of the authors' Python package has to repair it.
void ssp(const ScaledWeights& weights, const ResamplingOptions&, const RandomStream& stream,
         ResamplingWorkspace* work, int* counts) {
  double* uniforms = grow(&work->uniforms, weights.size);
  stream.fill_uniform(0, weights.size, uniforms);
  const std::int64_t one = weights.one();
  std::int64_t scaled[kBlock];
  std::int64_t open = 0;  // the particle not yet settled, and its fraction
  std::int64_t open_fraction = 0;
  for (std::int64_t begin = 0; begin < weights.size; begin += kBlock) {
    const std::int64_t size = std::min(kBlock, weights.size - begin);
    weights.block(begin, size, scaled);
    for (std::int64_t i = 0; i < size; ++i) {
      const std::int64_t fresh = begin + i;
      const std::int64_t fresh_fraction = scaled[i] & (one - 1);
      counts[fresh] = static_cast<int>(scaled[i] >> weights.fraction_bits);
      const std::int64_t both = open_fraction + fresh_fraction;
      // Together less than a copy: one gets both fractions and the other nothing. Otherwise one
      // gets a copy and the other what is over.
      const bool full = both >= one;
      const std::int64_t fresh_chance = full ? one - open_fraction : fresh_fraction;
      const std::int64_t chances = full ? 2 * one - both : both;
      const bool fresh_rises =
          uniforms[fresh] * static_cast<double>(chances) < static_cast<double>(fresh_chance);
      const std::int64_t rises = fresh_rises ? fresh : open;
      const std::int64_t falls = fresh_rises ? open : fresh;
      counts[rises] += full ? 1 : 0;
      open = full ? falls : rises;
      open_fraction = full ? both - one : both;
    }
  }
}

}  // namespace pf_resampling
