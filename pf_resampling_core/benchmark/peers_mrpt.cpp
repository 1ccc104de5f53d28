#include <mrpt/bayes/CParticleFilterCapable.h>

#include "pf_resampling_core/benchmark/peers.hpp"

void mrpt_resample(MrptScheme scheme, const std::vector<double>& log_weights,
                   std::vector<std::size_t>* ancestors) {
  using Filter = mrpt::bayes::CParticleFilter;
  Filter::TParticleResamplingAlgorithm method = Filter::prSystematic;
  switch (scheme) {
    case MrptScheme::multinomial:
      method = Filter::prMultinomial;
      break;
    case MrptScheme::residual:
      method = Filter::prResidual;
      break;
    case MrptScheme::stratified:
      method = Filter::prStratified;
      break;
    case MrptScheme::systematic:
      break;
  }
  mrpt::bayes::CParticleFilterCapable::computeResampling(method, log_weights, *ancestors);
}
