#pragma once

#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/ConfigDescription.h>
#include <pf_resampling/FilterStatus.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <visualization_msgs/MarkerArray.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace pf_resampling {

/// How a call of a service ended, in words.
struct CallResult {
  bool success = false;
  std::string text;
};

/// What a filter offers at present, and what has come since it was last asked for.
struct FilterNews {
  bool master = false;
  bool node = false;               ///< its parameters can be set
  std::set<std::string> services;  ///< of kFilterServices
  bool is_calling = false;         ///< a call is on its way
  std::optional<dynamic_reconfigure::ConfigDescription> description;
  std::optional<dynamic_reconfigure::Config> values;
  std::vector<FilterStatus> statuses;
  std::vector<CallResult> results;
  std::vector<visualization_msgs::MarkerArray> markers;
};

inline constexpr const char* kFilterServices[] = {"global_localization", "reset", "save_map",
                                                  "load_map"};

/// The connection to a filter's node for a program that must not wait: dynamic_reconfigure client
/// and subscriber of `status` and `markers`. No function here waits, whatever node and master do;
/// all talking is done in threads of its own. A node or a master that comes back is found again.
class FilterConnection {
 public:
  /// `node`: "/robot1/fastslam"; relative names are in the program's namespace. Topics and services
  /// of a filter are in the namespace of its node.
  explicit FilterConnection(const std::string& node);
  ~FilterConnection();
  FilterConnection(const FilterConnection&) = delete;
  FilterConnection& operator=(const FilterConnection&) = delete;

  /// To be called some times per second.
  FilterNews take_news();

  void set(const dynamic_reconfigure::Config& values);
  /// A service that takes nothing; `done` is what is said afterwards.
  void call(const std::string& service, const std::string& done);
  void save_map(const std::string& file);
  /// Localizes in the map as it is if it is `frozen`; else continues to map.
  void load_map(const std::string& file, bool frozen);

 private:
  void work();
  void look_around();
  void subscribe();
  /// What comes on a topic is for `take`, which is called with the mutex held.
  template <typename Message, typename Take>
  void listen(const std::string& topic, std::uint32_t queue, const Take& take);
  void report(bool success, const std::string& text);
  /// Calls `name` in the worker thread, and hands what it answers to `take`.
  template <typename Service, typename Take>
  void post(const std::string& name, Service service, const Take& take);
  template <typename Service>
  bool wait_for(const std::string& name, Service* service);

  std::string filter_, space_;  // the node, resolved, and its namespace

  std::mutex mutex_;  // of what follows
  std::condition_variable wake_;
  std::deque<std::function<void()>> jobs_;
  bool stop_ = false;
  FilterNews news_;
  ros::ServiceClient call_;  // the one that is waited for

  // Of the worker thread.
  std::string run_id_;
  ros::WallTime next_look_;

  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  std::vector<ros::Subscriber> subscribers_;
  ros::AsyncSpinner spinner_;
  std::thread worker_;
};

}  // namespace pf_resampling
