#pragma once

#include <ros/serialization.h>

#include <cmath>
#include <string>
#include <vector>

#include "src/messages/conversions.hpp"
#include "src/pictures/markers.hpp"
#include "src/pipeline/pipeline_sinks.hpp"

/// What the tests of both pipelines share.
namespace pf_resampling {

/// Everything that a pipeline gave out.
struct Outputs {
  std::vector<geometry_msgs::PoseWithCovarianceStamped> poses;
  std::vector<nav_msgs::Path> paths;
  std::vector<geometry_msgs::PoseArray> pose_arrays;
  std::vector<sensor_msgs::PointCloud2> clouds;
  std::vector<visualization_msgs::MarkerArray> markers;
  std::vector<FilterStatus> statuses;
  std::vector<diagnostic_msgs::DiagnosticArray> diagnostics;
  std::vector<geometry_msgs::TransformStamped> transforms;
  std::vector<std::string> log;
};

/// Sinks that collect into `out`, of what all pipelines give out.
inline void connect(Outputs* out, PipelineSinks* sinks) {
  sinks->pose = [out](const auto& message) { out->poses.push_back(message); };
  sinks->path = [out](const auto& message) { out->paths.push_back(message); };
  sinks->particlecloud = [out](const auto& message) { out->pose_arrays.push_back(message); };
  sinks->particles = [out](const auto& message) { out->clouds.push_back(message); };
  sinks->markers = [out](const auto& message) { out->markers.push_back(message); };
  sinks->status = [out](const auto& message) { out->statuses.push_back(message); };
  sinks->diagnostics = [out](const auto& message) { out->diagnostics.push_back(message); };
  sinks->transform = [out](const auto& message) { out->transforms.push_back(message); };
  sinks->log = [out](LogLevel, const std::string& text) { out->log.push_back(text); };
}

template <typename Message>
std::string bytes_of(const Message& message) {
  std::string bytes(ros::serialization::serializationLength(message), '\0');
  ros::serialization::OStream stream(reinterpret_cast<std::uint8_t*>(&bytes[0]),
                                     static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);
  return bytes;
}

template <typename Message>
std::string bytes_of_all(const std::vector<Message>& messages) {
  std::string bytes;
  for (const Message& message : messages) bytes += bytes_of(message);
  return bytes;
}

/// Whether two series of messages agree in every byte; their bytes are nothing to print.
template <typename Message>
bool same_bytes(const std::vector<Message>& a, const std::vector<Message>& b) {
  return bytes_of_all(a) == bytes_of_all(b);
}

inline std::string value_of(const diagnostic_msgs::DiagnosticArray& array, const std::string& key) {
  for (const auto& status : array.status) {
    for (const auto& value : status.values) {
      if (value.key == key) return value.value;
    }
  }
  return "";
}

inline bool all_finite(const Outputs& out) {
  bool finite = true;
  for (const auto& pose : out.poses) {
    finite =
        finite && is_finite(pose.pose.pose) && to_covariance3(pose.pose.covariance).allFinite();
  }
  for (const auto& path : out.paths) {
    for (const auto& pose : path.poses) finite = finite && is_finite(pose.pose);
  }
  for (const auto& cloud : out.pose_arrays) {
    for (const auto& pose : cloud.poses) finite = finite && is_finite(pose);
  }
  for (const auto& cloud : out.clouds) finite = finite && is_finite(cloud);
  for (const auto& array : out.markers) {
    for (const auto& marker : array.markers) {
      finite = finite && is_finite(marker) &&
               std::isfinite(marker.scale.x + marker.scale.y + marker.scale.z);
    }
  }
  for (const auto& transform : out.transforms) {
    finite = finite && std::isfinite(transform.transform.translation.x) &&
             std::isfinite(transform.transform.translation.y) &&
             is_unit(transform.transform.rotation);
  }
  for (const auto& status : out.statuses) {
    finite = finite && std::isfinite(status.log_likelihood) && std::isfinite(status.innovation) &&
             std::isfinite(status.innovation_sigma) &&
             std::isfinite(status.effective_sample_size) &&
             std::isfinite(status.entropy_sample_size);
  }
  return finite;
}

}  // namespace pf_resampling
