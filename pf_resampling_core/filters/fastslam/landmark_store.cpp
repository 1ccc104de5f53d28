#include "pf_resampling_core/filters/fastslam/landmark_store.hpp"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/fastslam/landmark_rows.hpp"

namespace pf_resampling {
namespace {

// Selections after which all rows are brought up to date: a fraction of a microsecond per row and
// selection saved, and the most that a row asked for has to go through. Of small maps of many
// particles the log would outgrow the map (49 bytes a row and particle, 4 a selection).
constexpr std::size_t kMostLogged = 1000;
constexpr std::size_t kMostLoggedPerRow = 4;

struct Row {
  RowMemory memory;
  std::int64_t birth = 0;
  std::size_t version = 0;  // it has gone through so many of the logged selections
  bool is_used = false;
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
  std::vector<Row> rows;
  std::vector<int> free_rows;
  std::vector<std::vector<int>> log;  // selections since all rows were up to date
  RowMemory spare;                    // where the next gather goes
  // The selections from number `from` on as one, up to now: rows that were seen together lag
  // together.
  std::vector<int> composed, longer;
  std::size_t from = 0;

  Row& at(int row) { return rows[static_cast<std::size_t>(row)]; }

  void check_used(int row) const {
    if (row < 0 || static_cast<std::size_t>(row) >= rows.size() ||
        !rows[static_cast<std::size_t>(row)].is_used) {
      throw Error("landmark store: row " + std::to_string(row) +
                  " is not in use; use rows that add() gave and remove() did not take back");
    }
  }

  void forget_composed() {
    composed.resize(static_cast<std::size_t>(particles));
    std::iota(composed.begin(), composed.end(), 0);
    from = log.size();
  }

  void catch_up(Row* row) {
    if (row->version == log.size()) return;
    if (row->version > from) forget_composed();
    while (from > row->version) {
      compose(log[--from], composed, &longer);
      composed.swap(longer);
    }
    gather(row->memory, composed, &spare);
    std::swap(row->memory, spare);
    row->version = log.size();
  }

  // The latest first, so that no composition is made twice.
  void catch_up_all() {
    std::vector<Row*> late;
    for (Row& row : rows) {
      if (row.is_used) late.push_back(&row);
    }
    std::sort(late.begin(), late.end(),
              [](const Row* a, const Row* b) { return a->version > b->version; });
    for (Row* row : late) {
      catch_up(row);
      row->version = 0;
    }
    log.clear();
    forget_composed();
  }
};

LandmarkStore::LandmarkStore(int particles) : implementation_(std::make_unique<Implementation>()) {
  if (particles < 1) {
    throw Error("landmark store: " + std::to_string(particles) +
                " particles were asked for; ask for at least 1");
  }
  implementation_->particles = particles;
  implementation_->forget_composed();
}
LandmarkStore::~LandmarkStore() = default;
LandmarkStore::LandmarkStore(const LandmarkStore& other)
    : implementation_(std::make_unique<Implementation>()) {
  Implementation& from = *other.implementation_;
  from.catch_up_all();
  implementation_->particles = from.particles;
  implementation_->rows = from.rows;
  implementation_->free_rows = from.free_rows;
  implementation_->forget_composed();
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
  added.version = store.log.size();
  added.is_used = true;
  return row;
}

void LandmarkStore::remove(int row) {
  Implementation& store = *implementation_;
  store.check_used(row);
  store.at(row) = Row{};
  store.free_rows.push_back(row);
}

std::int64_t LandmarkStore::birth(int row) const {
  implementation_->check_used(row);
  return implementation_->at(row).birth;
}

LandmarkRow LandmarkStore::row(int row) {
  Implementation& store = *implementation_;
  store.check_used(row);
  store.catch_up(&store.at(row));
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
  store.log.emplace_back(ancestors.data(), ancestors.data() + ancestors.size());
  store.forget_composed();
  if (store.log.size() >= std::min(kMostLogged, kMostLoggedPerRow * store.rows.size())) {
    store.catch_up_all();
  }
}

void LandmarkStore::blend(const std::vector<BlendPair>& pairs, CovarianceTreatment treatment) {
  Implementation& store = *implementation_;
  check_pairs(pairs, store.particles);
  if (pairs.empty()) return;
  store.catch_up_all();
  for (Row& row : store.rows) {
    if (row.is_used) pf_resampling::blend(pairs, treatment, &row.memory);
  }
}

}  // namespace pf_resampling
