#include "rviz_panel/filter_connection.hpp"

#include <dynamic_reconfigure/Reconfigure.h>
#include <pf_resampling/LoadMap.h>
#include <pf_resampling/SaveMap.h>
#include <ros/master.h>
#include <ros/network.h>
#include <std_srvs/Empty.h>

#include <algorithm>
#include <chrono>
#include <set>

#include "src/node/service_folder.hpp"
#include "src/pipeline/pipeline_options.hpp"

namespace pf_resampling {
namespace {

constexpr double kLookPeriod = 1.0;  // s

bool service_exists(const std::string& name) {
  XmlRpc::XmlRpcValue request, response, payload;
  request[0] = ros::this_node::getName();
  request[1] = name;
  return ros::master::execute("lookupService", request, response, payload, false);
}

// Not the cached one: a master that was started again has another.
std::string run_id() {
  std::string id;
  ros::param::get("/run_id", id);
  return id;
}

// Where a node of this machine keeps the files of its services.
std::string folder_of(const std::string& node) {
  XmlRpc::XmlRpcValue request, response, payload;
  request[0] = ros::this_node::getName();
  request[1] = node;
  std::string host;
  std::uint32_t port = 0;
  if (!ros::master::execute("lookupNode", request, response, payload, false) ||
      !ros::network::splitURI(payload, host, port) || host != ros::network::getHost()) {
    return "";
  }
  std::string folder = PipelineOptions().directory;
  ros::param::get(node + "/map_file/directory", folder);
  return ServiceFolder(folder).path();
}

std::string parent_of(const std::string& name) {
  return name.substr(0, name.rfind('/') + 1);
}

// Nodes with parameters to set and a filter's status in the same namespace.
std::vector<std::string> filters_among(const ros::master::V_TopicInfo& topics) {
  static const std::string kDescriptions = "/parameter_descriptions";
  std::set<std::string> spaces;
  for (const auto& topic : topics) {
    if (topic.datatype == "pf_resampling/FilterStatus") spaces.insert(parent_of(topic.name));
  }
  std::vector<std::string> filters;
  for (const auto& topic : topics) {
    if (topic.name.size() <= kDescriptions.size()) continue;
    const std::size_t end = topic.name.size() - kDescriptions.size();
    if (topic.name.compare(end, std::string::npos, kDescriptions) != 0) continue;
    const std::string node = topic.name.substr(0, end);
    if (spaces.count(parent_of(node)) > 0) filters.push_back(node);
  }
  std::sort(filters.begin(), filters.end());
  return filters;
}

}  // namespace

FilterConnection::FilterConnection(double patience) : patience_(patience), spinner_(1, &queue_) {
  node_.setCallbackQueue(&queue_);
  spinner_.start();
  worker_ = std::thread([this] { work(); });
}

FilterConnection::~FilterConnection() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
    jobs_.clear();
    if (is_calling_) call_.shutdown();
  }
  wake_.notify_all();
  worker_.join();
  spinner_.stop();
}

void FilterConnection::connect(const std::string& node) {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::string error;
  filter_ = ros::names::validate(node, error) ? ros::names::resolve(node) : std::string("/");
  ++generation_;
  jobs_.clear();
  news_ = FilterNews();
  wake_.notify_all();
}

FilterNews FilterConnection::take_news() {
  const std::lock_guard<std::mutex> lock(mutex_);
  FilterNews news;
  std::swap(news, news_);
  news_.presence = news.presence;
  news.is_calling = is_calling_;
  if (is_calling_ && !call_given_up_ && (ros::WallTime::now() - call_since_).toSec() > patience_) {
    call_given_up_ = true;
    call_.shutdown();  // the call returns
  }
  return news;
}

void FilterConnection::set(const dynamic_reconfigure::Config& values) {
  post([this, values] {
    dynamic_reconfigure::Reconfigure service;
    service.request.config = values;
    if (!call(name_of("~set_parameters"), &service, "refused")) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    news_.values = service.response.config;
  });
}

void FilterConnection::global_localization() {
  post([this] { call_empty(name_of("global_localization"), "Searching everywhere"); });
}

void FilterConnection::reset() {
  post([this] { call_empty(name_of("reset"), "Started from nothing"); });
}

void FilterConnection::save_map(const std::string& file) {
  post([this, file] {
    SaveMap service;
    service.request.file = file;
    call_and_report(name_of("save_map"), service);
  });
}

void FilterConnection::load_map(const std::string& file, bool frozen) {
  post([this, file, frozen] {
    LoadMap service;
    service.request.file = file;
    service.request.frozen = frozen;
    call_and_report(name_of("load_map"), service);
  });
}

// ---- the worker thread ------------------------------------------------------------------------

void FilterConnection::work() {
  while (true) {
    Job job;
    {
      std::unique_lock<std::mutex> lock(mutex_);
      wake_.wait_for(lock, std::chrono::milliseconds(200), [this] {
        return stop_ || !jobs_.empty() || generation_ != subscribed_generation_;
      });
      if (stop_) return;
      if (!jobs_.empty()) {
        job = std::move(jobs_.front());
        jobs_.pop_front();
      }
    }
    if (job) {
      job();
    } else {
      look_around();
    }
  }
}

void FilterConnection::look_around() {
  std::string filter;
  int generation = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    filter = filter_;
    generation = generation_;
  }
  const bool is_new = generation != subscribed_generation_;
  if (filter.empty() || (!is_new && ros::WallTime::now() < next_look_)) return;
  next_look_ = ros::WallTime::now() + ros::WallDuration(kLookPeriod);

  FilterPresence presence;
  presence.master = ros::master::check();
  if (presence.master) {
    const std::string id = run_id();
    if (is_new || id != run_id_) {
      run_id_ = id;
      subscribe();
    }
    presence.node = service_exists(filter + "/set_parameters");
    const std::string space = parent_of(filter);
    presence.global_localization = service_exists(space + "global_localization");
    presence.reset = service_exists(space + "reset");
    presence.save_map = service_exists(space + "save_map");
    presence.load_map = service_exists(space + "load_map");
    if (presence.node) presence.folder = folder_of(filter);
    ros::master::V_TopicInfo topics;
    if (ros::master::getTopics(topics)) presence.filters = filters_among(topics);
  } else if (is_new) {
    // Subscribing would wait for the master; it is done when there is one.
    subscribers_.clear();
    run_id_.clear();
    subscribed_generation_ = generation;
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  if (generation == generation_) news_.presence = presence;
}

void FilterConnection::subscribe() {
  subscribers_.clear();
  std::string filter;
  int generation = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    filter = filter_;
    generation = generation_;
  }
  subscribed_generation_ = generation;
  const std::string space = parent_of(filter);
  // What was under way when the filter changed is dropped.
  const auto if_current = [this, generation](const auto& take) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (generation == generation_) take();
  };
  using dynamic_reconfigure::Config;
  using dynamic_reconfigure::ConfigDescription;
  subscribers_.push_back(node_.subscribe<ConfigDescription>(
      filter + "/parameter_descriptions", 2,
      [this, if_current](const ConfigDescription::ConstPtr& message) {
        if_current([&] { news_.description = *message; });
      }));
  subscribers_.push_back(node_.subscribe<Config>(
      filter + "/parameter_updates", 10, [this, if_current](const Config::ConstPtr& message) {
        if_current([&] { news_.values = *message; });
      }));
  subscribers_.push_back(node_.subscribe<FilterStatus>(
      space + "status", 1000, [this, if_current](const FilterStatus::ConstPtr& message) {
        if_current([&] { news_.statuses.push_back(*message); });
      }));
}

void FilterConnection::post(Job job) {
  const std::lock_guard<std::mutex> lock(mutex_);
  jobs_.push_back(std::move(job));
  wake_.notify_all();
}

std::string FilterConnection::name_of(const std::string& name) {
  const std::lock_guard<std::mutex> lock(mutex_);
  return name[0] == '~' ? filter_ + "/" + name.substr(1) : parent_of(filter_) + name;
}

void FilterConnection::report(bool success, const std::string& text) {
  const std::lock_guard<std::mutex> lock(mutex_);
  news_.results.push_back({success, text});
}

template <typename Service>
void FilterConnection::call_and_report(const std::string& name, Service service) {
  if (call(name, &service)) report(service.response.success, service.response.message);
}

void FilterConnection::call_empty(const std::string& service, const std::string& done) {
  std_srvs::Empty empty;
  if (call(service, &empty)) report(true, done);
}

template <typename Service>
bool FilterConnection::call(const std::string& name, Service* service, const char* failed) {
  if (!ros::master::check()) {
    report(false, name + ": there is no ROS master");
    return false;
  }
  if (!service_exists(name)) {
    report(false, name + ": nobody offers this service");
    return false;
  }
  // A persistent client can be shut down while it waits.
  ros::ServiceClient client = node_.serviceClient<Service>(name, true);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (stop_) return false;
    call_ = client;
    call_since_ = ros::WallTime::now();
    is_calling_ = true;
    call_given_up_ = false;
  }
  const bool success = client.call(*service);
  bool given_up = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_calling_ = false;
    given_up = call_given_up_;
    call_ = ros::ServiceClient();
  }
  if (!success) {
    report(false, name + ": " + (given_up ? "no answer" : failed));
  }
  return success;
}

}  // namespace pf_resampling
