#pragma once

#include <pf_resampling/LandmarkMap.h>
#include <ros/serialization.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
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

/// The markers of a name in an array.
inline std::vector<visualization_msgs::Marker> markers_called(
    const visualization_msgs::MarkerArray& array, const std::string& name) {
  std::vector<visualization_msgs::Marker> found;
  std::copy_if(array.markers.begin(), array.markers.end(), std::back_inserter(found),
               [&](const visualization_msgs::Marker& marker) { return marker.ns == name; });
  return found;
}

/// The message of the first of the last diagnostics' entries whose name ends like this.
inline std::string said(const Outputs& out, const std::string& end) {
  for (const auto& status : out.diagnostics.back().status) {
    const std::size_t place = status.name.rfind(end);
    if (place != std::string::npos && place + end.size() == status.name.size()) {
      return status.message;
    }
  }
  return "there is no " + end;
}

inline bool is_finite(const geometry_msgs::Point& point) {
  return std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z);
}

inline bool is_finite(const visualization_msgs::Marker& marker) {
  return is_finite(marker.pose) &&
         std::isfinite(marker.scale.x + marker.scale.y + marker.scale.z) &&
         std::all_of(marker.points.begin(), marker.points.end(),
                     [](const geometry_msgs::Point& point) { return is_finite(point); });
}

/// Of its particles, by their weights; NaN if these do not add up to one.
inline double mean_x_of(const sensor_msgs::PointCloud2& cloud) {
  double x = 0.0;
  double sum = 0.0;
  for (std::size_t i = 0; i < cloud.width; ++i) {
    float values[5];  // x, y, z, heading, weight
    std::memcpy(values, &cloud.data[i * cloud.point_step], sizeof(values));
    x += static_cast<double>(values[4] * values[0]);
    sum += static_cast<double>(values[4]);
  }
  return std::abs(sum - 1.0) < 1e-4 ? x : std::nan("");
}

/// Five numbers and the ancestor are a particle.
inline bool is_finite(const sensor_msgs::PointCloud2& cloud) {
  for (std::size_t at = 0; at < cloud.data.size(); at += cloud.point_step) {
    std::array<float, 5> numbers{};
    std::memcpy(numbers.data(), &cloud.data[at], sizeof numbers);
    for (const float number : numbers) {
      if (!std::isfinite(number)) return false;
    }
  }
  return true;
}

inline bool is_finite(const LandmarkMap& map) {
  bool finite = true;
  for (const Landmark& landmark : map.landmarks) {
    finite = finite && is_finite(landmark.position);
    for (const double number : landmark.covariance) finite = finite && std::isfinite(number);
  }
  return finite;
}

inline bool is_finite(const FilterStatus& status) {
  double sum = status.effective_sample_size + status.entropy_sample_size +
               status.range_noise_scale + status.bearing_noise_scale + status.odometry_noise_scale +
               status.log_likelihood + status.innovation + status.innovation_sigma +
               status.update_time + status.latency + status.lost + status.normalized_innovation +
               status.other_weight + status.yaw_rate_bias + status.yaw_rate_bias_sigma +
               status.redraw_innovation;
  for (const CalibrationStatus& radio : status.calibration) {
    sum += radio.scale + radio.scale_sigma + radio.bias + radio.bias_sigma;
  }
  for (const SystematicError& error : status.systematic_errors) sum += error.value + error.sigma;
  for (const FindingStatus& finding : status.findings) {
    sum += finding.place.x + finding.place.y + finding.size + finding.sigma;
  }
  bool finite = std::isfinite(sum);
  for (const PoseHypothesis& hypothesis : status.hypotheses) {
    finite = finite && std::isfinite(hypothesis.weight) && is_finite(hypothesis.pose.pose) &&
             to_covariance3(hypothesis.pose.covariance).allFinite();
  }
  return finite;
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
    for (const auto& marker : array.markers) finite = finite && is_finite(marker);
  }
  for (const auto& transform : out.transforms) {
    finite = finite && std::isfinite(transform.transform.translation.x) &&
             std::isfinite(transform.transform.translation.y) &&
             is_unit(transform.transform.rotation);
  }
  for (const auto& status : out.statuses) finite = finite && is_finite(status);
  return finite;
}

}  // namespace pf_resampling
