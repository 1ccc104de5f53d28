// Judges a run of a filter by the ground truth in the same bag: errors as in paper M, section IV,
// beside those of dead reckoning, whether the filter's own confidence is right, and a picture.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/bag.hpp"
#include "common/bag_contents.hpp"
#include "common/command_line.hpp"
#include "common/files.hpp"
#include "common/plot_paths.hpp"
#include "common/table.hpp"
#include "pf_resampling_core/evaluation/path_errors.hpp"

namespace pf_resampling {
namespace {

using nlohmann::json;
namespace po = boost::program_options;

CommandLine command_line() {
  CommandLine line("evaluate_bag",
                   "Errors of an estimated path against the ground truth in the same bag.");
  line.positional("bag", "what run_bag or beacon_mcl.launch recorded");
  line.options()("clip", po::value<double>()->default_value(0.0)->value_name("SHARE"),
                 "share of the time, from the start, left out of the errors; in [0, 1)")(
      "json", po::value<std::string>()->value_name("FILE"), "write the figures as JSON")(
      "plot", po::value<std::string>()->value_name("FILE"),
      "draw paths and errors (.png, .pdf or .svg); without ground truth the paths alone")(
      "truth", po::value<std::string>()->default_value("/ground_truth")->value_name("TOPIC"),
      "ground truth: PoseStamped, PointStamped, Odometry or PoseWithCovarianceStamped")(
      "pose", po::value<std::string>()->default_value("/pose")->value_name("TOPIC"),
      "estimate: PoseWithCovarianceStamped, Odometry or PoseStamped")(
      "odom", po::value<std::string>()->default_value("/odom")->value_name("TOPIC"),
      "dead reckoning; 'none' leaves it out")(
      "beacons", po::value<std::string>()->default_value("/beacons")->value_name("TOPIC"),
      "beacons, for the picture")(
      "lost-error", po::value<double>()->default_value(0.0)->value_name("METRES"),
      "error above which the robot is lost; 0: 0.2 m + 3 % of the extent of the true path")(
      "max-gap", po::value<double>()->default_value(0.0)->value_name("SECONDS"),
      "longest gap of the estimate to interpolate across; 0: three median intervals, at least 1 s")(
      "quiet", po::bool_switch(), "print nothing");
  line.example("evaluate_bag out.bag --clip 0.2 --json out.json --plot out.png");
  return line;
}

json to_json(const AbsoluteErrors& errors) {
  if (errors.count == 0) {
    return {{"mean", nullptr}, {"max", nullptr}, {"std", nullptr}, {"rms", nullptr}, {"count", 0}};
  }
  return {{"mean", errors.mean},
          {"max", errors.max},
          {"std", errors.std},
          {"rms", errors.rms},
          {"count", errors.count}};
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

// coverage95, converged_after and lost belong to the estimate; they stand at the top level as well.
json report(const PathErrors& estimate, const std::optional<PathErrors>& dead_reckoning,
            double clip) {
  json result = {{"clip", clip},
                 {"duration", estimate.duration},
                 {"truth_poses", estimate.truth_poses},
                 {"lost_error", estimate.lost_error},
                 {"estimate", to_json(estimate)}};
  json& part = result["estimate"];
  for (json* place : {&part, &result}) {
    (*place)["coverage95"] = to_json(estimate.coverage95);
    (*place)["converged_after"] = to_json(estimate.converged_after);
    (*place)["lost"] = estimate.lost;
  }
  part["lost_share"] = estimate.lost_share;
  part["coverage95_pose"] = to_json(estimate.coverage95_pose);
  part["coverage_3sigma"] = to_json(estimate.coverage_3sigma);
  part["normalized_error"] = to_json(estimate.normalized_error);
  result["dead_reckoning"] = dead_reckoning ? to_json(*dead_reckoning) : json(nullptr);
  return result;
}

void add_cells(const AbsoluteErrors& errors, std::vector<std::string>* cells) {
  for (const double value : {errors.mean, errors.max, errors.std}) {
    cells->push_back(errors.count > 0 ? fixed(value, 3) : "-");
  }
}

std::string percent(const std::optional<double>& share) {
  return share ? fixed(100.0 * *share, 1) + " %" : "-";
}

void print(const std::string& bag, const PathErrors& estimate,
           const std::optional<PathErrors>& dead_reckoning, double clip) {
  std::printf("%s: %d true poses in %.1f s", bag.c_str(), estimate.truth_poses, estimate.duration);
  if (clip > 0.0) std::printf(", the first %g %% left out", 100.0 * clip);
  std::printf("; errors are absolute values\n\n");

  std::vector<std::string> headings = {"", "estimate mean", "max", "std"};
  if (dead_reckoning) headings.insert(headings.end(), {"dead reckoning mean", "max", "std"});
  Table table(headings);
  const auto add_row = [&](const char* name, AbsoluteErrors PathErrors::*errors) {
    std::vector<std::string> cells = {name};
    add_cells(estimate.*errors, &cells);
    if (dead_reckoning) add_cells((*dead_reckoning).*errors, &cells);
    table.add_row(cells);
  };
  add_row("cross-track (m)", &PathErrors::cross_track);
  add_row("along-track (m)", &PathErrors::along_track);
  add_row("Cartesian (m)", &PathErrors::cartesian);
  add_row("heading (rad)", &PathErrors::heading);
  std::printf("%s\n", table.text().c_str());

  std::printf("  truth inside the filter's own 95 %% region: %s of the time (with heading: %s)\n",
              percent(estimate.coverage95).c_str(), percent(estimate.coverage95_pose).c_str());
  std::printf("  truth inside its 3-sigma region:           %s of the time\n",
              percent(estimate.coverage_3sigma).c_str());
  const std::string after =
      estimate.converged_after ? fixed(*estimate.converged_after, 1) + " s" : "never";
  std::printf("  time to converge:                          %s (error stays below %.2f m)\n",
              after.c_str(), estimate.lost_error);
  std::printf("  lost:                                      %s (error above that %s of the time)\n",
              estimate.lost ? "yes" : "no", percent(estimate.lost_share).c_str());
  if (estimate.uncovered > 0) {
    std::printf("  true poses without an estimate:            %d of %d\n", estimate.uncovered,
                estimate.truth_poses);
  }
}

bool has_topic(const rosbag::Bag& bag, const std::string& name) {
  const std::vector<BagTopic> topics = topics_of(bag);
  return std::any_of(topics.begin(), topics.end(),
                     [&](const BagTopic& topic) { return topic.name == name; });
}

/// The estimate after its first fifth, standing in for a truth that is not there: it tells where to
/// begin dead reckoning.
std::vector<TruePose> reference_of(const std::vector<EstimatedPose>& estimate) {
  std::vector<TruePose> reference;
  for (std::size_t i = estimate.size() / 5; i < estimate.size(); ++i) {
    const EstimatedPose& pose = estimate[i];
    reference.push_back({pose.time, pose.pose.x, pose.pose.y, pose.pose.heading});
  }
  return reference;
}

int evaluate_bag(const std::vector<std::string>& arguments) {
  CommandLine line = command_line();
  if (!line.parse(arguments)) return 0;
  const auto path = line.get<std::string>("bag");
  const auto topic = [&](const char* option) {
    return absolute_topic(line.get<std::string>(option));
  };
  const bool with_odometry = line.get<std::string>("odom") != "none";
  PathErrorOptions options;
  options.clip = line.get<double>("clip");
  options.lost_error = line.get<double>("lost-error");
  options.max_gap = line.get<double>("max-gap");
  check_options(options);
  if (line.has("plot")) check_plot_file(line.get<std::string>("plot"));

  const rosbag::Bag bag = open_bag(path);
  std::vector<NeededTopic> needed = {{topic("pose"), pose_types(), "--pose"}};
  if (with_odometry) needed.push_back({topic("odom"), pose_types(), "--odom"});
  const bool paths_alone = line.has("plot") && !line.has("json") && !has_topic(bag, topic("truth"));
  if (!paths_alone) needed.push_back({topic("truth"), truth_types(), "--truth"});
  require_topics(bag, path, needed);

  PathPlot plot;
  plot.title = path;
  plot.estimate = read_poses(bag, topic("pose"));
  plot.beacons = read_beacons(bag, topic("beacons"));
  if (with_odometry) plot.dead_reckoning = read_poses(bag, topic("odom"));
  if (paths_alone) {
    if (with_odometry) {
      plot.dead_reckoning = align_at_start(plot.dead_reckoning, reference_of(plot.estimate));
    }
    if (!line.get<bool>("quiet")) {
      std::printf("%s: no %s, so no errors: the paths alone are drawn\n", path.c_str(),
                  topic("truth").c_str());
    }
    plot_paths(plot, line.get<std::string>("plot"));
    return 0;
  }

  plot.truth = truth_while_recording(read_truth(bag, topic("truth")), plot.dead_reckoning);
  plot.errors = evaluate_path(plot.truth, plot.estimate, options);
  if (with_odometry) {
    plot.dead_reckoning = align_at_start(plot.dead_reckoning, plot.truth);
    plot.dead_reckoning_errors = evaluate_path(plot.truth, plot.dead_reckoning, options);
  }
  if (!line.get<bool>("quiet")) {
    print(path, *plot.errors, plot.dead_reckoning_errors, options.clip);
  }
  if (line.has("json")) {
    const json result = report(*plot.errors, plot.dead_reckoning_errors, options.clip);
    write_file(line.get<std::string>("json"), result.dump(2) + "\n");
  }
  if (line.has("plot")) plot_paths(plot, line.get<std::string>("plot"));
  return 0;
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  return pf_resampling::run_tool("evaluate_bag", argc, argv, pf_resampling::evaluate_bag);
}
