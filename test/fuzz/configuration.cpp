// YAML configurations: refused in one line, or taken by both filters.
#include "src/configuration/configuration.hpp"

#include "beacon_mcl_node/pipeline_options.hpp"
#include "fastslam_node/pipeline_options.hpp"
#include "pf_resampling_core/error.hpp"
#include "test/fuzz/fuzz_target.hpp"
#include "test/fuzz/saved_text.hpp"

namespace pf_resampling::fuzz {
namespace {

template <typename Options>
void take(const Configuration& configuration) {
  try {
    Options options;
    apply(configuration, &options);
    validate(options.filter);
  } catch (const Error& error) {
    require_one_line(error);
  }
}

}  // namespace

void configuration(const std::uint8_t* bytes, std::size_t size) {
  try {
    const Configuration read = parse_configuration(text_of(bytes, size), "input");
    take<BeaconMclPipelineOptions>(read);
    take<FastSlamPipelineOptions>(read);
  } catch (const Error& error) {
    require_one_line(error);
  }
}

}  // namespace pf_resampling::fuzz
