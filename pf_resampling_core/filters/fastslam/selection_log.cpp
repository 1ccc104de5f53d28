#include "pf_resampling_core/filters/fastslam/selection_log.hpp"

#include <algorithm>
#include <utility>

#include "pf_resampling_core/filters/fastslam/landmark_rows.hpp"

namespace pf_resampling {

const std::vector<int>* SelectionLog::map_at(std::size_t level, std::int64_t number) const {
  const Level& maps = levels_[level];
  const std::int64_t place = number - maps.first;
  if (place < 0 || place >= static_cast<std::int64_t>(maps.maps.size())) return nullptr;
  const std::vector<int>& map = maps.maps[static_cast<std::size_t>(place)];
  return map.empty() ? nullptr : &map;
}

void SelectionLog::append(ConstIndices ancestors) {
  levels_[0].maps.emplace_back(ancestors.data(), ancestors.data() + ancestors.size());
  // The stretches that end here, from the two halves of each.
  std::int64_t number = ++now_;
  for (std::size_t level = 1; number % 2 == 0; ++level) {
    number /= 2;
    if (level == levels_.size()) levels_.emplace_back();
    const std::vector<int>* first = map_at(level - 1, 2 * number - 2);
    const std::vector<int>* second = map_at(level - 1, 2 * number - 1);
    std::vector<int> both;
    if (first != nullptr && second != nullptr) compose(*first, *second, &both);
    levels_[level].maps.push_back(std::move(both));
  }
}

void SelectionLog::drop_before(std::int64_t version) {
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    Level& maps = levels_[level];
    for (; !maps.maps.empty() && (maps.first << level) < version; ++maps.first) {
      maps.maps.pop_front();
    }
  }
}

const std::vector<int>& SelectionLog::longest_map_from(std::int64_t version,
                                                       std::int64_t* end) const {
  std::size_t level = 0;
  const auto is_kept = [&](std::size_t longer) {
    return version % (std::int64_t{1} << longer) == 0 &&
           version + (std::int64_t{1} << longer) <= now_ &&
           map_at(longer, version >> longer) != nullptr;
  };
  while (level + 1 < levels_.size() && is_kept(level + 1)) ++level;
  *end = version + (std::int64_t{1} << level);
  return *map_at(level, version >> level);
}

const std::vector<int>& SelectionLog::from(std::int64_t version) {
  if (answer_from_ == version && answer_now_ == now_) return answer_;
  std::int64_t end = version;
  answer_ = longest_map_from(end, &end);
  while (end < now_) {
    compose(answer_, longest_map_from(end, &end), &composed_);
    answer_.swap(composed_);
  }
  answer_from_ = version;
  answer_now_ = now_;
  return answer_;
}

std::size_t SelectionLog::memory() const {
  std::size_t bytes = 0;
  for (const Level& level : levels_) {
    for (const std::vector<int>& map : level.maps) bytes += map.size() * sizeof(int);
  }
  return bytes;
}

}  // namespace pf_resampling
