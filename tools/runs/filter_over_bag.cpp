#include "tools/runs/filter_over_bag.hpp"

#include <rosbag/view.h>
#include <sys/resource.h>
#include <tf2_msgs/TFMessage.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>

#include "src/diagnostics/diagnostics.hpp"
#include "src/messages/conversions.hpp"
#include "tools/common/files.hpp"

namespace pf_resampling {
namespace {

/// Topics that a filter writes. Those of an earlier run in the bag are left out.
const std::set<std::string> kOutputTopics = {"/pose",        "/path",         "/particlecloud",
                                             "/particles",   "/markers",      "/status",
                                             "/diagnostics", "/landmark_map", "/beacon_map"};

double cpu_seconds(const rusage& usage) {
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

/// As in FilterStatus; times in s.
nlohmann::json to_json(const std::vector<FindingStatus>& findings) {
  nlohmann::json list = nlohmann::json::array();
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

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string in_path_of(const CommandLine& line) {
  for (const char* bag : {"in.bag", "out.bag"}) {
    if (!line.has(bag)) throw UsageError(std::string(bag) + " is missing; see run_bag --help");
  }
  return line.text("in.bag");
}

/// The values of an option that may be repeated.
std::vector<std::string> all_of(const std::string& option, const CommandLine& line) {
  if (!line.has(option)) return {};
  return line.get<std::vector<std::string>>(option);
}

}  // namespace

FilterOverBag::FilterOverBag(const CommandLine& line)
    : line_(line),
      in_path_(in_path_of(line)),
      in_(open_bag(in_path_)),
      writer_(line.text("out.bag")),
      wall_start_(wall_seconds()) {
  for (const std::string& path : all_of("more", line)) {
    more_.emplace_back(new rosbag::Bag(open_bag(path)));  // a bag that is moved cannot be read
  }
  if (line.has("start")) start_ = line.get<double>("start");
  if (line.has("duration")) duration_ = line.get<double>("duration");
  for (const std::string& topic : all_of("topics", line)) {
    topics_.insert(topic.rfind('/', 0) == 0 ? topic : "/" + topic);
  }
  rosbag::View view(in_);
  begin_ = view.getBeginTime();
  is_flight_ = rosbag::View(in_, rosbag::TopicQuery(kStepTopic)).size() > 0;
  if (line.get<bool>("no-clouds")) outputs_ = Outputs::no_clouds;
  if (line.get<bool>("pose-only")) outputs_ = Outputs::pose_only;
}

void FilterOverBag::connect(PipelineSinks* sinks) {
  sinks->pose = [this](const geometry_msgs::PoseWithCovarianceStamped& message) {
    ++poses_;
    note_pose(message.header.stamp, to_pose2(message.pose.pose));
    writer_.write("/pose", now_, message);
  };
  sinks->transform = [this](const geometry_msgs::TransformStamped& transform) {
    tf2_msgs::TFMessage message;
    message.transforms.push_back(transform);
    writer_.write("/tf", now_, message);
  };
  sinks->log = [this](LogLevel, const std::string& text) { log_.push_back(text); };
  const auto into = [this](const char* topic) {
    return [this, topic](const auto& message) { writer_.write(topic, now_, message); };
  };
  if (with_status()) {
    sinks->status = into("/status");
    sinks->diagnostics = into("/diagnostics");
  }
  if (with_pictures()) {
    sinks->path = into("/path");
    sinks->particlecloud = into("/particlecloud");
    sinks->particles = into("/particles");
    sinks->markers = into("/markers");
  }
}

void FilterOverBag::for_each_in_bag(
    const std::vector<std::string>& order, const FrameNames& frames,
    const std::function<void(const rosbag::MessageInstance&)>& take) {
  std::vector<const rosbag::Bag*> bags = {&in_};
  for (const auto& bag : more_) bags.push_back(bag.get());
  rosbag::View view;
  for (const rosbag::Bag* bag : bags) view.addQuery(*bag);
  begin_ = view.getBeginTime();
  // Differences of stamps that are far apart have no room in a duration of ROS.
  const double all = view.getEndTime().toSec() - begin_.toSec();
  recorded_ = std::max(0.0, std::min(all - start_, duration_));
  for_each_in_order(bags, in_path_, order, [&](const rosbag::MessageInstance& message) {
    if (!is_wanted(message)) return;
    now_ = message.getTime();
    copy_input(message, frames);
    take(message);
    writer_.check();  // a pipeline lets no exception out
  });
}

/// What was said once, before the part that is wanted, is wanted, too.
bool FilterOverBag::is_wanted(const rosbag::MessageInstance& message) const {
  if (!topics_.empty() && topics_.count(message.getTopic()) == 0) return false;
  const double time = message.getTime().toSec() - begin_.toSec();
  if (time >= start_) return time <= start_ + duration_;
  const auto header = message.getConnectionHeader();
  const auto latching = header->find("latching");
  return message.getTopic() == "/tf_static" ||
         (latching != header->end() && latching->second == "1");
}

void FilterOverBag::write_beacons(const std::string& topic, BeaconArray beacons) {
  left_out_ = topic;
  beacons.header.stamp = begin_;
  writer_.write_latched(topic, begin_, beacons);
}

/// Copies an input message; what an earlier run of the filter wrote is left out.
void FilterOverBag::copy_input(const rosbag::MessageInstance& message, const FrameNames& frames) {
  if (kOutputTopics.count(message.getTopic()) > 0 || message.getTopic() == left_out_) return;
  if (message.getTopic() == "/tf") {
    const auto transforms = message_in<tf2_msgs::TFMessage>(message);
    if (transforms) {
      tf2_msgs::TFMessage kept;
      for (const geometry_msgs::TransformStamped& transform : transforms->transforms) {
        if (without_slash(transform.child_frame_id) != frames.odom) {
          kept.transforms.push_back(transform);
        }
      }
      if (kept.transforms.size() != transforms->transforms.size()) {
        if (!kept.transforms.empty()) writer_.write("/tf", message.getTime(), kept);
        return;
      }
    }
  }
  writer_.copy(message);
}

void FilterOverBag::write_texts(const std::vector<FindingStatus>& findings) const {
  if (line_.has("tum")) write_file(line_.text("tum"), path_text_);
  if (line_.has("findings")) write_file(line_.text("findings"), to_json(findings).dump(2) + "\n");
}

void FilterOverBag::note_pose(ros::Time stamp, const Pose2& pose) {
  if (!line_.has("tum")) return;
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(), "%u.%09u %.6f %.6f 0 0 0 %.9f %.9f\n", stamp.sec,
                stamp.nsec, pose.x, pose.y, std::sin(0.5 * pose.heading),
                std::cos(0.5 * pose.heading));
  path_text_ += text.data();
}

void FilterOverBag::take_path(const std::vector<ros::Time>& stamps,
                              const std::vector<Pose2>& poses) {
  path_text_.clear();
  for (std::size_t i = 0; i < stamps.size() && i < poses.size(); ++i)
    note_pose(stamps[i], poses[i]);
}

void FilterOverBag::report(const RejectCounter& rejects, const PopulationStatus& status,
                           const std::string& more) const {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const double wall = wall_seconds() - wall_start_;
  for (const std::string& text : log_) std::cout << text << "\n";
  for (const RejectCounter::Count& count : rejects.counts()) {
    std::cout << "rejected " << count.count << " of " << count.input << ", "
              << to_string(count.reason) << "\n";
  }
  std::cout << poses_ << " poses, " << status.updates << " updates, " << status.renewals
            << " renewals, " << status.particles << " particles, " << more << "\n";
  std::cout << "wall time " << number_text(wall, 3) << " s, CPU time "
            << number_text(cpu_seconds(usage), 3) << " s, peak memory "
            << number_text(static_cast<double>(usage.ru_maxrss) / 1024.0, 0) << " MiB, "
            << number_text(recorded_ / wall, 0) << " x real time (" << number_text(recorded_, 1)
            << " s)\n";
}

void apply_run_parameters(const CommandLine& line, const ParameterList& parameters) {
  if (line.has("seed")) set_parameter(parameters, "seed", line.text("seed"));
  if (line.has("threads")) set_parameter(parameters, "threads", line.text("threads"));
}

void print_parameters(const CommandLine& line, const ParameterList& parameters,
                      const ParameterList& live) {
  const auto format = line.text("parameters");
  if (format == "yaml") {
    std::cout << to_yaml(parameters);
  } else if (format == "template") {
    std::cout << to_template(parameters);
  } else if (format == "markdown") {
    std::cout << to_markdown(parameters, live);
  } else {
    throw UsageError("--parameters is '" + format + "', has to be yaml, template or markdown");
  }
}

}  // namespace pf_resampling
