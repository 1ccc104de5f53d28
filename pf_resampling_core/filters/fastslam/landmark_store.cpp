#include "pf_resampling_core/filters/fastslam/landmark_store.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/fastslam/landmark_rows.hpp"
#include "pf_resampling_core/filters/fastslam/renewal_log.hpp"

namespace pf_resampling {
namespace {

constexpr std::int64_t kBlends = 64;   // by so many a row lags at most
constexpr std::int64_t kSteps = 4096;  // likewise, or by four times the rows if that is more
constexpr std::int64_t kBlendsForCompany = 8;  // lag from which a row takes others along
constexpr std::int64_t kBlendsForTile = 4;     // blends one after the other, and
constexpr int kRowsForTile = 3;                // rows, from which a tile pays
constexpr int kNone = -1;

struct Row {
  RowMemory memory;
  std::int64_t birth = 0;
  std::int64_t version = 0;  // it has gone through all steps before this
  bool is_used = false;
  int before = kNone;  // neighbours in the order of versions
  int after = kNone;
};

// Rows that catch up together, in the order of versions.
struct Group {
  int rows[BlendTile::kRows];
  int size = 0;
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
  RenewalLog log;
  RowMemory spare;  // where the next gather goes
  BlendTile tile;

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
  std::int64_t blends_behind(int row) {
    return log.blends_before(log.now()) - log.blends_before(at(row).version);
  }
  std::int64_t steps_allowed() const { return std::max(kSteps, std::int64_t{4} * used); }

  void catch_up(int row);
  void catch_up(const Group& group);
  std::int64_t go_through_selections(const Group& group, std::int64_t version);
  std::int64_t go_through_blends(const Group& group, std::int64_t version);
  void blend_together(const Group& group, int members, std::int64_t version, std::int64_t end);
  void bound_log();
};

// From `version`, where the first of the group stands, to the end of the selections that follow;
// the others join where they stand. Returns the version reached.
std::int64_t LandmarkStore::Implementation::go_through_selections(const Group& group,
                                                                  std::int64_t version) {
  const std::int64_t end = log.selections_from(version).end;
  for (int i = 0; i < group.size && at(group.rows[i]).version < end; ++i) {
    Row& row = at(group.rows[i]);
    const ComposedSelection selection = log.selections_from(row.version);
    gather(row.memory, selection.ancestors, selection.particles, &spare);
    std::swap(row.memory, spare);
    row.version = end;
  }
  return end;
}

// Likewise for blends.
std::int64_t LandmarkStore::Implementation::go_through_blends(const Group& group,
                                                              std::int64_t version) {
  std::int64_t end = version;
  while (end < log.now() && log.blend_at(end) != nullptr) ++end;
  int members = 0;
  while (members < group.size && at(group.rows[members]).version < end) ++members;
  if (end - version >= kBlendsForTile && members >= kRowsForTile) {
    blend_together(group, members, version, end);
  } else {
    for (int i = 0; i < members; ++i) {
      Row& row = at(group.rows[i]);
      while (row.version < end) pf_resampling::blend(*log.blend_at(row.version++), &row.memory);
    }
  }
  return end;
}

void LandmarkStore::Implementation::blend_together(const Group& group, int members,
                                                   std::int64_t version, std::int64_t end) {
  bool with_covariances = false;
  for (std::int64_t step = version; step < end; ++step) {
    with_covariances |= log.blend_at(step)->treatment == CovarianceTreatment::moment_matched;
  }
  tile.start(at(group.rows[0]).memory.particles(), with_covariances);
  int joined = 0;
  for (std::int64_t step = version; step < end; ++step) {
    for (; joined < members && at(group.rows[joined]).version == step; ++joined) {
      tile.put(joined, at(group.rows[joined]).memory);
    }
    tile.apply(*log.blend_at(step));
  }
  for (int i = 0; i < members; ++i) {
    tile.take(i, &at(group.rows[i]).memory);
    at(group.rows[i]).version = end;
  }
}

void LandmarkStore::Implementation::catch_up(const Group& group) {
  std::int64_t version = at(group.rows[0]).version;
  while (version < log.now()) {
    version = log.blend_at(version) == nullptr ? go_through_selections(group, version)
                                               : go_through_blends(group, version);
  }
  for (int i = 0; i < group.size; ++i) {
    unlink(group.rows[i]);
    link_newest(group.rows[i]);
  }
}

// A row that lags by many blends takes those along that come next in the order of versions.
void LandmarkStore::Implementation::catch_up(int row) {
  // One that has long not been asked for comes from far while its selections are composed.
  if (steps_behind(row) > 1) at(row).memory.prefetch();
  Group group;
  do {
    group.rows[group.size++] = row;
    row = at(row).after;
  } while (row != kNone && group.size < BlendTile::kRows &&
           blends_behind(row) >= kBlendsForCompany);
  catch_up(group);
}

// Late rows are caught up, oldest first, as many per step as it takes to have had all of them
// before the first of them is too late. Blends cost the same whenever they are gone through, so
// that begins early and goes on evenly; a selection that a row is spared for long is a selection
// saved.
void LandmarkStore::Implementation::bound_log() {
  const std::int64_t steps = steps_allowed();
  const std::int64_t late_steps = steps / 4 * 3;
  constexpr std::int64_t kLateBlends = kBlends / 4;
  const auto is_late = [&](int row) {
    return blends_behind(row) > kLateBlends || steps_behind(row) > late_steps;
  };
  const auto is_too_late = [&](int row) {
    return blends_behind(row) > kBlends || steps_behind(row) > steps;
  };
  std::int64_t quota = 0;
  if (oldest != kNone && is_late(oldest)) {
    const bool by_blends = blends_behind(oldest) > kLateBlends;
    const std::int64_t steps_left = by_blends ? kBlends - kLateBlends : steps - late_steps;
    quota = (used + steps_left - 1) / steps_left;
  }
  while (oldest != kNone && (is_too_late(oldest) || (quota > 0 && is_late(oldest)))) {
    Group group;
    for (int row = oldest; row != kNone && group.size < BlendTile::kRows && is_late(row);
         row = at(row).after) {
      group.rows[group.size++] = row;
    }
    quota -= group.size;
    catch_up(group);
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
  while (from.oldest != kNone && from.at(from.oldest).version < from.log.now()) {
    from.catch_up(from.oldest);
  }
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
  if (store.at(row).version < store.log.now()) store.catch_up(row);
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
  if (store.used > 0) store.log.append_selection(ancestors);
  store.bound_log();
}

void LandmarkStore::blend(const std::vector<BlendPair>& pairs, CovarianceTreatment treatment) {
  Implementation& store = *implementation_;
  check_pairs(pairs, store.particles);
  if (pairs.empty()) return;
  if (store.used > 0) store.log.append_blend(pairs, treatment);
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
