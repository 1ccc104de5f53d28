#pragma once

#include <rosbag/bag.h>
#include <std_msgs/Empty.h>
#include <std_msgs/UInt64.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "src/checkpoint/checkpoint.hpp"
#include "src/pipeline/inputs.hpp"

namespace pf_resampling {

/// The last minutes of a live filter: a checkpoint, and all that the filter did since, in its
/// order. `run_bag --resume` does the same again, to the byte, whatever was late or dropped.
template <typename Pipeline>
class FlightRecorder {
 public:
  /// It holds one to two of these.
  static constexpr std::chrono::seconds kPeriod{60};
  static constexpr std::size_t kMostEvents = 200000, kMostStanding = 1000;

  /// `is_used`: whether anything is recorded at all.
  FlightRecorder(Pipeline* pipeline, bool is_used) : pipeline_(pipeline), is_used_(is_used) {}

  /// A message, before the pipeline gets it.
  template <typename Message>
  void note(const Message& message, bool is_standing) {
    if (!is_used_) return;
    const Write write = write_of(message);
    if (is_standing) standing_.push_back(write);
    if (standing_.size() > kMostStanding) standing_.pop_front();
    add(write, pipeline_->take_overs().done);
  }
  /// That the pipeline used an observation, dropped some, or took over what was computed beside it;
  /// `done`: how often it had, before.
  void note_step(std::int64_t done) {
    add([](const ros::Time& time,
           rosbag::Bag* bag) { bag->write(kStepTopic, time, std_msgs::Empty()); },
        done);
  }

  /// Begins with another checkpoint when one is due and nothing is computed beside the filter.
  void begin_when_due() {
    const auto now = std::chrono::steady_clock::now();
    const bool is_due = flights_.empty() || now - flights_.back().begin >= kPeriod ||
                        flights_.back().events.size() >= kMostEvents;
    if (!is_used_ || !is_due || pipeline_->works_beside()) return;
    auto checkpoint = pipeline_->checkpoint();
    if (!checkpoint) return;
    if (flights_.size() > 1) flights_.pop_front();
    flights_.push_back({now, std::move(*checkpoint), pipeline_->take_overs().done, {}});
    for (const auto& message : pipeline_->waiting()) {
      flights_.back().events.push_back({ros::Time::now(), flights_.back().base, write_of(message)});
    }
  }

  /// Something was done that no message tells of.
  void clear() { flights_.clear(); }

  bool has_flight() const { return !flights_.empty(); }
  /// Writes NAME.checkpoint and NAME.bag; returns what was done in one line, or throws Error.
  std::string write(const std::string& name) const {
    if (!is_used_) throw Error("nothing is recorded; set checkpoint/file");
    if (flights_.empty()) throw Error("nothing is recorded yet; wait for the first pose");
    const Flight& flight = flights_.front();
    write_saved(kCheckpointFile, name + ".checkpoint", flight.start);
    const std::string part = name + ".bag.part";
    try {
      rosbag::Bag bag(part, rosbag::bagmode::Write);
      ros::Time time = flight.events.empty() ? ros::Time() : flight.events.front().time;
      const auto next = [&] { return time += ros::Duration(0, 1); };
      for (const Write& message : standing_) message(next(), &bag);
      std::int64_t done = flight.base;
      for (std::size_t i = 0; i < flight.events.size(); ++i) {
        const std::int64_t after =
            i + 1 < flight.events.size() ? flight.events[i + 1].done : pipeline_->take_overs().done;
        time = std::max(flight.events[i].time, next());
        if (after != std::exchange(done, after)) {
          std_msgs::UInt64 wanted;
          wanted.data = static_cast<std::uint64_t>(after - flight.base);
          bag.write(kTakeOverTopic, time, wanted);
          next();
        }
        flight.events[i].write(time, &bag);
      }
    } catch (const rosbag::BagException& error) {
      throw Error(part + " cannot be written: " + error.what());
    }
    if (std::rename(part.c_str(), (name + ".bag").c_str()) != 0) {
      throw Error(name + ".bag cannot be written");
    }
    return "flight of " + std::to_string(flight.events.size()) + " messages written to " + name +
           ".bag";
  }

 private:
  using Write = std::function<void(const ros::Time&, rosbag::Bag*)>;
  struct Event {
    ros::Time time;
    std::int64_t done = 0;  // take-overs before it
    Write write;
  };
  struct Flight {
    std::chrono::steady_clock::time_point begin;
    typename Pipeline::Checkpoint start;
    std::int64_t base = 0;  // take-overs before it
    std::vector<Event> events;
  };

  template <typename Message>
  static Write write_of(const Message& message) {
    const std::string topic = std::string("/") + name_of_input<Message, Pipeline>();
    return [topic, message](const ros::Time& time, rosbag::Bag* bag) {
      bag->write(topic, time, message);
    };
  }
  void add(const Write& write, std::int64_t done) {
    for (Flight& flight : flights_) flight.events.push_back({ros::Time::now(), done, write});
    // Nothing was due for too long.
    if (!flights_.empty() && flights_.back().events.size() > 2 * kMostEvents) clear();
  }

  Pipeline* pipeline_;
  bool is_used_;
  std::deque<Write> standing_;  // what was said once, of the sensors
  std::deque<Flight> flights_;  // the oldest first
};

}  // namespace pf_resampling
