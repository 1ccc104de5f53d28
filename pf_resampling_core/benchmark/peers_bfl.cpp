#include <bfl/pdf/mcpdf.h>

#include <list>

#include "pf_resampling_core/benchmark/peers.hpp"

struct BflResampling::Implementation {
  explicit Implementation(unsigned int size) : pdf(size), samples(size) {}

  BFL::MCPdf<int> pdf;
  std::vector<BFL::Sample<int>> samples;
};

BflResampling::BflResampling(const std::vector<double>& weights)
    : implementation_(new Implementation(static_cast<unsigned int>(weights.size()))) {
  std::vector<BFL::WeightedSample<int>> samples;
  samples.reserve(weights.size());
  for (std::size_t i = 0; i < weights.size(); ++i) {
    BFL::WeightedSample<int> sample;
    sample.ValueSet(static_cast<int>(i));
    sample.WeightSet(weights[i]);
    samples.push_back(sample);
  }
  implementation_->pdf.ListOfSamplesSet(samples);
}

BflResampling::~BflResampling() = default;

void BflResampling::resample() {
  implementation_->pdf.SampleFrom(implementation_->samples,
                                  static_cast<int>(implementation_->samples.size()), RIPLEY, NULL);
}
