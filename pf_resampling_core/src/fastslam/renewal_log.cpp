#include "renewal_log.hpp"

#include <algorithm>
#include <utility>

#include "landmark_rows.hpp"

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
  for (const BlendPair& pair : pairs) {
    blend.low.push_back(pair.low);
    blend.high.push_back(pair.high);
    blend.share.push_back(pair.share);
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
    while (!maps.maps.empty() && (maps.first << level) < oldest_) {
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

ComposedSelection RenewalLog::selections_from(std::int64_t version) {
  if (answer_from_ == version && answer_now_ == now()) return answer_;
  ComposedSelection answer{nullptr, 0, version};
  while (answer.end < now()) {
    // The longest stretch that begins here and is over by now.
    std::size_t level = 0;
    while (level + 1 < levels_.size() && answer.end % (std::int64_t{2} << level) == 0 &&
           answer.end + (std::int64_t{2} << level) <= now()) {
      ++level;
    }
    const std::vector<int>* next = map_at(level, answer.end >> level);
    while (next == nullptr && level > 0) {
      --level;
      next = map_at(level, answer.end >> level);
    }
    if (next == nullptr) break;
    answer.end += std::int64_t{1} << level;
    answer.particles = static_cast<int>(next->size());
    if (answer.ancestors == nullptr) {
      answer.ancestors = next->data();
    } else {
      composed_swap_.resize(next->size());
      compose(answer.ancestors, next->data(), answer.particles, composed_swap_.data());
      composed_.swap(composed_swap_);
      answer.ancestors = composed_.data();
    }
  }
  answer_ = answer;
  answer_from_ = version;
  answer_now_ = now();
  return answer;
}

std::size_t RenewalLog::memory() const {
  std::size_t bytes = steps_.size() * sizeof(Step);
  for (const LoggedBlend& blend : kept_blends_) {
    bytes += blend.low.size() * (2 * sizeof(int) + sizeof(double));
  }
  for (const Level& level : levels_) {
    for (const std::vector<int>& map : level.maps) bytes += map.size() * sizeof(int);
  }
  return bytes;
}

}  // namespace pf_resampling
