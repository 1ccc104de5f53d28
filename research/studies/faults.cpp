#include "research/studies/faults.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>

#include "pf_resampling_core/error.hpp"
#include "src/messages/conversions.hpp"
#include "tools/common/table.hpp"

namespace pf_resampling {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kMoved = 5.0;       // m, of a beacon; and the lie of one that lies
constexpr double kMovedShare = 0.1;  // of the map's extent, by which a landmark is moved

// Of what befalls some messages only, the share.
constexpr double kBadShare = 0.1;

/// The same world, in which nothing has been said yet.
RecordedDrive without_messages(const RecordedDrive& drive) {
  return {{}, drive.truth, drive.beacons, drive.landmarks};
}

using Change = std::function<bool(DriveMessage*)>;  // false: it is left out

Fault change(const RecordedDrive& drive, const std::string& name, double begin, double end,
             const Change& change) {
  Fault fault = {name, begin, end, without_messages(drive)};
  for (const DriveMessage& message : drive.messages) {
    const double time = stamp_of(message).toSec();
    DriveMessage copy = message;
    const bool in_fault = time >= begin && time <= end;
    if (!in_fault || change(&copy)) fault.drive.messages.push_back(std::move(copy));
  }
  return fault;
}

std::optional<Pose2> true_pose(const RecordedDrive& drive, double time) {
  const auto pose = interpolate(drive.truth, time, usual_max_gap(drive.truth));
  if (!pose) return std::nullopt;
  return Pose2{pose->x, pose->y, pose->heading.value_or(0.0)};
}

// The sum of ros::Time throws where it leaves the range of a stamp; this one stays at its end.
void move_stamp(double seconds, ros::Time* stamp) {
  constexpr std::int64_t kLast = 0xffffffffLL * 1000000000LL + 999999999LL;  // ns
  const ros::Duration by(std::clamp(seconds, -2e9, 2e9));
  const std::int64_t sum = static_cast<std::int64_t>(stamp->toNSec()) + by.toNSec();
  stamp->fromNSec(static_cast<std::uint64_t>(std::clamp(sum, std::int64_t{0}, kLast)));
}

void shift(double seconds, DriveMessage* message) {
  if (auto* odometry = std::get_if<nav_msgs::Odometry>(message)) {
    move_stamp(seconds, &odometry->header.stamp);
  }
  if (auto* range = std::get_if<BeaconRange>(message)) move_stamp(seconds, &range->header.stamp);
  if (auto* scan = std::get_if<LandmarkObservationArray>(message)) {
    move_stamp(seconds, &scan->header.stamp);
  }
}

// ---- what is observed ---------------------------------------------------------------------------

// A recording may have ranges and landmarks, even of the same ids. The filter reads one of them.
RecordedDrive as_the_filter_reads(RecordedDrive drive) {
  const bool is_beacon = !drive.beacons.empty();
  const auto is_unread = [&](const DriveMessage& message) {
    return is_beacon ? std::holds_alternative<LandmarkObservationArray>(message)
                     : std::holds_alternative<BeaconRange>(message);
  };
  auto& messages = drive.messages;
  messages.erase(std::remove_if(messages.begin(), messages.end(), is_unread), messages.end());
  return drive;
}

// The beacon, or landmark, that is observed most: what befalls it tells most.
int most_observed(const RecordedDrive& drive) {
  std::map<int, int> counts;
  for (const DriveMessage& message : drive.messages) {
    if (const auto* range = std::get_if<BeaconRange>(&message)) ++counts[range->beacon];
    if (const auto* scan = std::get_if<LandmarkObservationArray>(&message)) {
      for (const auto& seen : scan->observations) ++counts[seen.id];
    }
  }
  if (counts.empty()) {
    throw Error(drive.beacons.empty()
                    ? "there is no landmark in the observations: record some"
                    : "there are beacons but no ranges: record ranges, or leave the beacons out");
  }
  return std::max_element(counts.begin(), counts.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

// One of the functions may be null: what it is for stays as it is.
Change for_observation_of(int id, const std::function<bool(BeaconRange*)>& of_range,
                          const std::function<bool(LandmarkObservation*)>& of_landmark) {
  return [=](DriveMessage* message) {
    if (auto* range = std::get_if<BeaconRange>(message)) {
      return range->beacon != id || !of_range || of_range(range);
    }
    auto* scan = std::get_if<LandmarkObservationArray>(message);
    if (scan != nullptr && of_landmark) {
      auto& seen = scan->observations;
      seen.erase(std::remove_if(seen.begin(), seen.end(),
                                [&](LandmarkObservation& observation) {
                                  return observation.id == id && !of_landmark(&observation);
                                }),
                 seen.end());
    }
    return true;
  };
}

// A beacon stands `offset` from where it is said to stand.
std::function<bool(BeaconRange*)> moved_beacon(const RecordedDrive& drive, int id,
                                               const Eigen::Vector2d& offset) {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  for (const Beacon& beacon : drive.beacons) {
    if (beacon.id == id) place = beacon.position.head<2>();
  }
  return [=, &drive](BeaconRange* range) {
    const auto robot = true_pose(drive, range->header.stamp.toSec());
    if (!robot) return true;
    const Eigen::Vector2d at(robot->x, robot->y);
    range->range = std::max(0.1, range->range + (place + offset - at).norm() - (place - at).norm());
    return true;
  };
}

void add_observation_faults(const RecordedDrive& drive, double begin, double end,
                            std::vector<Fault>* faults) {
  const int id = most_observed(drive);
  const bool is_beacon = !drive.beacons.empty();
  const std::string name = (is_beacon ? "beacon " : "landmark ") + std::to_string(id);
  const auto dies = for_observation_of(
      id, [](BeaconRange*) { return false; }, [](LandmarkObservation*) { return false; });
  faults->push_back(change(drive, name + (is_beacon ? " dies" : " is hidden"), begin, end, dies));
  if (is_beacon) {
    faults->push_back(
        change(drive, name + " is moved by 5 m", begin, end,
               for_observation_of(id, moved_beacon(drive, id, {kMoved, 0.0}), nullptr)));
    faults->push_back(change(drive, name + " lies by 5 m", begin, end,
                             for_observation_of(
                                 id,
                                 [](BeaconRange* range) {
                                   range->range += kMoved;
                                   return true;
                                 },
                                 nullptr)));
  } else {
    faults->push_back(change(drive, name + " is seen 10 % farther and 0.2 rad aside", begin, end,
                             for_observation_of(id, nullptr, [](LandmarkObservation* seen) {
                               seen->range *= 1.0 + kMovedShare;
                               seen->bearing += 0.2;
                               return true;
                             })));
  }
  const double gap_end = std::min(begin + 97.0, end);
  faults->push_back(change(
      drive, "nothing observed for " + fixed(gap_end - begin, 0) + " s", begin, gap_end,
      [](DriveMessage* message) { return std::holds_alternative<nav_msgs::Odometry>(*message); }));
}

// ---- odometry -----------------------------------------------------------------------------------

// Odometry from `begin` on, its steps changed until `end`; what comes later joins on.
Fault change_steps(const RecordedDrive& drive, const std::string& name, double begin, double end,
                   const std::function<Pose2(const Pose2&)>& change_step) {
  Fault fault = {name, begin, end, drive};
  std::optional<Pose2> before;
  Pose2 now;
  for (DriveMessage& message : fault.drive.messages) {
    auto* odometry = std::get_if<nav_msgs::Odometry>(&message);
    if (odometry == nullptr) continue;
    const Pose2 given = to_pose2(odometry->pose.pose);
    const double time = odometry->header.stamp.toSec();
    if (!before) {
      now = given;
    } else {
      const Pose2 step = relative(*before, given);
      now = compose(now, time >= begin && time <= end ? change_step(step) : step);
    }
    before = given;
    odometry->pose.pose = to_pose_message(now);
  }
  return fault;
}

void add_odometry_faults(const RecordedDrive& drive, double begin, std::vector<Fault>* faults) {
  faults->push_back(change_steps(drive, "wheels slip for 10 s: half of the way is not made", begin,
                                 begin + 10.0, [](const Pose2& step) {
                                   return Pose2{2.0 * step.x, 2.0 * step.y, step.heading};
                                 }));
  faults->push_back(change_steps(drive, "odometry says for 10 s that the robot stands", begin,
                                 begin + 10.0, [](const Pose2&) { return Pose2{}; }));
  faults->push_back(change_steps(drive, "the robot is turned by 90 degrees, unnoticed", begin,
                                 begin + 0.2, [turned = false](const Pose2& step) mutable {
                                   const double turn = turned ? 0.0 : 0.5 * kPi;
                                   turned = true;
                                   return Pose2{step.x, step.y, step.heading - turn};
                                 }));
  faults->push_back(change(
      drive, "no odometry for 20 s", begin, begin + 20.0,
      [](DriveMessage* message) { return !std::holds_alternative<nav_msgs::Odometry>(*message); }));
}

// ---- bad messages -------------------------------------------------------------------------------

struct BadMessage {
  std::string name;
  std::function<void(DriveMessage*)> spoil;
};

template <typename Message>
std::function<void(DriveMessage*)> on(const std::function<void(Message*)>& spoil) {
  return [spoil](DriveMessage* message) {
    if (auto* given = std::get_if<Message>(message)) spoil(given);
  };
}

std::vector<BadMessage> bad_observations(bool is_beacon) {
  if (is_beacon) {
    return {
        {"ranges of NaN", on<BeaconRange>([](auto* range) { range->range = kNan; })},
        {"infinite ranges", on<BeaconRange>([](auto* range) { range->range = INFINITY; })},
        {"negative ranges", on<BeaconRange>([](auto* range) { range->range = -range->range; })},
        {"ranges twice as long", on<BeaconRange>([](auto* range) { range->range *= 2.0; })},
        {"negative variances", on<BeaconRange>([](auto* range) { range->variance = -1.0; })},
        {"ids of no beacon", on<BeaconRange>([](auto* range) { range->beacon = 4711; })},
        {"ranges from an unknown frame",
         on<BeaconRange>([](auto* range) { range->header.frame_id = "nowhere"; })},
        {"ranges without a stamp",
         on<BeaconRange>([](auto* range) { range->header.stamp = ros::Time(); })},
        {"ranges an hour ahead",
         on<BeaconRange>([](auto* range) { move_stamp(3600.0, &range->header.stamp); })},
    };
  }
  using Scan = LandmarkObservationArray;
  const auto each = [](const std::function<void(LandmarkObservation*)>& spoil) {
    return on<Scan>([spoil](Scan* scan) {
      for (auto& seen : scan->observations) spoil(&seen);
    });
  };
  return {
      {"ranges of NaN", each([](auto* seen) { seen->range = kNan; })},
      {"infinite bearings", each([](auto* seen) { seen->bearing = INFINITY; })},
      {"negative ranges", each([](auto* seen) { seen->range = -seen->range; })},
      {"bearings turned by 1 rad", each([](auto* seen) { seen->bearing += 1.0; })},
      {"negative variances", each([](auto* seen) { seen->range_variance = -1.0; })},
      {"misread ids", each([](auto* seen) { seen->id = seen->id < 0 ? -1 : seen->id + 1; })},
      {"scans from an unknown frame",
       on<Scan>([](auto* scan) { scan->header.frame_id = "nowhere"; })},
      {"scans without a stamp", on<Scan>([](auto* scan) { scan->header.stamp = ros::Time(); })},
      {"scans an hour ahead",
       on<Scan>([](auto* scan) { move_stamp(3600.0, &scan->header.stamp); })},
  };
}

std::vector<BadMessage> bad_odometry() {
  using Odometry = nav_msgs::Odometry;
  return {
      {"odometry of NaN",
       on<Odometry>([](auto* odometry) { odometry->pose.pose.position.x = kNan; })},
      {"odometry with a quaternion of zeros", on<Odometry>([](auto* odometry) {
         odometry->pose.pose.orientation = geometry_msgs::Quaternion();
       })},
      {"odometry 1 km away",
       on<Odometry>([](auto* odometry) { odometry->pose.pose.position.x += 1000.0; })},
      {"odometry in another frame",
       on<Odometry>([](auto* odometry) { odometry->header.frame_id = "elsewhere"; })},
      {"odometry an hour ahead",
       on<Odometry>([](auto* odometry) { move_stamp(3600.0, &odometry->header.stamp); })},
  };
}

void add_bad_messages(const RecordedDrive& drive, double begin, double end,
                      const RandomStream& random, std::vector<Fault>* faults) {
  std::vector<BadMessage> kinds = bad_observations(!drive.beacons.empty());
  for (BadMessage& kind : bad_odometry()) kinds.push_back(std::move(kind));
  std::uint64_t next = 0;
  for (const BadMessage& kind : kinds) {
    faults->push_back(
        change(drive, "one in ten: " + kind.name, begin, end, [&](DriveMessage* message) {
          if (random.uniform(next++) < kBadShare) kind.spoil(message);
          return true;
        }));
  }
}

// ---- time ---------------------------------------------------------------------------------------

void add_time_faults(const RecordedDrive& drive, double first, double last, double begin,
                     const RandomStream& random, std::vector<Fault>* faults) {
  Fault twice = {"every message comes twice", first, last, without_messages(drive)};
  for (const DriveMessage& message : drive.messages) {
    twice.drive.messages.insert(twice.drive.messages.end(), 2, message);
  }
  faults->push_back(twice);

  Fault shuffled = {"messages come up to 1 s late, in another order", first, last, drive};
  std::vector<std::pair<double, std::size_t>> arrivals;
  for (std::size_t i = 0; i < drive.messages.size(); ++i) {
    const ros::Time stamp = stamp_of(drive.messages[i]);
    arrivals.emplace_back(stamp.isZero() ? 0.0 : stamp.toSec() + random.uniform(i), i);
  }
  std::sort(arrivals.begin(), arrivals.end());
  for (std::size_t i = 0; i < arrivals.size(); ++i) {
    shuffled.drive.messages[i] = drive.messages[arrivals[i].second];
  }
  faults->push_back(shuffled);

  const double late = std::min(first + 60.0, begin);
  Fault starts_late = change(
      drive, "nothing observed in the first " + fixed(late - first, 0) + " s", first, late,
      [](DriveMessage* message) { return std::holds_alternative<nav_msgs::Odometry>(*message); });
  faults->push_back(starts_late);

  // A clock that is set while it runs.
  Fault set = {"the clock jumps back by 20 s and, 2 s later, forth; three times", begin,
               begin + 22.0, drive};
  for (DriveMessage& message : set.drive.messages) {
    const double since = stamp_of(message).toSec() - begin;
    const bool is_back = since >= 0.0 && since < 30.0 && std::fmod(since, 10.0) <= 2.0;
    set.clock_errors.push_back(is_back ? -20.0 : 0.0);
    shift(set.clock_errors.back(), &message);
  }
  faults->push_back(set);

  // The first half is played again after it ended: time jumps back, and on from there.
  Fault loops = {"the bag loops: its first part is played again", begin, begin + 0.5,
                 without_messages(drive)};
  for (const DriveMessage& message : drive.messages) {
    if (stamp_of(message).toSec() <= begin) loops.drive.messages.push_back(message);
  }
  loops.drive.messages.insert(loops.drive.messages.end(), drive.messages.begin(),
                              drive.messages.end());
  faults->push_back(loops);
}

// Clocks that are set back must not go below zero, which no stamp can: simulated time begins there.
RecordedDrive begun_late(RecordedDrive drive) {
  constexpr double kEarliest = 3600.0;
  if (drive.truth.front().time >= kEarliest) return drive;
  for (TruePose& pose : drive.truth) pose.time += kEarliest;
  for (DriveMessage& message : drive.messages) {
    if (!stamp_of(message).isZero()) shift(kEarliest, &message);
  }
  return drive;
}

}  // namespace

Fault kidnapped(const RecordedDrive& drive, double begin, double distance) {
  // The robot is taken from where it is at `begin` to where it is when it is that far away.
  const auto from = true_pose(drive, begin);
  if (!from) throw Error("kidnapping: there is no true pose at " + std::to_string(begin) + " s");
  const TruePose* to = nullptr;
  for (const TruePose& pose : drive.truth) {
    if (pose.time > begin && std::hypot(pose.x - from->x, pose.y - from->y) >= distance) {
      to = &pose;
      break;
    }
  }
  if (to == nullptr) {
    throw Error("kidnapping: the robot is never " + fixed(distance, 1) + " m from where it is at " +
                fixed(begin, 1) + " s");
  }
  const double cut = to->time - begin;
  Fault fault = {"kidnapped by " + fixed(distance, 0) + " m", begin, begin,
                 without_messages(drive)};
  fault.drive.truth.clear();
  std::optional<Pose2> last;         // odometry before
  std::optional<Pose2> first_after;  // and as received after
  for (const DriveMessage& message : drive.messages) {
    const ros::Time stamp = stamp_of(message);
    if (!stamp.isZero() && stamp.toSec() > begin && stamp.toSec() < to->time) continue;
    DriveMessage copy = message;
    if (!stamp.isZero() && stamp.toSec() >= to->time) {
      shift(-cut, &copy);
      if (auto* odometry = std::get_if<nav_msgs::Odometry>(&copy)) {
        const Pose2 given = to_pose2(odometry->pose.pose);
        if (!first_after) first_after = given;
        if (last) {
          odometry->pose.pose = to_pose_message(compose(*last, relative(*first_after, given)));
        }
      }
    } else if (const auto* odometry = std::get_if<nav_msgs::Odometry>(&copy)) {
      last = to_pose2(odometry->pose.pose);
    }
    fault.drive.messages.push_back(std::move(copy));
  }
  for (TruePose pose : drive.truth) {
    if (pose.time > begin && pose.time < to->time) continue;
    if (pose.time >= to->time) pose.time -= cut;
    fault.drive.truth.push_back(pose);
  }
  return fault;
}

std::vector<Fault> all_faults(const RecordedDrive& given, double share,
                              const RandomStream& random) {
  const RecordedDrive drive = begun_late(as_the_filter_reads(given));
  const double first = drive.truth.front().time;
  const double last = drive.truth.back().time;
  const double begin = first + share * (last - first);
  const double end = begin + 0.5 * (last - begin);
  std::vector<Fault> faults;
  faults.push_back({"nothing", begin, begin, drive});
  const double far = drive.beacons.empty() ? 0.3 * extent_diagonal(drive.truth) : 40.0;
  faults.push_back(kidnapped(drive, begin, std::min(far, 0.45 * extent_diagonal(drive.truth))));
  add_observation_faults(drive, begin, end, &faults);
  add_odometry_faults(drive, begin, &faults);
  add_bad_messages(drive, begin, end, random, &faults);
  add_time_faults(drive, first, last, begin, random, &faults);
  return faults;
}

}  // namespace pf_resampling
