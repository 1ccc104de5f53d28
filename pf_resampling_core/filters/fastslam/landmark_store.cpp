#include "pf_resampling_core/filters/fastslam/landmark_store.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/fastslam/landmark_rows.hpp"
#include "pf_resampling_core/filters/fastslam/selection_log.hpp"

namespace pf_resampling {
namespace {

// By so many selections a row lags at most, or by four times the rows if that is more.
constexpr std::int64_t kSteps = 4096;
constexpr int kNone = -1;

struct Row {
  RowMemory memory;
  std::int64_t birth = 0;
  std::int64_t version = 0;  // it has gone through all selections before this
  bool is_used = false;
  int before = kNone;  // neighbours in the order of versions
  int after = kNone;
};

bool is_identity(ConstIndices ancestors, int particles) {
  if (ancestors.size() != particles) return false;
  int differences = 0;
  for (int i = 0; i < particles; ++i) differences += ancestors[i] != i ? 1 : 0;
  return differences == 0;
}

}  // namespace

struct LandmarkStore::Implementation {
  int particles = 0;
  int used = 0;
  std::vector<Row> rows;
  std::vector<int> free_rows;
  int oldest = kNone;  // ends of the order of versions
  int newest = kNone;
  SelectionLog log;
  RowMemory spare;  // where the next gather goes

  Row& at(int row) { return rows[static_cast<std::size_t>(row)]; }

  void check_used(int row) const {
    if (row < 0 || static_cast<std::size_t>(row) >= rows.size() ||
        !rows[static_cast<std::size_t>(row)].is_used) {
      throw Error("landmark store: row " + std::to_string(row) +
                  " is not in use; use rows that add() gave and remove() did not take back");
    }
  }

  void unlink(int row) {
    const Row& leaving = at(row);
    (leaving.before == kNone ? oldest : at(leaving.before).after) = leaving.after;
    (leaving.after == kNone ? newest : at(leaving.after).before) = leaving.before;
  }

  void link_newest(int row) {
    at(row).version = log.now();
    at(row).before = newest;
    at(row).after = kNone;
    (newest == kNone ? oldest : at(newest).after) = row;
    newest = row;
  }

  std::int64_t steps_behind(int row) { return log.now() - at(row).version; }
  std::int64_t steps_allowed() const { return std::max(kSteps, std::int64_t{4} * used); }

  void catch_up(int row) {
    if (at(row).version == log.now()) return;
    gather(at(row).memory, log.from(at(row).version), &spare);
    std::swap(at(row).memory, spare);
    unlink(row);
    link_newest(row);
  }
  void catch_up_all() {
    while (oldest != kNone && at(oldest).version < log.now()) catch_up(oldest);
  }
  void bound_log();
};

// Late rows are caught up, oldest first, as many per step as it takes to have had all of them
// before the first of them is too late: a selection that a row is spared for long is a selection
// saved.
void LandmarkStore::Implementation::bound_log() {
  const std::int64_t steps = steps_allowed();
  const std::int64_t late_steps = steps / 4 * 3;
  const std::int64_t steps_left = steps - late_steps;
  std::int64_t quota = (used + steps_left - 1) / steps_left;
  while (oldest != kNone &&
         (steps_behind(oldest) > steps || (quota > 0 && steps_behind(oldest) > late_steps))) {
    catch_up(oldest);
    --quota;
  }
  log.drop_before(oldest == kNone ? log.now() : at(oldest).version);
}

LandmarkStore::LandmarkStore(int particles) : implementation_(std::make_unique<Implementation>()) {
  if (particles < 1) {
    throw Error("landmark store: " + std::to_string(particles) +
                " particles were asked for; ask for at least 1");
  }
  implementation_->particles = particles;
}
LandmarkStore::~LandmarkStore() = default;
LandmarkStore::LandmarkStore(const LandmarkStore& other)
    : implementation_(std::make_unique<Implementation>()) {
  Implementation& from = *other.implementation_;
  from.catch_up_all();
  implementation_->particles = from.particles;
  implementation_->used = from.used;
  implementation_->rows = from.rows;
  for (Row& row : implementation_->rows) row.version = 0;  // its log has yet to begin
  implementation_->free_rows = from.free_rows;
  implementation_->oldest = from.oldest;
  implementation_->newest = from.newest;
}
LandmarkStore& LandmarkStore::operator=(const LandmarkStore& other) {
  return *this = LandmarkStore(other);
}
LandmarkStore::LandmarkStore(LandmarkStore&&) noexcept = default;
LandmarkStore& LandmarkStore::operator=(LandmarkStore&&) noexcept = default;

int LandmarkStore::particles() const {
  return implementation_->particles;
}

int LandmarkStore::rows() const {
  return static_cast<int>(implementation_->rows.size());
}

bool LandmarkStore::is_used(int row) const {
  return row >= 0 && row < rows() && implementation_->at(row).is_used;
}

int LandmarkStore::add(std::int64_t birth) {
  Implementation& store = *implementation_;
  if (store.free_rows.empty()) {
    store.rows.emplace_back();
    store.free_rows.push_back(rows() - 1);
  }
  const int row = store.free_rows.back();
  store.free_rows.pop_back();
  Row& added = store.at(row);
  added.memory.fit(store.particles);
  added.birth = birth;
  added.is_used = true;
  store.link_newest(row);
  ++store.used;
  return row;
}

void LandmarkStore::remove(int row) {
  Implementation& store = *implementation_;
  store.check_used(row);
  store.unlink(row);
  store.at(row) = Row{};
  store.free_rows.push_back(row);
  --store.used;
}

std::int64_t LandmarkStore::birth(int row) const {
  implementation_->check_used(row);
  return implementation_->at(row).birth;
}

LandmarkRow LandmarkStore::row(int row) {
  Implementation& store = *implementation_;
  store.check_used(row);
  store.catch_up(row);
  RowMemory& memory = store.at(row).memory;
  return {memory.field(RowMemory::x),
          memory.field(RowMemory::y),
          memory.field(RowMemory::xx),
          memory.field(RowMemory::xy),
          memory.field(RowMemory::yy),
          memory.field(RowMemory::log_odds),
          memory.held()};
}

void LandmarkStore::select(ConstIndices ancestors) {
  Implementation& store = *implementation_;
  if (ancestors.size() < 1) {
    throw Error("landmark store: no ancestors were given; give one per particle");
  }
  for (Eigen::Index i = 0; i < ancestors.size(); ++i) {
    if (ancestors[i] < 0 || ancestors[i] >= store.particles) {
      throw Error("landmark store: ancestor " + std::to_string(ancestors[i]) + " of slot " +
                  std::to_string(i) + " is none of the " + std::to_string(store.particles) +
                  " particles");
    }
  }
  if (is_identity(ancestors, store.particles)) return;
  store.particles = static_cast<int>(ancestors.size());
  if (store.used > 0) store.log.append(ancestors);
  store.bound_log();
}

void LandmarkStore::blend(const std::vector<BlendPair>& pairs, CovarianceTreatment treatment) {
  Implementation& store = *implementation_;
  check_pairs(pairs, store.particles);
  if (pairs.empty()) return;
  store.catch_up_all();
  for (Row& row : store.rows) {
    if (row.is_used) pf_resampling::blend(pairs, treatment, &row.memory);
  }
  store.bound_log();
}

std::int64_t LandmarkStore::log_length() const {
  return implementation_->log.now() - implementation_->log.oldest();
}

std::size_t LandmarkStore::memory() const {
  const Implementation& store = *implementation_;
  std::size_t bytes = store.log.memory() + store.rows.capacity() * sizeof(Row);
  for (const Row& row : store.rows) bytes += row.memory.bytes();
  return bytes;
}

}  // namespace pf_resampling
