#pragma once

#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/ConfigDescription.h>
#include <pf_resampling/FilterStatus.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace pf_resampling {

/// What a filter offers at present.
struct FilterPresence {
  bool master = false;
  bool node = false;  ///< its parameters can be set
  bool global_localization = false, reset = false, save_map = false, load_map = false;
  /// Where it keeps maps; empty: on another machine.
  std::string folder;
  std::vector<std::string> filters;  ///< nodes that could be chosen
};

/// How a call of a service ended, in words.
struct CallResult {
  bool success = false;
  std::string text;
};

/// What has come since it was last asked for.
struct FilterNews {
  FilterPresence presence;
  std::optional<dynamic_reconfigure::ConfigDescription> description;
  std::optional<dynamic_reconfigure::Config> values;
  std::vector<FilterStatus> statuses;
  std::vector<CallResult> results;
  bool is_calling = false;  ///< a call is on its way
};

/// The connection to a filter's node for a program that must not wait: dynamic_reconfigure client
/// and subscriber of `status`. No function here waits, whatever node and master do; all talking is
/// done in threads of its own. A node or a master that comes back is found again.
class FilterConnection {
 public:
  /// A call without an answer is given up after `patience` s.
  explicit FilterConnection(double patience = 5.0);
  ~FilterConnection();
  FilterConnection(const FilterConnection&) = delete;
  FilterConnection& operator=(const FilterConnection&) = delete;

  /// Talks to another filter from now on: "/robot1/fastslam"; relative names are in the program's
  /// namespace. Topics and services of a filter are in the namespace of its node.
  void connect(const std::string& node);
  /// To be called some times per second.
  FilterNews take_news();

  void set(const dynamic_reconfigure::Config& values);
  void global_localization();
  void reset();
  void save_map(const std::string& file);
  /// Localizes in the map as it is if it is `frozen`; else continues to map.
  void load_map(const std::string& file, bool frozen);

 private:
  using Job = std::function<void()>;

  void work();
  void look_around();
  void subscribe();
  void post(Job job);
  /// The full name of what the filter calls `name`.
  std::string name_of(const std::string& name);
  void report(bool success, const std::string& text);
  template <typename Service>
  void call_and_report(const std::string& name, Service service);
  void call_empty(const std::string& service, const std::string& done);
  template <typename Service>
  bool call(const std::string& name, Service* service, const char* failed = "the call failed");

  const double patience_;

  std::mutex mutex_;  // of what follows
  std::condition_variable wake_;
  std::deque<Job> jobs_;
  bool stop_ = false;
  std::string filter_;  // node, resolved
  int generation_ = 0;  // of the filter: what was under way for others is dropped
  FilterNews news_;
  ros::ServiceClient call_;  // the one that is waited for
  ros::WallTime call_since_;
  bool is_calling_ = false, call_given_up_ = false;

  // Of the worker thread.
  int subscribed_generation_ = -1;
  std::string run_id_;
  ros::WallTime next_look_;

  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  std::vector<ros::Subscriber> subscribers_;
  ros::AsyncSpinner spinner_;
  std::thread worker_;
};

}  // namespace pf_resampling
