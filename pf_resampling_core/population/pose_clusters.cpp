#include "pf_resampling_core/population/pose_clusters.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/population/pose_statistics.hpp"

namespace pf_resampling {
namespace {

// What people take for one place.
constexpr double kSamePlace = 0.3;    // m
constexpr double kSameHeading = 0.5;  // rad

// Share of the weight, of all and of the cluster that is looked at, that a place has at least.
constexpr double kSmallestShare = 0.02;
// Share of the variance of two clusters that has to be between them: that of two Gaussians of equal
// weight whose means are 4 sigma apart. A Gaussian cut in half has 0.64, a uniform density 0.75.
constexpr double kSeparated = 0.8;
// So much of a bandwidth's square is variance that a few particles do not show: less than four of
// them are never two places.
constexpr double kUnseen = 0.375;
constexpr double kReach = 2.0;  // bandwidths, between neighbours
// A cluster within so much of the spread of all is looked at again by its own.
constexpr double kMuchSmaller = 0.6;
constexpr double kSmallestBandwidth = 0.01;  // m, rad: what is closer is one place
// Particles that are looked at; of more, so many are picked by their weights.
constexpr Eigen::Index kEnough = 500;

using Indices = std::vector<Eigen::Index>;

struct View {
  ConstArray weights, x, y, heading;
};

struct Part {
  Indices members;
  double weight = 0.0;
  PoseStatistics pose;

  double sigma(int k) const { return std::sqrt(std::max(0.0, pose.covariance(k, k))); }
  // Of a density in three dimensions that is to be seen by so many particles (Silverman 1986).
  double bandwidth(int k) const {
    return std::max(kSmallestBandwidth,
                    sigma(k) * std::pow(pose.effective_sample_size, -1.0 / 7.0));
  }
};

Part part_of(const View& all, Indices members) {
  const auto count = static_cast<Eigen::Index>(members.size());
  Eigen::ArrayXd w(count), x(count), y(count), heading(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index k = members[static_cast<std::size_t>(i)];
    w[i] = all.weights[k];
    x[i] = all.x[k];
    y[i] = all.y[k];
    heading[i] = all.heading[k];
  }
  Part part;
  part.members = std::move(members);
  part.weight = w.sum();
  if (!(part.weight > 0.0)) return part;
  part.pose = pose_statistics(w / part.weight, x, y, heading);
  return part;
}

// Sets of particles of a whole that chains of neighbours connect; those
// of little weight are left out.
std::vector<Part> components(const View& all, const Part& whole) {
  const Eigen::Array3d reach =
      kReach * Eigen::Array3d(whole.bandwidth(0), whole.bandwidth(1), whole.bandwidth(2));
  std::vector<Part> found;
  Indices left = whole.members;
  while (!left.empty()) {
    Indices members = {left.back()};
    left.pop_back();
    for (std::size_t i = 0; i < members.size(); ++i) {
      const Eigen::Index one = members[i];
      const auto near = std::partition(left.begin(), left.end(), [&](Eigen::Index other) {
        return std::abs(all.x[one] - all.x[other]) > reach[0] ||
               std::abs(all.y[one] - all.y[other]) > reach[1] ||
               std::abs(wrap_angle(all.heading[one] - all.heading[other])) > reach[2];
      });
      members.insert(members.end(), near, left.end());
      left.erase(near, left.end());
    }
    std::sort(members.begin(), members.end());
    Part part = part_of(all, std::move(members));
    if (part.weight >= kSmallestShare * whole.weight) found.push_back(std::move(part));
  }
  return found;
}

// Share of the variance of both together that is between them, the larger of that of the position
// along the line between them and that of the heading.
double separation(const Part& a, const Part& b) {
  const double share = a.weight / (a.weight + b.weight);
  const double unseen =
      kUnseen * std::pow(a.pose.effective_sample_size + b.pose.effective_sample_size, -2.0 / 7.0);
  const auto share_between = [&](double distance, double variance_a, double variance_b) {
    const double between = share * (1.0 - share) * distance * distance;
    const double all = between + share * variance_a + (1.0 - share) * variance_b;
    return between / std::max((1.0 + unseen) * all, kSmallestBandwidth * kSmallestBandwidth);
  };
  const Eigen::Vector2d line(b.pose.mean.x - a.pose.mean.x, b.pose.mean.y - a.pose.mean.y);
  const double distance = line.norm();
  const auto variance = [&](const Part& part) {
    const Eigen::Vector2d along = line / std::max(distance, kSmallestBandwidth);
    return (along.transpose() * part.pose.covariance.topLeftCorner<2, 2>() * along).value();
  };
  return std::max(share_between(distance, variance(a), variance(b)),
                  share_between(wrap_angle(b.pose.mean.heading - a.pose.mean.heading),
                                a.pose.covariance(2, 2), b.pose.covariance(2, 2)));
}

// The least separated two first, until all are two places.
void merge_what_is_one(const View& all, std::vector<Part>* parts) {
  while (parts->size() > 1) {
    double least = std::numeric_limits<double>::infinity();
    std::pair<std::size_t, std::size_t> two;
    for (std::size_t a = 0; a < parts->size(); ++a) {
      for (std::size_t b = a + 1; b < parts->size(); ++b) {
        const double separated = separation((*parts)[a], (*parts)[b]);
        if (separated >= least) continue;
        least = separated;
        two = {a, b};
      }
    }
    if (least >= kSeparated) return;
    Indices members = (*parts)[two.first].members;
    const Indices& more = (*parts)[two.second].members;
    members.insert(members.end(), more.begin(), more.end());
    (*parts)[two.first] = part_of(all, std::move(members));
    parts->erase(parts->begin() + static_cast<std::ptrdiff_t>(two.second));
  }
}

void find(const View& all, const Part& whole, std::vector<PoseCluster>* found) {
  std::vector<Part> parts = components(all, whole);
  merge_what_is_one(all, &parts);
  const auto is_smaller = [&](int k) {
    return parts.front().bandwidth(k) < kMuchSmaller * whole.bandwidth(k);
  };
  if (parts.size() > 1 ||
      (parts.size() == 1 && (is_smaller(0) || is_smaller(1) || is_smaller(2)))) {
    for (const Part& part : parts) find(all, part, found);
  } else {
    found->push_back({whole.weight, {whole.pose.mean, whole.pose.covariance}});
  }
}

// How often each particle is picked, once in each of so many equal parts of the weight, by
// stratified resampling. Where in its part follows the golden ratio: particles may come in turns,
// as antithetic ones do, of which equal steps would see every second only. What was picked twice
// counts twice, and is still one particle.
Eigen::ArrayXd picks(ConstArray weights) {
  constexpr double kGolden = 0.6180339887498949;
  const double step = weights.sum() / static_cast<double>(kEnough);
  Eigen::ArrayXd picked = Eigen::ArrayXd::Zero(weights.size());
  double sum = 0.0, part = 0.0, within = 0.5;
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    sum += weights[i];
    for (; (part + within) * step < sum && part < static_cast<double>(kEnough); part += 1.0) {
      picked[i] += 1.0;
      within += within < 1.0 - kGolden ? kGolden : kGolden - 1.0;
    }
  }
  return picked;
}

}  // namespace

PoseClusters pose_clusters(ConstArray weights, ConstArray x, ConstArray y, ConstArray heading,
                           int most) {
  PoseClusters found;
  if (!(weights.sum() > 0.0)) return found;
  const Eigen::ArrayXd picked = weights.size() > kEnough ? picks(weights) : Eigen::ArrayXd(weights);
  Indices members;
  for (Eigen::Index i = 0; i < picked.size(); ++i) {
    if (picked[i] > 0.0) members.push_back(i);
  }
  const View all = {picked, x, y, heading};
  const Part whole = part_of(all, std::move(members));
  std::vector<PoseCluster>& clusters = found.clusters;
  find(all, whole, &clusters);
  for (PoseCluster& cluster : clusters) cluster.weight /= whole.weight;
  std::stable_sort(clusters.begin(), clusters.end(),
                   [](const PoseCluster& a, const PoseCluster& b) { return a.weight > b.weight; });
  while (clusters.size() > static_cast<std::size_t>(std::max(most, 0)) ||
         (clusters.size() > 1 && clusters.back().weight < kSmallestShare)) {
    clusters.pop_back();
  }
  for (const PoseCluster& cluster : clusters) found.rest -= cluster.weight;
  found.rest = std::max(0.0, found.rest);
  return found;
}

std::string sentence_of(const PoseClusters& found) {
  // Those beside a heavier one are the same place to people.
  std::vector<PoseCluster> places;
  for (const PoseCluster& cluster : found.clusters) {
    const Pose2& mean = cluster.pose.mean;
    const auto same = std::find_if(places.begin(), places.end(), [&](const PoseCluster& place) {
      const Pose2& there = place.pose.mean;
      return std::hypot(mean.x - there.x, mean.y - there.y) < kSamePlace &&
             std::abs(wrap_angle(mean.heading - there.heading)) < kSameHeading;
    });
    if (same == places.end()) {
      places.push_back(cluster);
    } else {
      same->weight += cluster.weight;
    }
  }
  if (places.size() < 2) return "";
  std::string text = std::to_string(places.size()) + " places fit: ";
  std::array<char, 96> words{};
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Pose2& mean = places[i].pose.mean;
    std::snprintf(words.data(), words.size(), "%s%.0f %% at (%.2f, %.2f) m, %.2f rad",
                  i == 0 ? "" : "; ", 100.0 * places[i].weight, mean.x, mean.y, mean.heading);
    text += words.data();
  }
  return text;
}

}  // namespace pf_resampling
