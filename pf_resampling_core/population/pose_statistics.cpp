#include "pf_resampling_core/population/pose_statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "pf_resampling_core/files/archive.hpp"
#include "pf_resampling_core/population/lanes.hpp"
#include "pf_resampling_core/population/matrix_root.hpp"
#include "pf_resampling_core/population/vector_math.hpp"

namespace pf_resampling {
namespace {

PF_RESAMPLING_INLINE void add_first_moments(double weight, double x, double y, double heading,
                                            int lane, double sums[5][kLanes]) {
  double sine;
  double cosine;
  sincos_vector(heading, &sine, &cosine);
  sums[0][lane] += weight * weight;
  sums[1][lane] += weight * x;
  sums[2][lane] += weight * y;
  sums[3][lane] += weight * cosine;
  sums[4][lane] += weight * sine;
}

PF_RESAMPLING_VECTOR_CLONES
void first_moments(const double* weights, const double* x, const double* y, const double* heading,
                   std::int64_t count, double sums[5][kLanes]) {
  std::int64_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane) {
      add_first_moments(weights[i + lane], x[i + lane], y[i + lane], heading[i + lane], lane, sums);
    }
  }
  for (; i < count; ++i) add_first_moments(weights[i], x[i], y[i], heading[i], 0, sums);
}

PF_RESAMPLING_INLINE void add_second_moments(double weight, double dx, double dy, double dh,
                                             int lane, double sums[6][kLanes]) {
  sums[0][lane] += weight * dx * dx;
  sums[1][lane] += weight * dx * dy;
  sums[2][lane] += weight * dx * dh;
  sums[3][lane] += weight * dy * dy;
  sums[4][lane] += weight * dy * dh;
  sums[5][lane] += weight * dh * dh;
}

PF_RESAMPLING_VECTOR_CLONES
void second_moments(const double* weights, const double* x, const double* y, const double* heading,
                    const Pose2& mean, std::int64_t count, double sums[6][kLanes]) {
  std::int64_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane) {
      add_second_moments(weights[i + lane], x[i + lane] - mean.x, y[i + lane] - mean.y,
                         wrap_angle_vector(heading[i + lane] - mean.heading), lane, sums);
    }
  }
  for (; i < count; ++i) {
    add_second_moments(weights[i], x[i] - mean.x, y[i] - mean.y,
                       wrap_angle_vector(heading[i] - mean.heading), 0, sums);
  }
}

// Sums in lanes over blocks of particles, whoever does which, and their totals in one order.
template <std::size_t kSums, typename OfBlock>
std::array<double, kSums> totals(std::int64_t count, WorkerPool* pool, const OfBlock& of_block) {
  struct Sums {
    double lanes[kSums][kLanes] = {};
  };
  constexpr std::int64_t kBlock = WorkerPool::kBlockSize;
  std::vector<Sums> blocks(static_cast<std::size_t>((count + kBlock - 1) / kBlock));
  const auto sum = [&](std::int64_t begin, std::int64_t end) {
    of_block(begin, end - begin, blocks[static_cast<std::size_t>(begin / kBlock)].lanes);
  };
  if (pool != nullptr) {
    pool->for_each_block(count, sum, WorkerPool::kManyCheapElements);
  } else {
    for (std::int64_t i = 0; i < count; i += kBlock) sum(i, std::min(count, i + kBlock));
  }
  std::array<double, kSums> all = {};
  for (const Sums& block : blocks) {
    for (std::size_t k = 0; k < kSums; ++k) {
      double sum_of_block = 0.0;
      for (const double lane : block.lanes[k]) sum_of_block += lane;
      all[k] += sum_of_block;
    }
  }
  return all;
}

}  // namespace

PoseStatistics pose_statistics(ConstArray weights, ConstArray x, ConstArray y, ConstArray heading,
                               WorkerPool* pool) {
  const auto first = totals<5>(weights.size(), pool, [&](auto i, auto count, auto* lanes) {
    first_moments(weights.data() + i, x.data() + i, y.data() + i, heading.data() + i, count, lanes);
  });
  PoseStatistics statistics;
  statistics.effective_sample_size = 1.0 / first[0];
  statistics.mean = {first[1], first[2], std::atan2(first[4], first[3])};
  const Pose2& mean = statistics.mean;

  const auto second = totals<6>(weights.size(), pool, [&](auto i, auto count, auto* lanes) {
    second_moments(weights.data() + i, x.data() + i, y.data() + i, heading.data() + i, mean, count,
                   lanes);
  });
  const auto [xx, xy, xh, yy, yh, hh] = second;
  statistics.covariance << xx, xy, xh, xy, yy, yh, xh, yh, hh;
  return statistics;
}

void draw_poses(const PoseEstimate& belief, const RandomStream& normals, Eigen::Index begin,
                Eigen::Index end, Eigen::ArrayXd* x, Eigen::ArrayXd* y, Eigen::ArrayXd* heading) {
  const Eigen::Matrix3d root = lower_root(belief.covariance);
  Eigen::Matrix4Xd drawn(4, end - begin);
  normals.fill_normal(4 * static_cast<std::uint64_t>(begin), drawn.size(), drawn.data());
  for (Eigen::Index i = begin; i < end; ++i) {
    const Eigen::Vector3d offset = root * drawn.col(i - begin).head<3>();
    (*x)[i] = belief.mean.x + offset[0];
    (*y)[i] = belief.mean.y + offset[1];
    (*heading)[i] = wrap_angle(belief.mean.heading + offset[2]);
  }
}

void describe(Archive& archive, PoseEstimate& estimate) {
  archive("mean", estimate.mean);
  archive("covariance", estimate.covariance);
}

}  // namespace pf_resampling
