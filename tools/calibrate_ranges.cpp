// Fits scale, bias and noise of the ranges of a bag to its ground truth: what the filter needs to
// know of the radios where it is not to find out by itself.
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>

#include "pf_resampling_core/evaluation/range_calibration.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/bag_contents.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/files.hpp"
#include "tools/common/table.hpp"

namespace pf_resampling {
namespace {

CommandLine command_line() {
  CommandLine line("calibrate_ranges",
                   "Fits range = scale * distance + bias + noise, for each beacon and for all "
                   "together, to the ground truth of a bag.");
  line.positional("bag", "a bag with ranges, beacons and ground truth");
  line.option<std::string>(
      "output", "FILE",
      "write the calibration as YAML, for run_bag --config; by default it is printed");
  line.reads("bag");
  line.writes("output");
  line.flag("shared", "write one calibration for all beacons instead of one for each");
  line.topic("truth", "/ground_truth", "ground truth of the robot's base");
  line.topic("ranges", "/ranges", "ranges");
  line.topic("beacons", "/beacons", "positions of the beacons");
  line.option<std::string>("base", "FRAME", "base_link", "frame of the robot's base in /tf_static");
  line.option<std::string>(
      "antenna", "X,Y,Z", "positions of the antennas on the robot (m); by default from /tf_static");
  line.option<double>("outliers", "SIGMAS", 3.5,
                      "residuals above this many standard deviations count as outliers");
  line.example("calibrate_ranges plaza2.bag --output calibration.yaml");
  line.example("run_bag beacon_mcl plaza2.bag out.bag --config calibration.yaml");
  return line;
}

/// Ranges beside true distances, and why the others were not used.
struct Samples {
  std::vector<RangeSample> used;
  int not_positive = 0;  ///< or not finite
  int unknown_beacon = 0;
  int without_truth = 0;            ///< at a time that the truth does not cover
  int without_heading = 0;          ///< antenna off the centre, and nothing tells where to
  bool travel_for_heading = false;  ///< direction of travel taken for the heading
};

/// The truth with the direction of travel for a heading where it has none.
std::vector<TruePose> with_directions(std::vector<TruePose> truth) {
  const std::vector<std::optional<double>> directions = track_directions(truth);
  for (std::size_t i = 0; i < truth.size(); ++i) truth[i].heading = directions[i];
  return truth;
}

/// Where on the robot the antenna of a range sits.
class Antennas {
 public:
  Antennas(const rosbag::Bag& bag, const CommandLine& line) : base_(line.text("base")) {
    if (line.has("antenna")) {
      const std::vector<double> place = parse_numbers("antenna", line.text("antenna"), 3);
      given_ = Eigen::Vector3d(place[0], place[1], place[2]);
    } else {
      frames_ = read_frames_on_robot(bag, base_);
    }
  }

  Eigen::Vector3d place_of(const std::string& frame) const {
    if (given_) return *given_;
    if (frame.empty()) return Eigen::Vector3d::Zero();
    const auto found = frames_.find(frame);
    if (found != frames_.end()) return found->second.translation();
    std::string known;
    for (const auto& [name, transform] : frames_) known += (known.empty() ? "" : ", ") + name;
    throw Error("no transform from " + base_ + " to the ranges' frame '" + frame +
                "' in /tf_static, which has " + known + "; give its position with --antenna X,Y,Z");
  }

 private:
  std::string base_;
  std::optional<Eigen::Vector3d> given_;
  std::map<std::string, Eigen::Isometry3d> frames_;
};

Samples samples_of(const std::vector<StampedRange>& ranges, const std::vector<TruePose>& truth,
                   const std::map<int, Beacon>& beacons, const Antennas& antennas) {
  const std::vector<TruePose> path = with_directions(truth);
  const double max_gap = usual_max_gap(truth);
  bool headings_are_true = true;
  for (const TruePose& pose : truth) headings_are_true &= pose.heading.has_value();
  Samples samples;
  for (const StampedRange& range : ranges) {
    const Eigen::Vector3d antenna = antennas.place_of(range.frame);
    const bool off_centre = antenna.head<2>().norm() > 0.0;
    const auto beacon = beacons.find(range.beacon);
    const std::optional<TruePose> pose = interpolate(path, range.time, max_gap);
    if (!(std::isfinite(range.range) && range.range > 0.0)) {
      ++samples.not_positive;
    } else if (beacon == beacons.end()) {
      ++samples.unknown_beacon;
    } else if (!pose) {
      ++samples.without_truth;
    } else if (off_centre && !pose->heading) {
      ++samples.without_heading;
    } else {
      const Eigen::Rotation2Dd turn(pose->heading.value_or(0.0));
      Eigen::Vector3d place(pose->x, pose->y, antenna.z());
      place.head<2>() += turn * antenna.head<2>();
      Eigen::Vector3d offset = beacon->second.position - place;
      if (beacon->second.is_planar) offset.z() = 0.0;
      const double distance = offset.norm();
      samples.used.push_back({range.beacon, distance, range.range});
      samples.travel_for_heading |= off_centre && !headings_are_true;
    }
  }
  return samples;
}

std::string with_error(double value, double error, int decimals) {
  return fixed(value, decimals) + " ± " + fixed(error, decimals);
}

std::string name_of(const RangeFit& fit) {
  return fit.beacon == -1 ? "all" : std::to_string(fit.beacon);
}

void print_table(const std::vector<RangeFit>& fits) {
  Table table({"beacon", "ranges", "outliers", "distances (m)", "scale", "bias (m)", "sigma (m)"});
  for (const RangeFit& fit : fits) {
    if (fit.is_shared) {
      table.add_row(
          {name_of(fit), std::to_string(fit.samples), "-", "-", "as all", "as all", "as all"});
      continue;
    }
    table.add_row(
        {name_of(fit), std::to_string(fit.samples), std::to_string(fit.outliers),
         fixed(fit.least_distance, 1) + " to " + fixed(fit.greatest_distance, 1),
         fit.scale_is_fixed ? "1 (fixed)" : with_error(fit.calibration.scale, fit.scale_error, 4),
         with_error(fit.calibration.bias, fit.bias_error, 3), fixed(fit.calibration.sigma, 3)});
  }
  std::printf("%s\n", table.text().c_str());
}

void print_notes(const Samples& samples, const std::vector<RangeFit>& fits) {
  const auto note = [](int count, const char* why) {
    if (count > 0) std::printf("  %d ranges not used: %s\n", count, why);
  };
  note(samples.not_positive, "not a positive number");
  note(samples.unknown_beacon, "of beacons without a position");
  note(samples.without_truth, "at times without ground truth");
  note(samples.without_heading, "the antenna is off the robot's centre, and its heading unknown");
  if (samples.travel_for_heading) {
    std::printf(
        "  the truth has no heading: the direction of travel is used to place the antenna\n");
  }
  for (const RangeFit& fit : fits) {
    if (fit.is_shared) {
      std::printf("  beacon %s: too few ranges for values of its own\n", name_of(fit).c_str());
    } else if (fit.scale_is_fixed) {
      std::printf(
          "  beacon %s: its distances are too similar to tell scale from bias; scale fixed at 1\n",
          name_of(fit).c_str());
    }
  }
}

std::string to_yaml(const std::string& bag, const std::vector<RangeFit>& fits, bool shared) {
  std::string text = "# Written by calibrate_ranges, from " + bag +
                     ".\n# range = scale * distance + bias + noise of standard deviation sigma (m)."
                     "\n# beacon -1: every beacon that is not listed.\ncalibration:\n";
  for (const RangeFit& fit : fits) {
    if (shared && fit.beacon != -1) continue;
    const RangeCalibration& calibration = fit.calibration;
    text += "  - {beacon: " + std::to_string(fit.beacon) +
            ", scale: " + fixed(calibration.scale, 6) + ", bias: " + fixed(calibration.bias, 5) +
            ", sigma: " + fixed(calibration.sigma, 5) + "}\n";
  }
  return text;
}

int calibrate_ranges(const std::vector<std::string>& arguments) {
  CommandLine line = command_line();
  if (!line.parse(arguments)) return 0;
  const auto path = line.text("bag");
  const rosbag::Bag bag = open_bag(path);
  require_topics(bag, path,
                 {{line.topic("ranges"), recorded_range_types(), "--ranges"},
                  {line.topic("beacons"), {"pf_resampling/BeaconArray"}, "--beacons"},
                  {line.topic("truth"), truth_types(), "--truth"}});
  std::map<int, Beacon> beacons;
  for (const Beacon& beacon : read_beacons(bag, line.topic("beacons"))) beacons[beacon.id] = beacon;
  const Samples samples =
      samples_of(read_ranges(bag, line.topic("ranges")), read_truth(bag, line.topic("truth")),
                 beacons, Antennas(bag, line));
  RangeFitOptions options;
  options.outlier_threshold = line.get<double>("outliers");
  const std::vector<RangeFit> fits = fit_ranges_per_beacon(samples.used, options);

  std::printf("%s: range = scale * distance + bias + noise; ± one standard error\n\n",
              path.c_str());
  print_table(fits);
  print_notes(samples, fits);
  const std::string name = path.substr(path.find_last_of('/') + 1);
  const std::string yaml = to_yaml(name, fits, line.get<bool>("shared"));
  if (line.has("output")) {
    write_file(line.text("output"), yaml);
    std::printf("wrote %s\n", line.text("output").c_str());
  } else {
    std::printf("%s", yaml.c_str());
  }
  return 0;
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  return pf_resampling::run_tool("calibrate_ranges", argc, argv, pf_resampling::calibrate_ranges);
}
