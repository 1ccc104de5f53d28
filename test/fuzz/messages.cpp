// Sequences of messages and requests through the pipelines: valid, broken, late, twice, hostile.
// Whatever comes, no exception gets out, nothing that is given out is not finite, weights are
// weights, counts add up; and once good input is back the pose is good again.
#include <algorithm>
#include <cmath>
#include <optional>

#include "pf_resampling_core/error.hpp"
#include "test/beacon_mcl_rig.hpp"
#include "test/fastslam_rig.hpp"
#include "test/fuzz/fuzz_target.hpp"

namespace pf_resampling::fuzz {
namespace {

// A fuzzer finds by number: all is as small and short as it can be. Once in a while the robot is
// not told where it is when good input is back, and has to find out by itself: that takes its time.
constexpr double kLost = 0.5;    // m
constexpr double kLatest = 3.0;  // s of the drive, while it is attacked
constexpr double kBuffer = 1.5;  // s of odometry that are kept, so that an attack reaches its end
constexpr int kFindsOutOneIn = 64;  // of so many attacks, in one the robot has to find out
constexpr double kFindOut = 25.0;   // s
constexpr double kTold = 1.0;       // s
constexpr int kMostParticles = 16;

// ---- messages with something wrong ------------------------------------------------------------

std::string frame(Bytes* bytes) {
  static const char* const kFrames[] = {
      "base_link", "map",  "odom",     "",      "beacon_10",
      "beacon_",   "/map", "sensor_1", "tag_7", "beacon_-99999999999"};
  const int kind = bytes->below(12);
  if (kind < 10) return kFrames[kind];
  if (kind == 10) return "beacon_" + std::string(static_cast<std::size_t>(bytes->below(5000)), '1');
  std::string any;
  while (any.size() < 8) any += static_cast<char>(bytes->byte());
  return any;
}

void change(Bytes* bytes, geometry_msgs::Pose* pose) {
  double* const fields[] = {&pose->position.x,    &pose->position.y,    &pose->position.z,
                            &pose->orientation.x, &pose->orientation.y, &pose->orientation.z,
                            &pose->orientation.w};
  *fields[bytes->below(7)] = bytes->number();
}

void change(Bytes* bytes, boost::array<double, 36>* covariance) {
  (*covariance)[static_cast<std::size_t>(bytes->below(36))] = bytes->number();
}

void change(Bytes* bytes, nav_msgs::Odometry* odometry) {
  switch (bytes->below(4)) {
    case 0:
      return change(bytes, &odometry->pose.covariance);
    case 1:
      odometry->child_frame_id = frame(bytes);
      return;
    default:
      return change(bytes, &odometry->pose.pose);
  }
}

void change(Bytes* bytes, geometry_msgs::PoseWithCovarianceStamped* pose) {
  if (bytes->flip()) return change(bytes, &pose->pose.covariance);
  change(bytes, &pose->pose.pose);
}

void change(Bytes* bytes, BeaconRange* range) {
  switch (bytes->below(3)) {
    case 0:
      range->beacon = bytes->flip() ? bytes->integer() : bytes->below(20);
      return;
    case 1:
      range->range = bytes->number();
      return;
    default:
      range->variance = bytes->number();
  }
}

void change(Bytes* bytes, sensor_msgs::Range* range) {
  float* const fields[] = {&range->range, &range->min_range, &range->max_range,
                           &range->field_of_view};
  *fields[bytes->below(4)] = static_cast<float>(bytes->number());
}

void change(Bytes* bytes, BeaconArray* beacons) {
  if (beacons->beacons.empty() || bytes->below(8) == 0) {
    beacons->beacons.resize(static_cast<std::size_t>(bytes->below(300)));
    return;
  }
  const int which = bytes->below(static_cast<int>(beacons->beacons.size()));
  BeaconPosition& beacon = beacons->beacons[static_cast<std::size_t>(which)];
  double* const fields[] = {&beacon.position.x, &beacon.position.y, &beacon.position.z};
  if (bytes->below(4) == 0) {
    beacon.id = bytes->integer();
  } else {
    *fields[bytes->below(3)] = bytes->number();
  }
}

void change(Bytes* bytes, LandmarkObservationArray* scan) {
  if (scan->observations.empty() || bytes->below(8) == 0) {
    scan->observations.resize(static_cast<std::size_t>(bytes->below(60)));
    return;
  }
  const int which = bytes->below(static_cast<int>(scan->observations.size()));
  LandmarkObservation& seen = scan->observations[static_cast<std::size_t>(which)];
  double* const fields[] = {&seen.range, &seen.bearing, &seen.range_variance,
                            &seen.bearing_variance};
  if (bytes->below(4) == 0) {
    seen.id = bytes->flip() ? bytes->integer() : bytes->below(20) - 1;
  } else {
    *fields[bytes->below(4)] = bytes->number();
  }
}

// An hour, a time before the first, after 2038, the edge of what is kept, a little.
ros::Time moved(Bytes* bytes, ros::Time stamp) {
  static const double kShifts[] = {3600.0, -3600.0, 30.0, -30.0, kBuffer - 0.04, 0.06 - kBuffer,
                                   0.001,  -0.001,  2.0,  -2.0,  9.99,           -10.0,
                                   1.6e9,  2.1e9,   0.05, -0.05};
  switch (bytes->below(5)) {
    case 0:
      return ros::Time();
    case 1:
      return ros::TIME_MAX;
    case 2:
      return ros::Time(static_cast<std::uint32_t>(bytes->integer()), 0);
    default: {
      const double seconds = stamp.toSec() + kShifts[bytes->below(16)];
      return seconds < 0.0 ? ros::Time(0, 1) : ros::Time(std::min(seconds, 4.0e9));
    }
  }
}

template <typename Message>
boost::shared_ptr<Message> worse(Bytes* bytes, Message message) {
  switch (bytes->below(4)) {
    case 0:
      message.header.stamp = moved(bytes, message.header.stamp);
      break;
    case 1:
      message.header.frame_id = frame(bytes);
      break;
    default:
      change(bytes, &message);
  }
  return boost::make_shared<Message>(std::move(message));
}

tf2_msgs::TFMessage::Ptr transforms(Bytes* bytes, ros::Time stamp) {
  auto message = boost::make_shared<tf2_msgs::TFMessage>();
  const int count = 1 + bytes->below(4);
  for (int i = 0; i < count; ++i) {
    geometry_msgs::TransformStamped transform;
    transform.header.stamp = bytes->flip() ? stamp : moved(bytes, stamp);
    transform.header.frame_id = bytes->flip() ? "base_link" : frame(bytes);
    transform.child_frame_id = frame(bytes);
    transform.transform.rotation.w = bytes->flip() ? 1.0 : bytes->number();
    transform.transform.translation.x = bytes->flip() ? 0.3 : bytes->number();
    message->transforms.push_back(transform);
  }
  return message;
}

// As the rigs of tests, but mostly without what is only for looking at: a fuzzer has little time.
template <typename AnyRig>
struct QuickRig {
  QuickRig(const decltype(AnyRig::Drive::options())& options, bool with_pictures)
      : pipeline(options, sinks(&out, with_pictures)) {}

  static auto sinks(decltype(AnyRig::out)* out, bool with_pictures) {
    auto sinks = sinks_into(out);
    if (!with_pictures) {
      sinks.path = nullptr;
      sinks.particlecloud = nullptr;
      sinks.particles = nullptr;
      sinks.markers = nullptr;
      sinks.diagnostics = nullptr;
    }
    return sinks;
  }
  void feed(const std::vector<typename AnyRig::Message>& messages) {
    for (const auto& message : messages) handle(message, &pipeline);
  }
  const auto& particles() const {
    if constexpr (std::is_same_v<AnyRig, Rig>) {
      return pipeline.filter()->particles();
    } else {
      return pipeline.filter().particles();
    }
  }

  decltype(AnyRig::out) out;
  decltype(AnyRig::pipeline) pipeline;
};

// ---- what one filter has and the other has not -------------------------------------------------

std::optional<BeaconMclMessage> own_message(Bytes* bytes, QuickRig<Rig>* run, ros::Time stamp) {
  if (bytes->flip()) {
    const BeaconArray beacons = BeaconMclDrive::beacon_array();
    return bytes->below(3) == 0 ? boost::make_shared<BeaconArray>(beacons) : worse(bytes, beacons);
  }
  if (bytes->flip()) {
    run->pipeline.guard("global_localization", [&] { run->pipeline.global_localization(); });
    return std::nullopt;
  }
  sensor_msgs::Range range;
  range.header.stamp = stamp;
  range.header.frame_id = "beacon_" + std::to_string(10 + bytes->below(5));
  range.max_range = 100.0F;
  range.range = static_cast<float>(bytes->moderate());
  return worse(bytes, range);
}

std::optional<FastSlamMessage> own_message(Bytes* bytes, QuickRig<FastSlamRig>* run,
                                           ros::Time stamp) {
  const std::string path = new_file("saved.map");
  if (bytes->flip()) {
    const bool frozen = bytes->below(4) == 0;
    bool is_written = false;
    try {
      run->pipeline.ask("save_map", [&] { return run->pipeline.save_map(path); });
      is_written = true;
      read_map_file(path);
      is_written = false;
      run->pipeline.ask("load_map", [&] { return run->pipeline.load_map(path, frozen); });
    } catch (const Error& error) {
      require(!is_written, std::string("a map that was written cannot be read: ") + error.what());
      require_one_line(error);
    }
    return std::nullopt;
  }
  LandmarkObservationArray scan = FastSlamDrive::scan(stamp);
  scan.observations.push_back(FastSlamDrive::observation(stamp, bytes->below(12)));
  return worse(bytes, scan);
}

// ---- what goes through a file ------------------------------------------------------------------

// False if it is refused; one that is written can be read.
template <typename Checkpoint>
bool go_through_file(Checkpoint* checkpoint) {
  const std::string path = new_file("checkpoint");
  try {
    write_saved(kCheckpointFile, path, *checkpoint);
  } catch (const Error& error) {
    require_one_line(error);
    return false;
  }
  *checkpoint = read_saved<Checkpoint>(kCheckpointFile, path);
  return true;
}

// ---- the drive ---------------------------------------------------------------------------------

template <typename AnyRig>
class Attack {
 public:
  using Drive = typename AnyRig::Drive;
  using Message = typename AnyRig::Message;

  Attack(Bytes* bytes, const typename AnyRig::Observation& /*to tell the type*/)
      : bytes_(bytes),
        is_told_(bytes->below(kFindsOutOneIn) != 1),
        run_(options(bytes), bytes->below(8) == 1) {}

  void run() {
    dispatch(Drive::messages(0.0, 0.4));
    time_ = 0.4;
    for (int i = 0; i < 30 && !bytes_->empty() && time_ < kLatest; ++i) {
      step();
      check();
    }
    expect_good_again();
  }

 private:
  static auto options(Bytes* bytes) {
    auto options = Drive::options();
    const int choice = bytes->byte();
    options.filter.particles = 1 + choice % kMostParticles;
    options.queue_length = 20;
    options.odometry_input.length = kBuffer;
    if constexpr (std::is_same_v<AnyRig, FastSlamRig>) {
      options.tag_pattern = bytes->flip() ? "tag_(\\d+)" : "";
      if (choice / kMostParticles % 2 == 1) {
        options.filter.strategy.renewal = Renewal::redraw;
        options.filter.strategy.redraw.every_n = 3;
      }
    }
    return options;
  }

  void step() {
    const ros::Time now = Drive::at(time_);
    switch (bytes_->below(10)) {
      case 0:
      case 1:
        return drive(0.1 * (1 + bytes_->below(4)));
      case 2:
        return dispatch({worse(bytes_, Drive::odometry(now + ros::Duration(0.02)))});
      case 3:
        return dispatch(
            {worse(bytes_, Drive::observation_at(now + ros::Duration(0.03), bytes_->below(4)))});
      case 4: {
        return dispatch({worse(bytes_, initial_pose(now, Drive::truth(now)))});
      }
      case 5:
        return dispatch({transforms(bytes_, now)});
      case 6:
        if (const auto message = own_message(bytes_, &run_, now)) dispatch({*message});
        return;
      case 7:
        return request(now);
      case 8: {  // what was sent is sent again
        if (!sent_.empty()) {
          const auto which =
              static_cast<std::size_t>(bytes_->below(static_cast<int>(sent_.size())));
          dispatch({Message(sent_[which])});
        }
        return;
      }
      default: {  // many with the clock of another time, as after it was set
        const double shift = moved(bytes_, now).toSec() - now.toSec();
        for (int i = 0; i < 12; ++i) {
          auto odometry = Drive::odometry(Drive::at(time_ + 0.1 * i));
          const double stamp = odometry.header.stamp.toSec() + shift;
          odometry.header.stamp = ros::Time(std::clamp(stamp, 0.0, 4.2e9));
          dispatch({Message(boost::make_shared<nav_msgs::Odometry>(odometry))});
        }
      }
    }
  }

  void drive(double seconds) {
    const double until = time_ + seconds;
    dispatch(messages(time_, until));
    time_ = until;
  }

  static std::vector<Message> messages(double from, double until) {
    return Drive::messages(std::round(10.0 * from) / 10.0, std::round(10.0 * until) / 10.0);
  }

  void request(ros::Time now) {
    auto& pipeline = run_.pipeline;
    switch (bytes_->below(4)) {
      case 0:
        pipeline.guard("reset", [&] { pipeline.reset(); });
        return;
      case 1: {
        std::optional<typename decltype(run_.pipeline)::Checkpoint> saved;
        pipeline.guard("checkpoint", [&] { saved = pipeline.checkpoint(); });
        if (!saved) return;
        if (bytes_->flip()) drive(0.2);
        if (!go_through_file(&*saved)) return;
        ask("resume", [&] {
          pipeline.resume(*saved);
          return "";
        });
        return;
      }
      case 2:
        pipeline.guard("silence", [&] { pipeline.report_silence(moved(bytes_, now)); });
        return;
      default:
        return set_any_parameter();
    }
  }

  // But none that decides how much is computed.
  void set_any_parameter() {
    const ParameterList parameters = run_.pipeline.live_parameters();
    const Parameter& any =
        parameters[static_cast<std::size_t>(bytes_->below(static_cast<int>(parameters.size())))];
    std::string value = std::to_string(bytes_->moderate());
    if (!any.choices.empty()) {
      value = any.choices[static_cast<std::size_t>(
          bytes_->below(static_cast<int>(any.choices.size())))];
    } else if (any.name == "particles") {
      value = std::to_string(bytes_->below(2 * kMostParticles));
    } else if (any.name.find("max") != std::string::npos || bytes_->flip()) {
      value = std::to_string(bytes_->below(300));
    }
    set_parameters({{any.name, value}});
  }

  void set_parameters(const std::map<std::string, std::string>& values) {
    set_parameters_ = true;
    ask("set_parameters", [&] {
      run_.pipeline.set_parameters(values);
      return "";
    });
  }

  template <typename Work>
  void ask(const char* request, const Work& work) {
    try {
      run_.pipeline.ask(request, work);
    } catch (const Error& error) {
      require_one_line(error);
    }
  }

  void dispatch(const std::vector<Message>& messages) {
    run_.feed(messages);
    for (const Message& message : messages) {
      if (sent_.size() < 50) {
        sent_.push_back(message);
      } else {
        sent_[next_++ % sent_.size()] = message;
      }
    }
  }

  void check() {
    auto& out = run_.out;
    require(all_finite(out), "something that is not finite was given out");
    if (!out.statuses.empty()) {
      std::uint64_t sum = 0;
      for (const auto& count : out.statuses.back().rejects) sum += count.count;
      require(sum >= counted_, "counts of what was rejected have become less");
      require(sum <= run_.pipeline.rejects().total(), "counts do not add up");
      counted_ = sum;
    }
    for (const auto& count : run_.pipeline.rejects().counts()) {
      require(count.reason != RejectReason::exception,
              "an exception in " + count.input + ": " + count.latest);
    }
    require(run_.pipeline.queued() <= 20, "more waits than may");
    check_weights();
    const auto clear = [](auto* list) { list->clear(); };
    out.log.clear();
    clear(&out.clouds);
    clear(&out.pose_arrays);
    clear(&out.paths);
    clear(&out.markers);
    clear(&out.diagnostics);
    clear(&out.transforms);
    if (out.poses.size() > 1) out.poses.erase(out.poses.begin(), out.poses.end() - 1);
    if (out.statuses.size() > 1) out.statuses.erase(out.statuses.begin(), out.statuses.end() - 1);
  }

  void check_weights() {
    if constexpr (std::is_same_v<AnyRig, Rig>) {
      if (run_.pipeline.filter() == nullptr || !run_.pipeline.estimate()) return;
    }
    const auto& particles = run_.particles();
    if (particles.size() == 0) return;
    const double sum = particles.weight.sum();
    require(std::abs(sum - 1.0) < 1e-6 && (particles.weight >= 0.0).all(),
            "weights do not sum to one but to " + std::to_string(sum));
  }

  // What a node's user can do: set the parameters back, call reset, say where the robot is; then
  // good input. A drive that goes on where the good messages ended, whatever the hostile ones said
  // of the time.
  void expect_good_again() {
    auto& pipeline = run_.pipeline;
    if (set_parameters_ || !is_told_) set_usual_parameters();
    const double begin = std::round(10.0 * time_) / 10.0 + 1.0;
    // The drive itself has to be taken up first: hostile odometry may have been of another time.
    dispatch(messages(begin, begin + 0.6));
    pipeline.guard("reset", [&] { pipeline.reset(); });
    run_.out.poses.clear();
    if constexpr (std::is_same_v<AnyRig, Rig>) {
      auto beacons = Drive::beacon_array();
      beacons.header.stamp = Drive::at(begin + 0.6);
      dispatch({Message(boost::make_shared<BeaconArray>(beacons))});
      if (is_told_) {
        dispatch({Message(boost::make_shared<geometry_msgs::PoseWithCovarianceStamped>(
            initial_pose(Drive::at(begin + 0.6), Drive::truth(Drive::at(begin + 0.6)))))});
      }
    }
    // The map of a FastSLAM begins where the robot is now.
    const bool maps = std::is_same_v<AnyRig, FastSlamRig>;
    const Pose2 origin = maps ? Drive::truth(Drive::at(begin + 0.7)) : Pose2{};
    const double end = begin + 0.7 + (is_told_ ? kTold : kFindOut);
    dispatch(messages(begin + 0.7, end));
    check_last(std::round(10.0 * end) / 10.0, origin);
  }

  void set_usual_parameters() {
    static const std::map<std::string, std::string> kUsual = [] {
      const auto options = Drive::options();
      decltype(AnyRig::pipeline) pipeline(options, {});
      std::map<std::string, std::string> values;
      for (const Parameter& parameter : pipeline.live_parameters()) {
        values[parameter.name] = parameter.get();
      }
      return values;
    }();
    auto values = kUsual;
    // To be found anywhere among the beacons takes more of them than to begin at a known place.
    const bool is_sought = std::is_same_v<AnyRig, Rig> && !is_told_;
    values["particles"] = is_sought ? "300" : std::to_string(kMostParticles);
    set_parameters({{"preset", values.at("preset")}});
    set_parameters(values);
  }

  void check_last(double end, const Pose2& origin) {
    require(!run_.out.poses.empty(), "with good input again, no pose comes");
    const auto& last = run_.out.poses.back();
    require(last.header.stamp == Drive::at(end),
            "with good input again, the pose is not up to date");
    const Pose2 truth = relative(origin, Drive::truth(last.header.stamp));
    const double error = distance(to_pose2(last.pose.pose), truth);
    require(error < kLost,
            "with good input again, the pose is " + std::to_string(error) + " m off");
    check();
  }

  Bytes* bytes_;
  bool is_told_;  // where it is, after the attack
  bool set_parameters_ = false;
  QuickRig<AnyRig> run_;
  double time_ = 0.0;
  std::uint64_t counted_ = 0;
  std::vector<Message> sent_;
  std::size_t next_ = 0;
};

}  // namespace

void beacon_mcl_messages(const std::uint8_t* bytes, std::size_t size) {
  Bytes decisions(bytes, size);
  Attack<Rig>(&decisions, {}).run();
}

void fastslam_messages(const std::uint8_t* bytes, std::size_t size) {
  Bytes decisions(bytes, size);
  Attack<FastSlamRig>(&decisions, {}).run();
}

}  // namespace pf_resampling::fuzz
