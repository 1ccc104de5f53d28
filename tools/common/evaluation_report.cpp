#include "tools/common/evaluation_report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "pf_resampling_core/health/health.hpp"
#include "tools/common/text.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;

json to_json(const AbsoluteErrors& errors) {
  if (errors.count == 0) {
    return {{"mean", nullptr}, {"max", nullptr},    {"std", nullptr},
            {"rms", nullptr},  {"median", nullptr}, {"count", 0}};
  }
  return {{"mean", errors.mean}, {"max", errors.max},       {"std", errors.std},
          {"rms", errors.rms},   {"median", errors.median}, {"count", errors.count}};
}

json to_json(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? json(*value) : json(nullptr);
}

json to_json(const PathErrors& errors) {
  return {{"cross_track", to_json(errors.cross_track)},
          {"along_track", to_json(errors.along_track)},
          {"cartesian", to_json(errors.cartesian)},
          {"heading", to_json(errors.heading)},
          {"uncovered", errors.uncovered}};
}

json to_json(const MapErrors& errors) {
  return {{"rms", to_json(errors.rms)},
          {"rms_aligned", to_json(errors.rms_aligned)},
          {"landmarks", errors.landmarks},
          {"matched", errors.matched},
          {"false_landmarks", errors.false_landmarks},
          {"missed", errors.missed},
          {"matched_by", errors.matching == LandmarkMatching::id ? "id" : "nearest"},
          {"gate", errors.gate},
          {"coverage95", to_json(errors.coverage95)},
          {"normalized_error", to_json(errors.normalized_error)}};
}

json to_json(const FilterSummary& summary) {
  return {{"particles", summary.particles},
          {"updates", summary.updates},
          {"renewals", summary.renewals},
          {"weight_resets", summary.weight_resets},
          {"mean_effective_sample_size", summary.mean_effective_sample_size},
          {"mean_distinct_ancestors_of_renewal", summary.mean_ancestors_of_renewal},
          {"distinct_ancestors_since_start", summary.ancestors_since_start}};
}

json to_json(const HealthShares& health) {
  return {{"shares", health.shares},
          {"wrong_when_healthy", to_json(health.wrong_when_healthy)},
          {"several_places", health.several_places}};
}

json to_json(const RadioComparison& comparison) {
  json radios = json::array();
  for (const RadioKnowledge& radio : comparison.radios) {
    radios.push_back({{"beacon", radio.id},
                      {"scale", radio.calibration.scale},
                      {"bias", radio.calibration.bias}});
  }
  return {{"radios", radios},
          {"remarks", comparison.remarks},
          {"sigma", comparison.noise.range},
          {"translation_factor", comparison.noise.translation},
          {"heading_factor", comparison.noise.heading},
          {"yaw_rate_bias", comparison.yaw_rate_bias}};
}

json to_json(const BatchComparison& batch) {
  return {{"cartesian", to_json(batch.errors.cartesian)},
          {"cartesian_aligned", to_json(batch.aligned.cartesian)},
          {"map", batch.map ? to_json(*batch.map) : json(nullptr)},
          {"path_ratio", to_json(batch.path_ratio)},
          {"online_ratio", to_json(batch.online_ratio)},
          {"map_ratio", to_json(batch.map_ratio)},
          {"distance_scale", batch.distance_scale},
          {"yaw_scale", batch.yaw_scale},
          {"ranges", batch.radios ? to_json(*batch.radios) : json(nullptr)},
          {"observations", batch.observations},
          {"outliers", batch.outliers},
          {"ids", batch.has_ids_of_filter ? "filter" : "observations"}};
}

void add_cells(const AbsoluteErrors& errors, std::vector<std::string>* cells) {
  for (const double value : {errors.mean, errors.max, errors.std}) {
    cells->push_back(errors.count > 0 ? fixed(value, 3) : "-");
  }
}

std::string percent(const std::optional<double>& share) {
  return share ? fixed(100.0 * *share, 1) + " %" : "-";
}

std::string landmarks(int count) {
  return std::to_string(count) + (count == 1 ? " landmark" : " landmarks");
}

std::string metres(const std::optional<double>& value) {
  return value ? fixed(*value, 3) + " m" : "-";
}

void print(const MapErrors& map) {
  const std::string true_ones = std::to_string(map.matched + map.missed);
  std::printf("  map: %s, %d of %s true ones found (by %s), %d false\n",
              landmarks(map.landmarks).c_str(), map.matched, true_ones.c_str(),
              map.matching == LandmarkMatching::id ? "id" : "nearest", map.false_landmarks);
  std::printf("  map's RMS error:                           %s, aligned %s\n",
              metres(map.rms).c_str(), metres(map.rms_aligned).c_str());
  if (map.coverage95) {
    std::printf("  true landmarks inside their 95 %% ellipses: %s (NEES %s, 2 if consistent)\n",
                percent(map.coverage95).c_str(), fixed(*map.normalized_error, 1).c_str());
  }
}

void print(const FilterSummary& filter) {
  std::printf(
      "  %d particles: effective %.1f on average, distinct ancestors %.1f per renewal, %d since "
      "the "
      "start\n",
      filter.particles, filter.mean_effective_sample_size, filter.mean_ancestors_of_renewal,
      filter.ancestors_since_start);
  std::printf("  updates / renewals of the population:      %llu / %llu\n",
              static_cast<unsigned long long>(filter.updates),
              static_cast<unsigned long long>(filter.renewals));
  for (const FindingStatus& finding : filter.findings) {
    std::printf("  found: %s (%s)\n", finding.text.c_str(), percent(finding.probability).c_str());
  }
}

/// The largest share first.
void print(const HealthShares& health) {
  std::vector<std::pair<double, std::string>> said;
  for (const auto& [name, share] : health.shares) said.emplace_back(share, name);
  std::sort(said.rbegin(), said.rend());
  std::string text;
  for (const auto& [share, name] : said) {
    text += (text.empty() ? "" : ", ") + name + " " + percent(share);
  }
  std::printf("  health as reported by the filter:          %s\n", text.c_str());
  if (health.wrong_when_healthy) {
    std::printf("  healthy, but truth outside 3-sigma region: %s of that time\n",
                percent(health.wrong_when_healthy).c_str());
  }
  if (health.several_places > 0.0) {
    std::printf("  several places fitted (status.hypotheses): %s\n",
                percent(health.several_places).c_str());
  }
}

void print(const BatchComparison& batch) {
  std::printf("  batch solution of the same data:           path ");
  // Ranges say where the path lies; where landmarks have it is chance.
  if (batch.radios) std::printf("%s, ", metres(batch.errors.cartesian.mean).c_str());
  std::printf("aligned %s", metres(batch.aligned.cartesian.mean).c_str());
  if (batch.map) std::printf(", map aligned %s", metres(batch.map->rms_aligned).c_str());
  if (batch.has_ids_of_filter) std::printf("; ids: those of the filter's landmarks");
  const auto text_of = [](const std::optional<double>& ratio) {
    return ratio ? fixed(*ratio, 2) : std::string("-");
  };
  std::printf("\n  filter error over batch error (aligned):   path %s, poses as given %s",
              text_of(batch.path_ratio).c_str(), text_of(batch.online_ratio).c_str());
  if (batch.map_ratio) std::printf(", map %s", fixed(*batch.map_ratio, 2).c_str());
  std::printf("\n");
  if (batch.radios) {
    const RangeNoise& noise = batch.radios->noise;
    std::printf("  it found: ranges to %s, odometry's noise x %s (distance), x %s (heading);",
                metres(noise.range).c_str(), fixed(noise.translation, 2).c_str(),
                fixed(noise.heading, 2).c_str());
    for (const RadioKnowledge& radio : batch.radios->radios) {
      std::printf(" %d: %s d %+.2f m;", radio.id, fixed(radio.calibration.scale, 3).c_str(),
                  radio.calibration.bias);
    }
    std::printf(" yaw rate %+.1e rad/s, distance x %s\n", batch.radios->yaw_rate_bias,
                fixed(batch.distance_scale, 3).c_str());
    for (const std::string& remark : batch.radios->remarks) {
      std::printf("  %s.\n", remark.c_str());
    }
  }
  if (batch.online) {
    const OnlineBound& online = *batch.online;
    std::printf("  on-line bound (%d solutions, %d refused):  as given %s, aligned %s\n",
                online.solutions, online.refused, metres(online.errors.cartesian.mean).c_str(),
                metres(online.aligned.cartesian.mean).c_str());
    std::printf("  filter error over the on-line bound:       as given %s, aligned %s\n",
                text_of(online.ratio).c_str(), text_of(online.aligned_ratio).c_str());
  }
}

void print_heading(const std::string& bag, const Evaluation& evaluation) {
  const PathErrors& estimate = evaluation.estimate;
  const double clip = evaluation.clip;
  std::printf("%s: %d true poses in %.1f s", bag.c_str(), estimate.truth_poses, estimate.duration);
  if (clip > 0.0) std::printf(", the first %g %% left out", 100.0 * clip);
  std::printf("; errors are absolute values\n");
  if (evaluation.frame == "start") {
    std::printf(
        "  (the filter has a frame of its own, aligned with the truth at the first true pose)\n");
  } else if (evaluation.frame == "fit") {
    std::printf(
        "  (the filter has a frame of its own, aligned with the truth by the best rigid fit)\n");
  } else if (evaluation.filter && !evaluation.filter->map_file.empty()) {
    std::printf(
        "  (the frame is that of the loaded map, %s; if that is not the truth's: --frame fit)\n",
        evaluation.filter->map_file.c_str());
  }
  std::printf("\n");
}

/// The first `count` cells of a row of the table.
void print_row(const std::vector<std::string>& cells, std::size_t count) {
  constexpr int kWidths[] = {-22, 13, 7, 7, 19, 7, 7};
  std::printf("  ");
  for (std::size_t i = 0; i < count; ++i) {
    std::printf("%*s%s", kWidths[i], cells[i].c_str(), i + 1 < count ? "  " : "\n");
  }
}

void print_table(const Evaluation& evaluation) {
  const std::optional<PathErrors>& dead_reckoning = evaluation.dead_reckoning;
  print_row({"", "estimate mean", "max", "std", "dead reckoning mean", "max", "std"},
            dead_reckoning ? 7 : 4);
  const auto add_row = [&](const char* name, AbsoluteErrors PathErrors::*errors) {
    std::vector<std::string> cells = {name};
    add_cells(evaluation.estimate.*errors, &cells);
    if (dead_reckoning) add_cells((*dead_reckoning).*errors, &cells);
    print_row(cells, cells.size());
  };
  add_row("cross-track (m)", &PathErrors::cross_track);
  add_row("along-track (m)", &PathErrors::along_track);
  add_row("Cartesian (m)", &PathErrors::cartesian);
  add_row("heading (rad)", &PathErrors::heading);
  if (evaluation.is_slam) {
    std::vector<std::string> cells = {"Cartesian, aligned (m)"};
    add_cells(evaluation.estimate_aligned.cartesian, &cells);
    if (evaluation.dead_reckoning_aligned) {
      add_cells(evaluation.dead_reckoning_aligned->cartesian, &cells);
    }
    print_row(cells, cells.size());
  }
  std::printf("\n");
}

/// Whether the filter's own confidence is right, and how well it keeps to the truth.
void print_belief(const Evaluation& evaluation) {
  const PathErrors& estimate = evaluation.estimate;
  std::printf("  truth inside the filter's own 95 %% region: %s of the time (with heading: %s)\n",
              percent(estimate.coverage95).c_str(), percent(estimate.coverage95_pose).c_str());
  std::printf("  truth inside its 3-sigma region:           %s of the time\n",
              percent(estimate.coverage_3sigma).c_str());
  // A map's own frame may lie askew, and before its first loop is closed a robot cannot know.
  if (evaluation.frame == "given") {
    const std::string after =
        estimate.converged_after ? fixed(*estimate.converged_after, 1) + " s" : "never";
    std::printf(
        "  time to converge:                          %s (errors stay below %.2f m and %.0f "
        "degrees)\n",
        after.c_str(), estimate.lost_error, kLostHeading * 180.0 / kPi);
    std::printf(
        "  lost:                                      %s (error above that %s of the time)\n",
        estimate.lost ? "yes" : "no", percent(estimate.lost_share).c_str());
  }
  if (estimate.uncovered > 0) {
    std::printf("  true poses without an estimate:            %d of %d\n", estimate.uncovered,
                estimate.truth_poses);
  }
  if (evaluation.is_slam) {
    std::printf("  median distance to the truth:              %s, aligned %s\n",
                metres(estimate.cartesian.median).c_str(),
                metres(evaluation.estimate_aligned.cartesian.median).c_str());
  }
  if (evaluation.path_aligned) {
    std::printf("  the path as believed at the end, aligned:  mean %s, max %s\n",
                metres(evaluation.path_aligned->cartesian.mean).c_str(),
                metres(evaluation.path_aligned->cartesian.max).c_str());
  }
}

}  // namespace

std::optional<HealthShares> health_shares(const std::vector<StampedHealth>& said,
                                          const PathErrors& errors) {
  if (said.empty()) return std::nullopt;
  HealthShares health;
  int poses = 0;
  int healthy = 0;
  int wrong = 0;
  std::size_t next = 0;
  for (const PathErrorSample& sample : errors.samples) {
    while (next < said.size() && said[next].time <= sample.time) ++next;
    if (sample.is_clipped) continue;
    const std::string name = next == 0 ? to_string(Health::starting) : said[next - 1].health;
    ++poses;
    health.shares[name] += 1.0;
    if (next > 0 && said[next - 1].places > 1) health.several_places += 1.0;
    if (name != to_string(Health::healthy)) continue;
    ++healthy;
    if (!(sample.normalized_squared <= kThreeSigmaSquared)) ++wrong;
  }
  for (auto& entry : health.shares) entry.second /= poses;
  health.several_places /= std::max(poses, 1);
  if (healthy > 0 && errors.coverage_3sigma) {
    health.wrong_when_healthy = static_cast<double>(wrong) / healthy;
  }
  return health;
}

nlohmann::json to_json(const std::vector<FindingStatus>& findings) {
  json list = json::array();
  for (const FindingStatus& finding : findings) {
    list.push_back({{"kind", finding.kind},
                    {"id", finding.id},
                    {"begin", finding.begin.toSec()},
                    {"end", finding.end.toSec()},
                    {"place", {finding.place.x, finding.place.y}},
                    {"size", finding.size},
                    {"sigma", finding.sigma},
                    {"probability", finding.probability},
                    {"open", static_cast<bool>(finding.open)},
                    {"text", finding.text}});
  }
  return list;
}

nlohmann::json to_json(const Evaluation& evaluation) {
  const PathErrors& estimate = evaluation.estimate;
  json result = {{"clip", evaluation.clip},
                 {"duration", estimate.duration},
                 {"truth_poses", estimate.truth_poses},
                 {"lost_error", estimate.lost_error},
                 {"frame", evaluation.frame},
                 {"estimate", to_json(estimate)}};
  json& part = result["estimate"];
  // These belong to the estimate; they stand at the top level as well.
  for (json* place : {&part, &result}) {
    (*place)["coverage95"] = to_json(estimate.coverage95);
    (*place)["converged_after"] = to_json(estimate.converged_after);
    (*place)["lost"] = estimate.lost;
    (*place)["lost_share"] = estimate.lost_share;
  }
  part["coverage95_pose"] = to_json(estimate.coverage95_pose);
  part["coverage_3sigma"] = to_json(estimate.coverage_3sigma);
  part["normalized_error"] = to_json(estimate.normalized_error);
  part["cartesian_aligned"] = to_json(evaluation.estimate_aligned.cartesian);
  if (evaluation.path_aligned) {
    part["path_aligned"] = to_json(evaluation.path_aligned->cartesian);
  }
  result["dead_reckoning"] =
      evaluation.dead_reckoning ? to_json(*evaluation.dead_reckoning) : json(nullptr);
  if (evaluation.dead_reckoning_aligned) {
    result["dead_reckoning"]["cartesian_aligned"] =
        to_json(evaluation.dead_reckoning_aligned->cartesian);
  }
  if (evaluation.map) result["map"] = to_json(*evaluation.map);
  if (evaluation.filter) {
    result["filter"] = to_json(*evaluation.filter);
    result["findings"] = to_json(evaluation.filter->findings);
  }
  if (evaluation.health) result["health"] = to_json(*evaluation.health);
  if (evaluation.batch) {
    result["batch"] = to_json(*evaluation.batch);
    if (evaluation.batch->online) {
      const OnlineBound& online = *evaluation.batch->online;
      result["batch"]["online"] = {{"cartesian", to_json(online.errors.cartesian)},
                                   {"cartesian_aligned", to_json(online.aligned.cartesian)},
                                   {"ratio", to_json(online.ratio)},
                                   {"aligned_ratio", to_json(online.aligned_ratio)},
                                   {"solutions", online.solutions},
                                   {"refused", online.refused}};
    }
    result["batch_ratio"] = to_json(evaluation.batch->path_ratio);
  }
  return result;
}

void print(const std::string& bag, const Evaluation& evaluation) {
  print_heading(bag, evaluation);
  print_table(evaluation);
  print_belief(evaluation);
  if (evaluation.map) print(*evaluation.map);
  if (evaluation.filter) print(*evaluation.filter);
  if (evaluation.health) print(*evaluation.health);
  if (evaluation.batch) print(*evaluation.batch);
}

}  // namespace pf_resampling
