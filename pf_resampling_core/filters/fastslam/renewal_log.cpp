#include "pf_resampling_core/filters/fastslam/renewal_log.hpp"

#include <algorithm>
#include <utility>

#include "pf_resampling_core/filters/fastslam/landmark_rows.hpp"

namespace pf_resampling {
namespace {

constexpr std::size_t kSpareMaps = 64;

}  // namespace

std::vector<int> RenewalLog::spare_map(std::size_t size) {
  std::vector<int> map;
  if (!spare_maps_.empty()) {
    map = std::move(spare_maps_.back());
    spare_maps_.pop_back();
  }
  map.resize(size);
  return map;
}

const std::vector<int>* RenewalLog::map_at(std::size_t level, std::int64_t number) const {
  const Level& maps = levels_[level];
  const std::int64_t place = number - maps.first;
  if (place < 0 || place >= static_cast<std::int64_t>(maps.maps.size())) return nullptr;
  const std::vector<int>& map = maps.maps[static_cast<std::size_t>(place)];
  return map.empty() ? nullptr : &map;
}

void RenewalLog::push(std::size_t level, std::vector<int> map) {
  if (level == levels_.size()) levels_.emplace_back();
  levels_[level].maps.push_back(std::move(map));
}

void RenewalLog::append(bool is_blend, std::vector<int> map) {
  steps_.push_back({is_blend, blends_});
  blends_ += is_blend ? 1 : 0;
  push(0, std::move(map));
  // The stretches that end here, from the two halves of each.
  std::int64_t number = now();
  for (std::size_t level = 1; number % 2 == 0; ++level) {
    number /= 2;
    const std::vector<int>* first = map_at(level - 1, 2 * number - 2);
    const std::vector<int>* second = map_at(level - 1, 2 * number - 1);
    std::vector<int> both;
    if (first != nullptr && second != nullptr) {
      both = spare_map(second->size());
      compose(first->data(), second->data(), static_cast<int>(second->size()), both.data());
    }
    push(level, std::move(both));
  }
}

void RenewalLog::append_selection(ConstIndices ancestors) {
  std::vector<int> map = spare_map(static_cast<std::size_t>(ancestors.size()));
  std::copy(ancestors.data(), ancestors.data() + ancestors.size(), map.begin());
  append(false, std::move(map));
}

void RenewalLog::append_blend(const std::vector<BlendPair>& pairs, CovarianceTreatment treatment) {
  LoggedBlend blend;
  blend.low.reserve(pairs.size());
  blend.high.reserve(pairs.size());
  blend.share.reserve(pairs.size());
  blend.rest.reserve(pairs.size());
  for (const BlendPair& pair : pairs) {
    blend.low.push_back(pair.low);
    blend.high.push_back(pair.high);
    blend.share.push_back(pair.share);
    blend.rest.push_back(pair.share_of_high());
  }
  blend.treatment = treatment;
  kept_blends_.push_back(std::move(blend));
  append(true, {});
}

void RenewalLog::drop_before(std::int64_t version) {
  while (oldest_ < version) {
    if (steps_.front().is_blend) kept_blends_.pop_front();
    steps_.pop_front();
    ++oldest_;
  }
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    Level& maps = levels_[level];
    while (maps.maps.size() > 0 && (maps.first << level) < oldest_) {
      if (!maps.maps.front().empty() && spare_maps_.size() < kSpareMaps) {
        spare_maps_.push_back(std::move(maps.maps.front()));
      }
      maps.maps.pop_front();
      ++maps.first;
    }
  }
}

std::int64_t RenewalLog::blends_before(std::int64_t version) const {
  return version == now() ? blends_
                          : steps_[static_cast<std::size_t>(version - oldest_)].blends_before;
}

const LoggedBlend* RenewalLog::blend_at(std::int64_t version) const {
  const Step& step = steps_[static_cast<std::size_t>(version - oldest_)];
  if (!step.is_blend) return nullptr;
  const auto dropped = blends_ - static_cast<std::int64_t>(kept_blends_.size());
  return &kept_blends_[static_cast<std::size_t>(step.blends_before - dropped)];
}

const std::vector<int>* RenewalLog::longest_map_from(std::int64_t version,
                                                     std::int64_t* end) const {
  const auto left = static_cast<std::uint64_t>(now() - version);
  int level = 63 - __builtin_clzll(left);
  if (version != 0) {
    level = std::min(level, __builtin_ctzll(static_cast<std::uint64_t>(version)));
  }
  for (; level >= 0; --level) {
    const std::vector<int>* map = map_at(static_cast<std::size_t>(level), version >> level);
    if (map != nullptr) {
      *end = version + (std::int64_t{1} << level);
      return map;
    }
  }
  return nullptr;
}

ComposedSelection RenewalLog::selections_from(std::int64_t version) {
  if (answer_from_ == version && answer_now_ == now()) return answer_;
  // All of them first, so that those from far are on their way while the first are composed.
  path_.clear();
  std::int64_t end = version;
  while (end < now()) {
    const std::vector<int>* next = longest_map_from(end, &end);
    if (next == nullptr) break;
    constexpr std::size_t kLine = 64 / sizeof(int);
    for (std::size_t i = 0; i < next->size(); i += kLine) __builtin_prefetch(next->data() + i);
    path_.push_back(next);
  }
  answer_ = {path_.front()->data(), static_cast<int>(path_.front()->size()), end};
  for (std::size_t i = 1; i < path_.size(); ++i) {
    const std::vector<int>& next = *path_[i];
    composed_swap_.resize(next.size());
    answer_.particles = static_cast<int>(next.size());
    compose(answer_.ancestors, next.data(), answer_.particles, composed_swap_.data());
    composed_.swap(composed_swap_);
    answer_.ancestors = composed_.data();
  }
  answer_from_ = version;
  answer_now_ = now();
  return answer_;
}

std::size_t RenewalLog::memory() const {
  std::size_t bytes = steps_.size() * sizeof(Step);
  for (std::size_t i = 0; i < kept_blends_.size(); ++i) {
    bytes += kept_blends_[i].low.size() * (2 * sizeof(int) + 2 * sizeof(double));
  }
  for (const Level& level : levels_) {
    for (std::size_t i = 0; i < level.maps.size(); ++i) bytes += level.maps[i].size() * sizeof(int);
  }
  return bytes;
}

}  // namespace pf_resampling
