#include "pf_resampling_core/filters/fastslam/landmark_store.hpp"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <utility>

#include "pf_resampling_core/population/vector_math.hpp"

namespace pf_resampling {
namespace {

// Selections after which all rows are brought up to date: a fraction of a microsecond per row and
// selection saved, and the most that a row asked for has to go through. Of small maps of many
// particles the log would outgrow the map (49 bytes a row and particle, 4 a selection).
constexpr std::size_t kMostLogged = 1000;
constexpr std::size_t kMostLoggedPerRow = 4;

PF_RESAMPLING_VECTOR_CLONES
void gather(const double* __restrict from, const int* __restrict ancestors, int size,
            double* __restrict out) {
  for (int i = 0; i < size; ++i) out[i] = from[ancestors[i]];
}

// Selection `first`, followed by `second`.
PF_RESAMPLING_VECTOR_CLONES
void compose(const int* __restrict first, const int* __restrict second, int size,
             int* __restrict out) {
  for (int i = 0; i < size; ++i) out[i] = first[second[i]];
}

// Room for a field of so many particles: fields a whole number of pages apart would compete for the
// same places of the cache.
Eigen::Index padded(int particles) {
  constexpr Eigen::Index kPage = 4096 / sizeof(double);
  const Eigen::Index size = (particles + 7) / 8 * 8;
  return size % kPage == 0 ? size + 8 : size;
}

}  // namespace

void LandmarkStore::forget_composed() {
  composed_.resize(static_cast<std::size_t>(particles_));
  std::iota(composed_.begin(), composed_.end(), 0);
  from_ = log_.size();
}

void LandmarkStore::catch_up(Row* row) {
  if (row->version == log_.size()) return;
  if (row->version > from_) forget_composed();
  while (from_ > row->version) {
    std::vector<int> longer(composed_.size());
    compose(log_[--from_].data(), composed_.data(), particles_, longer.data());
    composed_.swap(longer);
  }
  Eigen::ArrayXXd fields(padded(particles_), kFields);
  for (Eigen::Index f = 0; f < kFields; ++f) {
    gather(row->fields.col(f).data(), composed_.data(), particles_, fields.col(f).data());
  }
  row->fields.swap(fields);
  std::vector<std::uint8_t> held;
  for (const int ancestor : composed_)
    held.push_back(row->held[static_cast<std::size_t>(ancestor)]);
  row->held.swap(held);
  row->version = log_.size();
}

// The latest first, so that no composition is made twice.
void LandmarkStore::catch_up_all() {
  std::vector<Row*> late;
  for (Row& row : rows_) {
    if (row.is_used) late.push_back(&row);
  }
  std::sort(late.begin(), late.end(),
            [](const Row* a, const Row* b) { return a->version > b->version; });
  for (Row* row : late) {
    catch_up(row);
    row->version = 0;
  }
  log_.clear();
  forget_composed();
}

int LandmarkStore::add(std::int64_t birth) {
  if (free_rows_.empty()) {
    rows_.emplace_back();
    free_rows_.push_back(rows() - 1);
  }
  const int row = free_rows_.back();
  free_rows_.pop_back();
  at(row) = {Eigen::ArrayXXd::Zero(padded(particles_), kFields),
             std::vector<std::uint8_t>(static_cast<std::size_t>(particles_), 0), birth, log_.size(),
             true};
  return row;
}

void LandmarkStore::remove(int row) {
  at(row) = Row{};
  free_rows_.push_back(row);
}

LandmarkRow LandmarkStore::row(int row) {
  catch_up(&at(row));
  Eigen::ArrayXXd& fields = at(row).fields;
  return {fields.col(kX).data(),  fields.col(kY).data(),  fields.col(kXx).data(),
          fields.col(kXy).data(), fields.col(kYy).data(), fields.col(kLogOdds).data(),
          at(row).held.data()};
}

void LandmarkStore::select(ConstIndices ancestors) {
  const auto size = static_cast<int>(ancestors.size());
  const bool is_identity =
      size == particles_ && (ancestors == Eigen::ArrayXi::LinSpaced(size, 0, size - 1)).all();
  if (is_identity) return;
  particles_ = size;
  log_.emplace_back(ancestors.data(), ancestors.data() + size);
  forget_composed();
  if (log_.size() >= std::min(kMostLogged, kMostLoggedPerRow * rows_.size())) catch_up_all();
}

void LandmarkStore::blend(const std::vector<BlendPair>& pairs, CovarianceTreatment treatment) {
  if (pairs.empty()) return;
  catch_up_all();
  for (Row& row : rows_) {
    const auto is_held = [&](int i) { return row.held[static_cast<std::size_t>(i)] != 0; };
    if (!row.is_used) continue;
    std::vector<BlendPair> both;
    std::copy_if(pairs.begin(), pairs.end(), std::back_inserter(both),
                 [&](const BlendPair& pair) { return is_held(pair.low) && is_held(pair.high); });
    auto x = row.fields.col(kX), y = row.fields.col(kY);
    blend_covariances(both, treatment, x, x, row.fields.col(kXx));
    blend_covariances(both, treatment, x, y, row.fields.col(kXy));
    blend_covariances(both, treatment, y, y, row.fields.col(kYy));
    blend_means(both, x);
    blend_means(both, y);
  }
}

}  // namespace pf_resampling
