// Plays a long bag to a running node, changes its whole strategy every second of wall time, watches
// its memory and what it publishes; scripts/soak runs it. Private parameters: filter (beacon_mcl or
// fastslam), process (id of the node's), play (the line that plays the bag), maximum_error (m, the
// median's), figures (a file for lines "what | how much").
#include <dynamic_reconfigure/Reconfigure.h>
#include <gtest/gtest.h>
#include <pf_resampling/BeaconRange.h>
#include <pf_resampling/LandmarkObservationArray.h>
#include <ros/ros.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <fstream>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "pf_resampling_core/evaluation/map_errors.hpp"
#include "pf_resampling_core/population/random_stream.hpp"
#include "src/node/reconfigure_server.hpp"
#include "test/filter_listener.hpp"
#include "test/node_process.hpp"
#include "test/strategy_switcher.hpp"

namespace pf_resampling {
namespace {

/// Draws all that makes a strategy, each choice as likely as any other.
class Strategies {
 public:
  explicit Strategies(const std::string& filter) : filter_(filter) {
    for (const StrategyParameter& parameter : strategy_parameters(filter)) {
      choices_[parameter.name] = parameter.choices;
    }
    for (const auto& [name, numbers] : std::map<std::string, std::vector<std::string>>{
             {"particles", {"500", "1000", "2000"}},
             {"population/every_n", {"1", "2", "7"}},
             {"population/threshold", {"0.25", "0.5", "0.75", "1"}},
             {"population/compensation/ratio", {"0.25", "0.5", "1"}}}) {
      choices_[name] = numbers;
    }
  }

  /// One of them, taken over by the filter at once. What is refused is printed.
  void change() {
    dynamic_reconfigure::Reconfigure call;
    std::map<std::string, std::string> drawn;
    const RandomStream random(1, RandomPurpose::test, static_cast<std::uint32_t>(changes));
    for (const auto& [name, choices] : choices_) {
      const double draw = random.uniform(drawn.size()) * static_cast<double>(choices.size());
      const std::string& choice = choices[static_cast<std::size_t>(draw)];
      drawn[name] = choice;
      add(name, choice, &call.request.config);
    }
    const bool answered = ros::service::call(filter_ + "/set_parameters", call);
    ++changes;
    const auto present = values_of(call.response.config);
    for (const auto& [name, value] : values_of(call.request.config)) {
      const auto entry = present.find(name);
      if (answered && entry != present.end() && entry->second == value) {
        ++taken_[name + "=" + drawn[name]];
        continue;
      }
      ++refused;
      std::printf("%s was to be %s and is %s\n", name.c_str(), value.c_str(),
                  entry == present.end() ? "unknown" : entry->second.c_str());
      return;
    }
  }

  int changes = 0;
  int refused = 0;

  int choices() const {
    std::size_t count = 0;
    for (const auto& entry : choices_) count += entry.second.size();
    return static_cast<int>(count);
  }
  /// How often the rarest choice was taken.
  int rarest() const {
    int rarest = changes;
    for (const auto& [name, choices] : choices_) {
      for (const std::string& choice : choices) {
        const auto taken = taken_.find(name + "=" + choice);
        rarest = std::min(rarest, taken == taken_.end() ? 0 : taken->second);
      }
    }
    return rarest;
  }

 private:
  static void add(const std::string& name, const std::string& value,
                  dynamic_reconfigure::Config* config) {
    if (value == "true" || value == "false") {
      config->bools.emplace_back();
      config->bools.back().name = name;
      config->bools.back().value = static_cast<std::uint8_t>(value == "true");
    } else if (name == "particles" || name == "population/every_n") {
      config->ints.emplace_back();
      config->ints.back().name = name;
      config->ints.back().value = std::stoi(value);
    } else if (value.find_first_not_of("0123456789.") == std::string::npos) {
      config->doubles.emplace_back();
      config->doubles.back().name = name;
      config->doubles.back().value = std::stod(value);
    } else {
      config->strs.emplace_back();
      config->strs.back().name = name;
      config->strs.back().value = value;
    }
  }

  std::string filter_;
  std::map<std::string, std::vector<std::string>> choices_;
  std::map<std::string, int> taken_;
};

struct Memory {
  double mean = 0.0;
  double most = 0.0;  // MiB
};

Memory memory_of(const std::vector<double>& samples, std::size_t begin, std::size_t end) {
  Memory memory;
  for (std::size_t i = begin; i < end; ++i) {
    memory.mean += samples[i] / static_cast<double>(end - begin);
    memory.most = std::max(memory.most, samples[i]);
  }
  return memory;
}

/// Changes strategies and looks at the memory once a second, in a thread of its own.
class Soak {
 public:
  Soak(Strategies* strategies, pid_t process) {
    thread_ = std::thread([this, strategies, process] {
      const ros::WallTime start = ros::WallTime::now();
      for (int second = 1; !is_over_; ++second) {
        strategies->change();
        memory_.push_back(resident_megabytes(process));
        const ros::WallDuration left = start + ros::WallDuration(second) - ros::WallTime::now();
        if (left.toSec() > 0.0) left.sleep();
      }
    });
  }
  ~Soak() { stop(); }
  /// The memory in use in each second, in MiB.
  const std::vector<double>& stop() {
    is_over_ = true;
    if (thread_.joinable()) thread_.join();
    return memory_;
  }

 private:
  std::atomic<bool> is_over_{false};
  std::vector<double> memory_;
  std::thread thread_;
};

std::string fixed(double value, int digits) {
  char number[60];
  std::snprintf(number, sizeof(number), "%.*f", digits, value);
  return number;
}

std::string text(const Memory& memory) {
  return fixed(memory.mean, 1) + "; " + fixed(memory.most, 1) + " MiB";
}

/// Distances after the estimate was moved.
std::vector<double> sorted_errors(const std::vector<Eigen::Vector2d>& believed,
                                  const std::vector<Eigen::Vector2d>& truth, const Pose2& by) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    errors.push_back((moved(believed[i], by) - truth[i]).norm());
  }
  std::sort(errors.begin(), errors.end());
  return errors;
}

std::string text(const std::vector<double>& sorted) {
  return fixed(sorted[sorted.size() / 2], 2) + "; " + fixed(sorted[sorted.size() * 95 / 100], 2) +
         "; " + fixed(sorted.back(), 2) + " m";
}

TEST(Soak, StaysFiniteAndFlat) {
  ros::NodeHandle node;
  ros::NodeHandle settings("~");
  const auto filter = settings.param<std::string>("filter", "");
  FilterListener heard(&node);
  int observations = 0;
  const auto ranges = node.subscribe<BeaconRange>(
      "ranges", 10000, [&](const BeaconRange::ConstPtr&) { ++observations; });
  const auto scans = node.subscribe<LandmarkObservationArray>(
      "landmarks", 10000, [&](const LandmarkObservationArray::ConstPtr&) { ++observations; });
  Strategies strategies(filter);
  Soak soak(&strategies, settings.param("process", 0));
  ASSERT_TRUE(run(settings.param<std::string>("play", "")));
  const std::vector<double> memory = soak.stop();

  ASSERT_GT(heard.odometry.size(), 100u) << "the bag did not arrive";
  ASSERT_GT(heard.beliefs.size(), 100u) << "the node gave no poses";
  ASSERT_GT(memory.size(), 10u);
  std::vector<Eigen::Vector2d> believed;
  std::vector<Eigen::Vector2d> truth;
  for (const auto& [time, belief] : heard.beliefs) {
    const auto there = heard.truth.find(time);
    if (there == heard.truth.end()) continue;
    believed.emplace_back(belief.pose.x, belief.pose.y);
    truth.emplace_back(there->second.x, there->second.y);
  }
  ASSERT_GT(truth.size(), 0.9 * static_cast<double>(heard.truth.size()));
  const std::vector<double> errors = sorted_errors(believed, truth, {});
  const std::vector<double> aligned = sorted_errors(believed, truth, align_points(believed, truth));
  std::uint64_t dropped = 0;
  std::uint64_t rejected = 0;
  for (const RejectCount& reject : heard.status.rejects) {
    const bool is_drop = reject.reason == "overload" || reject.reason == "queue_full";
    (is_drop ? dropped : rejected) += reject.count;
    std::printf("%s: %s: %lu\n", reject.input.c_str(), reject.reason.c_str(),
                static_cast<unsigned long>(reject.count));
  }
  int finite = 0;
  int not_finite = 0;
  for (const auto& entry : heard.finite) finite += entry.second;
  for (const auto& entry : heard.not_finite) not_finite += entry.second;
  // The first sixth is for what grows to a bound.
  const std::size_t warm = memory.size() / 6;
  const std::size_t middle = (warm + memory.size()) / 2;
  const Memory first = memory_of(memory, warm, middle);
  const Memory second = memory_of(memory, middle, memory.size());
  std::string sixths;
  for (std::size_t i = 0; i < 6; ++i) {
    const std::size_t end = (i + 1) * memory.size() / 6;
    sixths += i == 0 ? "" : ", ";
    sixths += fixed(memory_of(memory, i * memory.size() / 6, end).mean, 0);
  }

  std::ofstream figures(settings.param<std::string>("figures", "/dev/stdout"));
  figures << "time driven | " << fixed(*heard.odometry.rbegin() - *heard.odometry.begin(), 0)
          << " s\n"
          << "changes of the strategy; refused | " << strategies.changes << "; "
          << strategies.refused << "\n"
          << "choices; the rarest was taken | " << strategies.choices() << "; "
          << strategies.rarest() << " times\n"
          << "messages of odometry; of observations | " << heard.odometry.size() << "; "
          << observations << "\n"
          << "poses; other messages and markers looked at | " << heard.poses << "; "
          << finite - heard.poses << "\n"
          << "of these with a number that is not finite | " << not_finite << "\n"
          << "updates; renewals | " << heard.status.updates << "; " << heard.status.renewals << "\n"
          << "observations dropped for overload; rejected | " << dropped << "; " << rejected << "\n"
          << "error of the pose: median; 95 %; largest | " << text(errors) << "\n"
          << "the same, the path aligned as a whole | " << text(aligned) << "\n"
          << "memory, mean of each sixth of the time | " << sixths << " MiB\n"
          << "without the first sixth, first half: mean; most | " << text(first) << "\n"
          << "second half: mean; most | " << text(second) << "\n";
  figures.close();

  EXPECT_EQ(strategies.refused, 0);
  EXPECT_EQ(not_finite, 0);
  // From the first pose on one for each message of odometry.
  EXPECT_GT(heard.poses, 0.99 * static_cast<double>(heard.odometry.size()));
  EXPECT_LT(errors[errors.size() / 2], settings.param("maximum_error", 1.0));
  EXPECT_LT(second.most, 1.05 * first.most + 4.0);
  EXPECT_LT(second.mean, 1.05 * first.mean + 4.0);
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "check_soak");
  return RUN_ALL_TESTS();
}
