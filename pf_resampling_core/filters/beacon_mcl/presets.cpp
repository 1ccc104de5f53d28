#include "pf_resampling_core/filters/beacon_mcl/presets.hpp"

namespace pf_resampling {
namespace {

// The particle filter of Mahmoud et al. (2012): it moves the particles, weighs them, resamples and
// excites them, and does nothing else. It starts from anywhere, injects no particles and estimates
// nothing while it runs, so it needs the calibration of the ranges. The paper states neither a
// number of particles nor the noise; it resamples always ("resampling is always necessary"), knows
// no outliers, and perturbs by a Gaussian of a width that it does not state.
const std::map<std::string, std::string> kMahmoud2012 = {
    {"particles", "1000"},
    {"population/schedule", "always"},
    {"population/tempering", "1"},
    {"population/renewal", "resampling"},
    {"population/resampling/scheme", "systematic"},
    {"excitation/method", "none"},
    {"excitation/bandwidth_scale", "1"},  // Silverman's own
    {"ranges/outlier_share", "0"},
    {"recovery/enabled", "false"},
    {"calibration/estimation", "off"},
    {"yaw_rate_bias/estimate", "false"},
    {"noise_estimation/ranges", "false"},
    {"noise_estimation/odometry", "false"},
    {"initialization/method", "uniform"}};

}  // namespace

const PresetList& beacon_mcl_presets() {
  static const PresetList presets = {
      {"fast", "resampling, the least computation", {}},
      {"balanced",
       "redraw, more accurate where wheels, antenna or a beacon are not as told",
       {{"population/renewal", "redraw"}}},
      {"mahmoud2012", "the filter of Mahmoud et al. (2012), which needs calibrated ranges",
       kMahmoud2012}};
  return presets;
}

BeaconMclOptions beacon_mcl_options_of(const std::string& preset) {
  BeaconMclOptions options;
  set_parameters(parameters_of(&options), preset_named(beacon_mcl_presets(), preset).values);
  return options;
}

}  // namespace pf_resampling
