#include "research/studies/compensation_variants.hpp"

#include <algorithm>

#include "pf_resampling_core/error.hpp"
#include "src/configuration/configuration.hpp"

namespace pf_resampling {
namespace {

using Settings = std::map<std::string, std::string>;

const char* const kRenewal = "population/renewal";
const char* const kScheme = "population/resampling/scheme";
const char* const kWeightsAfterResampling = "population/resampling/weights_after";
const char* const kPairing = "population/compensation/pairing";
const char* const kRatio = "population/compensation/ratio";
const char* const kCovariance = "population/compensation/covariance";
const char* const kWeightsAfter = "population/compensation/weights_after";
const char* const kExcitation = "excitation/method";
const char* const kThreshold = "population/threshold";
const char* const kParticles = "particles";
const char* const kVersion = "version";

struct Ratio {
  const char* name;
  const char* value;
};
const std::vector<Ratio> kRatios = {{"10 %", "0.1"}, {"20 %", "0.2"}, {"50 %", "0.5"}, {"", "1"}};

Settings operator+(Settings settings, const Settings& more) {
  for (const auto& [name, value] : more) settings[name] = value;
  return settings;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) {
    if (!word.empty()) text += (text.empty() ? "" : " ") + word;
  }
  return text;
}

class Variants {
 public:
  void begin(const std::string& group) { group_ = group; }
  void add(const std::vector<std::string>& words, const Settings& settings) {
    all.push_back({joined(words), group_, settings});
  }

  std::vector<CompensationVariant> all;

 private:
  std::string group_;
};

const Settings kCompensation = {{kRenewal, "compensation"}};

void add_schemes(Variants* variants) {
  variants->begin("Resampling schemes");
  variants->add({"NR"}, {{kRenewal, "none"}});
  variants->add({"RSR"}, {});
  for (const auto& [name, scheme] :
       {std::make_pair("PR", "partial"), std::make_pair("RBR", "rank_based")}) {
    variants->add({name}, {{kScheme, scheme}});
    variants->add({name, "unbiased"}, {{kScheme, scheme}, {kWeightsAfterResampling, "unbiased"}});
  }
  for (const char* scheme : {"systematic", "residual_then_systematic", "stratified", "residual",
                             "multinomial", "ssp", "killing"}) {
    variants->add({scheme}, {{kScheme, scheme}});
  }
}

void add_compensations(Variants* variants) {
  variants->begin("Compensation: pairing and ratio");
  for (const char* pairing : {"rank", "random", "roulette"}) {
    const std::string word = pairing == std::string("rank") ? "" : pairing;
    for (const Ratio& ratio : kRatios) {
      variants->add({"compensation", word, ratio.name},
                    kCompensation + Settings{{kPairing, pairing}, {kRatio, ratio.value}});
    }
  }
  variants->begin("Compensation: covariances and weights");
  for (const Settings& kind :
       {Settings{{kCovariance, "moment_matched"}}, Settings{{kWeightsAfter, "pair_mean"}},
        Settings{{kCovariance, "moment_matched"}, {kWeightsAfter, "pair_mean"}}}) {
    std::vector<std::string> words = {"compensation"};
    for (const auto& setting : kind) words.push_back(setting.second);
    for (const Ratio& ratio : kRatios) {
      std::vector<std::string> name = words;
      name.emplace_back(ratio.name);
      variants->add(name, kCompensation + kind + Settings{{kRatio, ratio.value}});
    }
  }
}

void add_others(Variants* variants) {
  const std::vector<CompensationVariant> bases = {
      {"RSR", "", {}},
      {"compensation 20 %", "", kCompensation + Settings{{kRatio, "0.2"}}},
      {"compensation", "", kCompensation}};
  const auto add = [&](const char* base_name, const std::string& word, const Settings& settings) {
    const auto base = std::find_if(bases.begin(), bases.end(),
                                   [&](const auto& variant) { return variant.name == base_name; });
    variants->add({base->name, word}, base->settings + settings);
  };
  variants->begin("Excitation");
  for (const CompensationVariant& base : bases) {
    for (const char* excitation : {"gaussian", "regularized", "roughening"}) {
      add(base.name.c_str(), excitation, {{kExcitation, excitation}});
    }
  }
  variants->begin("Threshold");
  for (const char* base : {"RSR", "compensation"}) {
    for (const char* threshold : {"0.25", "0.5", "1"}) {
      add(base, std::string("T_N=") + threshold, {{kThreshold, threshold}});
    }
  }
  variants->begin("Particles");
  for (const char* base : {"RSR", "compensation"}) {
    for (const char* particles : {"10", "50", "500"}) {
      add(base, std::string("M=") + particles, {{kParticles, particles}});
    }
  }
  variants->begin("FastSLAM 1.0");
  for (const CompensationVariant& base : bases) {
    add(base.name.c_str(), "FastSLAM 1.0", {{kVersion, "fastslam_1"}});
  }
}

}  // namespace

const std::vector<CompensationVariant>& all_compensation_variants() {
  static const std::vector<CompensationVariant> all = [] {
    Variants variants;
    add_schemes(&variants);
    add_compensations(&variants);
    add_others(&variants);
    return variants.all;
  }();
  return all;
}

std::vector<CompensationVariant> compensation_variants(const std::vector<std::string>& names) {
  const std::vector<CompensationVariant>& all = all_compensation_variants();
  for (const std::string& name : names) {
    const bool known = std::any_of(all.begin(), all.end(),
                                   [&](const auto& variant) { return variant.name == name; });
    if (known) continue;
    std::string list;
    for (const CompensationVariant& variant : all) {
      list += (list.empty() ? "" : ", ") + variant.name;
    }
    throw Error("variant '" + name + "' is unknown; known: " + list);
  }
  std::vector<CompensationVariant> chosen;
  for (const CompensationVariant& variant : all) {
    if (std::find(names.begin(), names.end(), variant.name) != names.end()) {
      chosen.push_back(variant);
    }
  }
  return chosen;
}

FastSlamOptions options_of(const CompensationVariant& variant, const FastSlamOptions& base) {
  FastSlamOptions options = base;
  set_parameters(parameters_of(&options), variant.settings);
  return options;
}

FastSlamOptions kwak2008_options() {
  return fastslam_options_of("kwak2008");
}

}  // namespace pf_resampling
