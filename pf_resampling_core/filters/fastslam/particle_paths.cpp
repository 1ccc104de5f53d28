#include "pf_resampling_core/filters/fastslam/particle_paths.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace pf_resampling {
namespace {

constexpr int kCompactionPeriod = 32;  // steps

// Sums of weighted poses; headings on the circle.
struct PoseSum {
  void add(const Pose2& pose, double weight) {
    x += weight * pose.x;
    y += weight * pose.y;
    cosine += weight * std::cos(pose.heading);
    sine += weight * std::sin(pose.heading);
    total += weight;
  }
  Pose2 mean() const { return {x / total, y / total, std::atan2(sine, cosine)}; }

  double x = 0.0, y = 0.0, cosine = 0.0, sine = 0.0, total = 0.0;
};

}  // namespace

void ParticlePaths::clear() {
  common_.clear();
  recent_.clear();
  parents_.clear();
  since_compaction_ = 0;
}

std::size_t ParticlePaths::size() const {
  return std::accumulate(recent_.begin(), recent_.end(), common_.size(),
                         [](std::size_t sum, const Step& step) { return sum + step.poses.size(); });
}

void ParticlePaths::append(ConstArray x, ConstArray y, ConstArray heading) {
  const std::size_t count = static_cast<std::size_t>(x.size());
  Step step;
  step.poses.reserve(count);
  for (Eigen::Index i = 0; i < x.size(); ++i) step.poses.push_back({x[i], y[i], heading[i]});
  step.parents = parents_;
  step.parents.resize(count, 0);
  recent_.push_back(std::move(step));
  parents_.resize(count);
  std::iota(parents_.begin(), parents_.end(), 0);
  if (++since_compaction_ >= kCompactionPeriod) compact();
}

void ParticlePaths::select(ConstIndices ancestors) {
  if (steps() == 0) return;
  std::vector<int> selected(static_cast<std::size_t>(ancestors.size()));
  for (Eigen::Index i = 0; i < ancestors.size(); ++i) {
    selected[static_cast<std::size_t>(i)] = parents_[static_cast<std::size_t>(ancestors[i])];
  }
  parents_ = std::move(selected);
}

void ParticlePaths::replace_newest(const std::vector<Pose2>& poses, ConstArray weights,
                                   int particles) {
  std::vector<Pose2> path = mean(weights);
  if (path.empty() || poses.empty()) return;
  const std::size_t newest = std::min(path.size(), poses.size());
  std::copy(poses.end() - static_cast<std::ptrdiff_t>(newest), poses.end(),
            path.end() - static_cast<std::ptrdiff_t>(newest));
  clear();
  recent_.push_back({{path.back()}, {0}});
  path.pop_back();
  common_ = std::move(path);
  parents_.assign(static_cast<std::size_t>(particles), 0);
}

// From the newest step back, only what has descendants stays.
void ParticlePaths::compact() {
  since_compaction_ = 0;
  std::vector<int>* children = &parents_;
  for (auto step = recent_.rbegin(); step != recent_.rend(); ++step) {
    std::vector<int> place(step->poses.size(), -1);
    Step kept;
    for (int& parent : *children) {
      const std::size_t old = static_cast<std::size_t>(parent);
      if (place[old] < 0) {
        place[old] = static_cast<int>(kept.poses.size());
        kept.poses.push_back(step->poses[old]);
        kept.parents.push_back(step->parents[old]);
      }
      parent = place[old];
    }
    *step = std::move(kept);
    children = &step->parents;
  }
  while (recent_.size() > 1 && recent_.front().poses.size() == 1) {
    common_.push_back(recent_.front().poses.front());
    recent_.pop_front();
  }
  while (recent_.size() > 1 && size() - common_.size() > largest_) {
    PoseSum sum;
    for (const Pose2& pose : recent_.front().poses) sum.add(pose, 1.0);
    common_.push_back(sum.mean());
    recent_.pop_front();
    for (int& parent : recent_.front().parents) parent = 0;
  }
}

std::vector<Pose2> ParticlePaths::mean(ConstArray weights) const {
  std::vector<Pose2> path = common_;
  path.resize(steps());
  // The weight of a pose is that of its descendants.
  std::vector<double> of_children(weights.data(), weights.data() + weights.size());
  const std::vector<int>* parents = &parents_;
  for (std::size_t k = recent_.size(); k-- > 0;) {
    const Step& step = recent_[k];
    std::vector<double> own(step.poses.size(), 0.0);
    for (std::size_t i = 0; i < of_children.size(); ++i) {
      own[static_cast<std::size_t>((*parents)[i])] += of_children[i];
    }
    PoseSum sum;
    for (std::size_t i = 0; i < own.size(); ++i) sum.add(step.poses[i], own[i]);
    path[common_.size() + k] = sum.mean();
    of_children = std::move(own);
    parents = &step.parents;
  }
  return path;
}

}  // namespace pf_resampling
