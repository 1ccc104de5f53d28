#pragma once

#include <cstddef>
#include <vector>

#include "pf_resampling_core/filters/fastslam/memory/accounts.hpp"
#include "pf_resampling_core/filters/fastslam/memory/local_graph.hpp"
#include "pf_resampling_core/filters/fastslam/memory/scans.hpp"

namespace pf_resampling {

/// The part of an account that a local graph is about.
Account part_of(const Account& account, const LocalGraph& local);

/// Puts such a part, in which landmarks may have become others and new ones been found, in place of
/// the segments from `from` on. False, with the account half done, if these cannot be condensed.
bool put_back(const Account& part, const LocalGraph& local, std::size_t from, double robust_width,
              Account* account);

/// What a local graph has not.
struct Past {
  std::vector<Eigen::Vector2d> others;  ///< landmarks
  Scans scans;  ///< that came before, with these landmarks; then those of the graph
};
/// Of a drive whose segments from `from` on are in a local graph.
Past past_of(const Account& account, const DriveTimes& times, std::size_t from,
             const LocalGraph& local);

}  // namespace pf_resampling
