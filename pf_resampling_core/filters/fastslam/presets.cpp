#include "pf_resampling_core/filters/fastslam/presets.hpp"

namespace pf_resampling {
namespace {

using Values = std::map<std::string, std::string>;

// Redraws need few particles: between two of them the cloud only has to stay where it is likely.
const Values kBalanced = {{"particles", "100"}, {"population/renewal", "redraw"}};

// FastSLAM as in Kwak, Kim and Lee (2008, section 4), where the odometry and the sensor have the
// noise of the world indoor_two_loops, and no gates and no excitation. It resamples with residual
// systematic resampling, as the paper does first.
const Values kKwak2008 = {
    {"particles", "100"},
    {"version", "fastslam_2"},
    {"population/schedule", "effective_sample_size"},
    {"population/threshold", "0.75"},  // T_N
    {"population/tempering", "1"},
    {"population/renewal", "resampling"},
    {"population/resampling/scheme", "residual_systematic"},
    {"population/resampling/inner_scheme", "systematic"},
    {"population/resampling/partial_high", "2"},  // the paper does not say what T_h and T_l are
    {"population/resampling/partial_low", "0.5"},
    {"population/resampling/rank_max", "1.5"},  // eta_max
    // "initialized with the same weight after resampling"
    {"population/resampling/weights_after", "reset"},
    {"population/compensation/pairing", "rank"},
    {"population/compensation/ratio", "1"},
    {"population/compensation/blend", "normalized"},
    {"population/compensation/covariance", "keep"},
    {"population/compensation/weights_after", "reset"},
    // Redraw is not the paper's; for comparison, with the noise as stated.
    {"population/redraw/learn_noise", "false"},
    {"excitation/method", "none"},
    {"odometry_errors/estimate", "false"},  // the odometry of the paper has none
    // White noise of 0.3 m/s and 3 degrees/s, drawn every 25 ms: times sqrt(0.025 s).
    {"odometry/along_per_time", "0.04743416"},
    {"odometry/heading_per_time", "0.00827882"},
    {"odometry/translation_per_distance", "0"},
    {"odometry/slip_per_distance", "0"},
    {"odometry/heading_per_distance", "0"},
    {"odometry/heading_per_angle", "0"},
    {"odometry/translation_per_time", "0"},
    {"sensor/range_sigma", "0.1"},
    {"sensor/range_sigma_share", "0"},
    {"sensor/bearing_sigma", "0.01745329"},  // 1 degree
    {"sensor/range_scale_sigma", "0"},       // the sensor of the paper has no lasting errors
    {"sensor/bearing_bias_sigma", "0"},
    {"association/method", "known"},
    {"association/gate", "1000000"},  // no gate
    {"association/new_landmark_gate", "1000000"},
};

}  // namespace

const PresetList& fastslam_presets() {
  static const PresetList presets = {
      {"fast", "resampling with 1000 particles, the least computation", {}},
      {"balanced", "redraw with 100 particles, a more accurate and more consistent map", kBalanced},
      {"kwak2008", "the filter of Kwak, Kim and Lee (2008)", kKwak2008}};
  return presets;
}

FastSlamOptions fastslam_options_of(const std::string& preset) {
  FastSlamOptions options;
  set_parameters(parameters_of(&options), preset_named(fastslam_presets(), preset).values);
  return options;
}

}  // namespace pf_resampling
