#include "pf_resampling_core/population/pose_clusters.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <numeric>
#include <utility>

#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/population/pose_statistics.hpp"

namespace pf_resampling {
namespace {

// What people take for one place.
constexpr double kSamePlace = 0.3;    // m
constexpr double kSameHeading = 0.5;  // rad

using Indices = std::vector<Eigen::Index>;

// Share of the weight, of all and of the cluster that is looked at, that a place has at least.
constexpr double kSmallestShare = 0.02;
// Share of the variance of two clusters that has to be between them: that of two Gaussians of equal
// weight whose means are 4 sigma apart. A Gaussian cut in half has 0.64, a uniform density 0.75.
constexpr double kSeparated = 0.8;
// So much of a cell's square is variance that a few particles do not show: less than four of them
// are never two places.
constexpr double kUnseen = 0.375;
// Particles that no cell joins to a cluster belong to it within so many of its standard deviations
// and a cell.
constexpr double kNear = 5.0;
// Cells are not smaller: places that are closer are one place.
constexpr double kSmallestLength = 0.01;  // m
constexpr double kSmallestAngle = 0.01;   // rad
// Particles that are looked at; of more, so many are picked by their weights.
constexpr Eigen::Index kEnough = 10000;
// Of the places within places.
constexpr int kDeepest = 8;
// Cells beyond so many from the middle are taken together.
constexpr double kFarthestCell = 1e6;

struct View {
  ConstArray weights, x, y, heading;
};

struct Moments {
  double weight = 0.0;
  PoseEstimate pose;
  double effective = 0.0;
};

Moments moments_of(const View& all, const Indices& members) {
  const auto count = static_cast<Eigen::Index>(members.size());
  Eigen::ArrayXd w(count);
  Eigen::ArrayXd x(count);
  Eigen::ArrayXd y(count);
  Eigen::ArrayXd heading(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index k = members[static_cast<std::size_t>(i)];
    w[i] = all.weights[k];
    x[i] = all.x[k];
    y[i] = all.y[k];
    heading[i] = all.heading[k];
  }
  Moments moments;
  moments.weight = w.sum();
  if (!(moments.weight > 0.0)) return moments;
  w /= moments.weight;
  const PoseStatistics statistics = pose_statistics(w, x, y, heading);
  moments.pose = statistics;
  moments.effective = statistics.effective_sample_size;
  return moments;
}

double sigma(const Moments& moments, int k) {
  return std::sqrt(std::max(0.0, moments.pose.covariance(k, k)));
}

/// Lengths of the cells of a set of particles.
struct Grid {
  explicit Grid(const Moments& moments)
      : middle(moments.pose.mean),
        length_x(length(moments, 0, kSmallestLength)),
        length_y(length(moments, 1, kSmallestLength)),
        bins(static_cast<std::int64_t>(
            std::max(1.0, std::floor(2.0 * kPi / length(moments, 2, kSmallestAngle))))) {}

  /// Of a density in three dimensions that is to be seen by so many particles (Silverman 1986).
  static double length(const Moments& moments, int k, double smallest) {
    return std::max(smallest, sigma(moments, k) * std::pow(moments.effective, -1.0 / 7.0));
  }
  static std::uint64_t index(double offset) {
    const double cell = std::clamp(std::floor(offset), -kFarthestCell, kFarthestCell);
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(cell) + (1 << 20));
  }
  /// The column of (x, y), and with it the heading: neighbours of a column are a fixed number away.
  std::uint64_t column(double x, double y) const {
    return index((x - middle.x) / length_x) << 22 | index((y - middle.y) / length_y);
  }
  std::uint64_t cell(double x, double y, double heading) const {
    const double turns = (wrap_angle(heading - middle.heading) + kPi) / (2.0 * kPi);
    const auto bin = static_cast<std::int64_t>(turns * static_cast<double>(bins));
    return column(x, y) << 16 |
           static_cast<std::uint64_t>(std::clamp<std::int64_t>(bin, 0, bins - 1));
  }
  Pose2 middle;
  double length_x, length_y;
  std::int64_t bins;
};

class Sets {
 public:
  explicit Sets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }
  std::size_t root(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::size_t a, std::size_t b) {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::size_t> parent_;
};

/// Sets of particles whose cells touch one another.
std::vector<Indices> components(const View& all, const Indices& members, const Grid& grid) {
  std::vector<std::pair<std::uint64_t, std::size_t>> sorted;
  sorted.reserve(members.size());
  for (const Eigen::Index k : members) {
    sorted.emplace_back(grid.cell(all.x[k], all.y[k], all.heading[k]), sorted.size());
  }
  std::sort(sorted.begin(), sorted.end());
  std::vector<std::uint64_t> cells;
  std::vector<std::size_t> cell_of(members.size());
  for (const auto& [cell, i] : sorted) {
    if (cells.empty() || cells.back() != cell) cells.push_back(cell);
    cell_of[i] = cells.size() - 1;
  }
  Sets sets(cells.size());
  // Neighbours are fixed numbers away: half of the columns, whose others have this one as theirs,
  // and the headings beside each; the last and the first touch, too, where there is a first.
  const std::int64_t last = grid.bins - 1;
  std::vector<std::int64_t> turns = {-1, 0, 1};
  const auto is_first = [](std::uint64_t cell) { return cell % (1 << 16) == 0; };
  if (std::any_of(cells.begin(), cells.end(), is_first)) {
    turns.insert(turns.end(), {-last, last});
  }
  for (const std::int64_t column : {0, 1, (1 << 22) - 1, 1 << 22, (1 << 22) + 1}) {
    for (const std::int64_t turn : turns) {
      if (column == 0 && turn <= 0) continue;
      const auto offset = static_cast<std::uint64_t>(column * (1 << 16) + turn);
      std::size_t other = 0;
      for (std::size_t i = 0; i < cells.size(); ++i) {
        while (other < cells.size() && cells[other] < cells[i] + offset) ++other;
        if (other < cells.size() && cells[other] == cells[i] + offset) sets.join(i, other);
      }
    }
  }
  std::vector<std::size_t> place(cells.size(), cells.size());
  std::vector<Indices> found;
  for (std::size_t i = 0; i < members.size(); ++i) {
    const std::size_t root = sets.root(cell_of[i]);
    if (place[root] == cells.size()) {
      place[root] = found.size();
      found.emplace_back();
    }
    found[place[root]].push_back(members[i]);
  }
  return found;
}

// Shares of the variance of both together that are between them, the larger of that of the position
// along the line between them and that of the heading.
double separation(const Moments& a, const Moments& b, const Grid& grid) {
  const double share = a.weight / (a.weight + b.weight);
  const auto share_between = [&](double distance, double variance_a, double variance_b,
                                 double cell) {
    const double between = share * (1.0 - share) * distance * distance;
    const double within = share * variance_a + (1.0 - share) * variance_b + kUnseen * cell * cell;
    return between > 0.0 ? between / (between + within) : 0.0;
  };
  const Eigen::Vector2d line(b.pose.mean.x - a.pose.mean.x, b.pose.mean.y - a.pose.mean.y);
  const double distance = line.norm();
  const Eigen::Vector2d along =
      distance > 0.0 ? (line / distance).eval() : Eigen::Vector2d::UnitX();
  const auto variance = [&](const Moments& m) {
    return (along.transpose() * m.pose.covariance.topLeftCorner<2, 2>() * along).value();
  };
  const double cell = std::hypot(along.x() * grid.length_x, along.y() * grid.length_y);
  return std::max(
      share_between(distance, variance(a), variance(b), cell),
      share_between(wrap_angle(b.pose.mean.heading - a.pose.mean.heading), a.pose.covariance(2, 2),
                    b.pose.covariance(2, 2), 2.0 * kPi / static_cast<double>(grid.bins)));
}

struct Part {
  Indices members;
  Moments moments;
};

// The least separated two first, until all are two places.
void merge_what_is_one(const View& all, const Grid& grid, std::vector<Part>* parts) {
  while (parts->size() > 1) {
    double least = 1.0;
    std::pair<std::size_t, std::size_t> two;
    for (std::size_t a = 0; a < parts->size(); ++a) {
      for (std::size_t b = a + 1; b < parts->size(); ++b) {
        const double separated = separation((*parts)[a].moments, (*parts)[b].moments, grid);
        if (separated < least) {
          least = separated;
          two = {a, b};
        }
      }
    }
    if (least >= kSeparated) return;
    Part& kept = (*parts)[two.first];
    const Indices& more = (*parts)[two.second].members;
    kept.members.insert(kept.members.end(), more.begin(), more.end());
    std::sort(kept.members.begin(), kept.members.end());
    kept.moments = moments_of(all, kept.members);
    parts->erase(parts->begin() + static_cast<std::ptrdiff_t>(two.second));
  }
}

// Distance of a particle to a part in units of what is near.
double distance_to(const Part& part, const Grid& grid, const Pose2& pose) {
  const Pose2& mean = part.moments.pose.mean;
  const double turn_length = 2.0 * kPi / static_cast<double>(grid.bins);
  const double x = (pose.x - mean.x) / (kNear * sigma(part.moments, 0) + grid.length_x);
  const double y = (pose.y - mean.y) / (kNear * sigma(part.moments, 1) + grid.length_y);
  const double turn =
      wrap_angle(pose.heading - mean.heading) / (kNear * sigma(part.moments, 2) + turn_length);
  return std::max({std::abs(x), std::abs(y), std::abs(turn)});
}

/// The places among some particles by one grid; what is near none of them is left out.
std::vector<Part> places(const View& all, const Indices& members, const Moments& moments) {
  const Grid grid(moments);
  std::vector<Part> parts;
  Indices strays;
  for (Indices& component : components(all, members, grid)) {
    double weight = 0.0;
    for (const Eigen::Index k : component) weight += all.weights[k];
    if (weight < kSmallestShare * moments.weight) {
      strays.insert(strays.end(), component.begin(), component.end());
      continue;
    }
    Part part;
    part.moments = moments_of(all, component);
    part.members = std::move(component);
    parts.push_back(std::move(part));
  }
  if (parts.empty()) return {{members, moments}};
  merge_what_is_one(all, grid, &parts);
  std::sort(strays.begin(), strays.end());
  std::vector<Indices> joining(parts.size());
  for (const Eigen::Index k : strays) {
    const Pose2 pose = {all.x[k], all.y[k], all.heading[k]};
    std::size_t nearest = 0;
    double least = 1.0;
    for (std::size_t p = 0; p < parts.size(); ++p) {
      const double distance = distance_to(parts[p], grid, pose);
      if (distance < least) {
        least = distance;
        nearest = p;
      }
    }
    if (least < 1.0) joining[nearest].push_back(k);
  }
  for (std::size_t p = 0; p < parts.size(); ++p) {
    if (joining[p].empty()) continue;
    Indices& own = parts[p].members;
    own.insert(own.end(), joining[p].begin(), joining[p].end());
    std::sort(own.begin(), own.end());
    parts[p].moments = moments_of(all, own);
  }
  return parts;
}

void find(const View& all, const Part& part, int depth, PoseClusters* found) {
  std::vector<Part> parts = places(all, part.members, part.moments);
  const bool is_final =
      depth == 0 || (parts.size() == 1 && parts.front().members.size() == part.members.size());
  for (const Part& place : parts) {
    if (is_final) {
      found->clusters.push_back({place.moments.weight, place.moments.pose});
    } else {
      find(all, place, depth - 1, found);
    }
  }
}

// So often is each particle picked by systematic resampling. What was picked twice counts twice,
// and is still one particle.
Eigen::ArrayXd picks(ConstArray weights) {
  const double step = weights.sum() / static_cast<double>(kEnough);
  Eigen::ArrayXd picked(weights.size());
  double sum = 0.0;
  double before = 0.0;
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    sum += weights[i];
    const double until = std::floor(sum / step + 0.5);
    picked[i] = until - before;
    before = until;
  }
  return picked;
}

PoseClusters clusters_of(const View& all, Indices members, int most) {
  Part whole;
  whole.members = std::move(members);
  whole.moments = moments_of(all, whole.members);
  PoseClusters found;
  if (!(whole.moments.weight > 0.0)) return found;
  const double total = whole.moments.weight;
  find(all, whole, kDeepest, &found);
  auto& clusters = found.clusters;
  for (PoseCluster& cluster : clusters) cluster.weight /= total;
  std::stable_sort(clusters.begin(), clusters.end(),
                   [](const PoseCluster& a, const PoseCluster& b) { return a.weight > b.weight; });
  while (clusters.size() > static_cast<std::size_t>(std::max(most, 0)) ||
         (clusters.size() > 1 && clusters.back().weight < kSmallestShare)) {
    clusters.pop_back();
  }
  double in_them = 0.0;
  for (const PoseCluster& cluster : clusters) in_them += cluster.weight;
  found.rest = std::clamp(1.0 - in_them, 0.0, 1.0);
  return found;
}

}  // namespace

PoseClusters pose_clusters(ConstArray weights, ConstArray x, ConstArray y, ConstArray heading,
                           int most) {
  if (weights.size() > kEnough && weights.sum() > 0.0) {
    const Eigen::ArrayXd picked = picks(weights);
    Indices members;
    for (Eigen::Index i = 0; i < picked.size(); ++i) {
      if (picked[i] > 0.0) members.push_back(i);
    }
    return clusters_of({picked, x, y, heading}, std::move(members), most);
  }
  Indices members(static_cast<std::size_t>(weights.size()));
  std::iota(members.begin(), members.end(), Eigen::Index{0});
  return clusters_of({weights, x, y, heading}, std::move(members), most);
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
