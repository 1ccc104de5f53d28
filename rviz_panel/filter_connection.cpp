#include "rviz_panel/filter_connection.hpp"

#include <dynamic_reconfigure/Reconfigure.h>
#include <pf_resampling/LoadMap.h>
#include <pf_resampling/SaveMap.h>
#include <ros/master.h>
#include <std_srvs/Empty.h>

#include <chrono>
#include <utility>

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

}  // namespace

FilterConnection::FilterConnection(const std::string& node) : spinner_(1, &queue_) {
  std::string error;
  filter_ = ros::names::validate(node, error) ? ros::names::resolve(node) : std::string("/");
  space_ = filter_.substr(0, filter_.rfind('/') + 1);
  node_.setCallbackQueue(&queue_);
  spinner_.start();
  worker_ = std::thread([this] { work(); });
}

FilterConnection::~FilterConnection() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
    if (news_.is_calling) call_.shutdown();  // the call returns
  }
  wake_.notify_all();
  worker_.join();
  spinner_.stop();
}

FilterNews FilterConnection::take_news() {
  const std::lock_guard<std::mutex> lock(mutex_);
  FilterNews next;
  next.master = news_.master;
  next.node = news_.node;
  next.services = news_.services;
  next.is_calling = news_.is_calling;
  return std::exchange(news_, next);
}

void FilterConnection::set(const dynamic_reconfigure::Config& values) {
  dynamic_reconfigure::Reconfigure service;
  service.request.config = values;
  post(filter_ + "/set_parameters", service, [this](const auto& response) {
    const std::lock_guard<std::mutex> lock(mutex_);
    news_.values = response.config;
  });
}

void FilterConnection::call(const std::string& service, const std::string& done) {
  post(space_ + service, std_srvs::Empty(), [this, done](const auto&) { report(true, done); });
}

void FilterConnection::save_map(const std::string& file) {
  SaveMap service;
  service.request.file = file;
  post(space_ + "save_map", service,
       [this](const auto& response) { report(response.success, response.message); });
}

void FilterConnection::load_map(const std::string& file, bool frozen) {
  LoadMap service;
  service.request.file = file;
  service.request.frozen = frozen;
  post(space_ + "load_map", service,
       [this](const auto& response) { report(response.success, response.message); });
}

// ---- the worker thread ------------------------------------------------------------------------

void FilterConnection::work() {
  while (true) {
    std::function<void()> job = [this] { look_around(); };
    {
      std::unique_lock<std::mutex> lock(mutex_);
      wake_.wait_for(lock, std::chrono::milliseconds(200),
                     [this] { return stop_ || !jobs_.empty() || next_look_.isZero(); });
      if (stop_) return;
      if (!jobs_.empty()) {
        job = std::move(jobs_.front());
        jobs_.pop_front();
      }
    }
    job();
  }
}

void FilterConnection::look_around() {
  if (ros::WallTime::now() < next_look_) return;
  next_look_ = ros::WallTime::now() + ros::WallDuration(kLookPeriod);
  const bool master = ros::master::check();
  bool node = false;
  std::set<std::string> services;
  if (master) {
    // Subscribing would wait for a master.
    const std::string id = run_id();
    if (subscribers_.empty() || id != run_id_) {
      run_id_ = id;
      subscribe();
    }
    node = service_exists(filter_ + "/set_parameters");
    for (const char* service : kFilterServices) {
      if (service_exists(space_ + service)) services.insert(service);
    }
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  news_.master = master;
  news_.node = node;
  news_.services = services;
}

template <typename Message, typename Take>
void FilterConnection::listen(const std::string& topic, std::uint32_t queue, const Take& take) {
  subscribers_.push_back(node_.subscribe<Message>(
      topic, queue, [this, take](const boost::shared_ptr<const Message>& message) {
        const std::lock_guard<std::mutex> lock(mutex_);
        take(*message);
      }));
}

void FilterConnection::subscribe() {
  using namespace dynamic_reconfigure;
  subscribers_.clear();
  listen<ConfigDescription>(filter_ + "/parameter_descriptions", 2,
                            [this](const auto& message) { news_.description = message; });
  listen<Config>(filter_ + "/parameter_updates", 10,
                 [this](const auto& message) { news_.values = message; });
  listen<FilterStatus>(space_ + "status", 1000,
                       [this](const auto& message) { news_.statuses.push_back(message); });
  listen<visualization_msgs::MarkerArray>(
      space_ + "markers", 100, [this](const auto& message) { news_.markers.push_back(message); });
}

void FilterConnection::report(bool success, const std::string& text) {
  const std::lock_guard<std::mutex> lock(mutex_);
  news_.results.push_back({success, text});
}

template <typename Service, typename Take>
void FilterConnection::post(const std::string& name, Service service, const Take& take) {
  const std::lock_guard<std::mutex> lock(mutex_);
  jobs_.push_back([this, name, service, take]() mutable {
    if (wait_for(name, &service)) take(service.response);
  });
  wake_.notify_all();
}

template <typename Service>
bool FilterConnection::wait_for(const std::string& name, Service* service) {
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
    news_.is_calling = true;
  }
  const bool success = client.call(*service);
  if (!success) report(false, name + ": refused, or broken off");
  const std::lock_guard<std::mutex> lock(mutex_);
  news_.is_calling = false;
  call_ = ros::ServiceClient();
  return success;
}

}  // namespace pf_resampling
