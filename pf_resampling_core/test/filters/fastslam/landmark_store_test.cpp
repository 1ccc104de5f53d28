#include "pf_resampling_core/filters/fastslam/landmark_store.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <utility>
#include <vector>

#include "pf_resampling_core/test/filters/fastslam/eager_landmark_store.hpp"

namespace pf_resampling {
namespace {

std::vector<double*> fields_of(const LandmarkRow& row) {
  return {row.x, row.y, row.xx, row.xy, row.yy, row.log_odds};
}

// How often each kind of operation comes in a sequence, and between which sizes it moves.
struct Mixture {
  int observe, select, resize, blend, add, remove, read;
  int particles, rows, operations;
};

// Two stores that go through the same.
class Twins {
 public:
  Twins(std::uint32_t seed, const Mixture& mixture)
      : mixture_(mixture),
        random_(seed),
        particles_(1 + below(mixture.particles)),
        lazy_(particles_),
        eager_(particles_) {}

  void run() {
    const std::vector<double> weights{double(mixture_.observe), double(mixture_.select),
                                      double(mixture_.resize),  double(mixture_.blend),
                                      double(mixture_.add),     double(mixture_.remove),
                                      double(mixture_.read)};
    std::discrete_distribution<int> kind(weights.begin(), weights.end());
    for (int i = 0; i < mixture_.operations && !testing::Test::HasFatalFailure(); ++i) {
      switch (kind(random_)) {
        case 0:
          observe();
          break;
        case 1:
          select(static_cast<int>(eager_.particles()));
          break;
        case 2:
          select(1 + below(mixture_.particles));
          break;
        case 3:
          blend();
          break;
        case 4:
          add();
          break;
        case 5:
          remove();
          break;
        case 6:
          if (!eager_.rows().empty()) compare(any_row());
          break;
      }
      if (i % 97 == 96) go_on_with_one_of_two(i % 2 == 0);
    }
    for (const auto& [number, row] : eager_.rows()) compare(number);
  }

 private:
  int below(int end) { return std::uniform_int_distribution<int>(0, end - 1)(random_); }
  double real() { return std::normal_distribution<double>(0.0, 10.0)(random_); }

  int any_row() {
    auto it = eager_.rows().begin();
    std::advance(it, below(static_cast<int>(eager_.rows().size())));
    return it->first;
  }

  void add() {
    if (static_cast<int>(eager_.rows().size()) >= mixture_.rows) return;
    const std::int64_t birth = below(1 << 30);
    const int row = lazy_.add(birth);
    ASSERT_EQ(eager_.rows().count(row), 0u);
    eager_.add(row, birth);
    if (below(2) == 0) observe_row(row);
  }

  void remove() {
    if (eager_.rows().empty()) return;
    const int row = any_row();
    lazy_.remove(row);
    ASSERT_FALSE(lazy_.is_used(row));
    eager_.rows().erase(row);
  }

  void observe() {
    if (!eager_.rows().empty()) observe_row(any_row());
  }

  void observe_row(int number) {
    compare(number);
    const LandmarkRow lazy = lazy_.row(number);
    EagerStore::Row& eager = eager_.rows()[number];
    const int skipped = below(3);  // every particle, one in two, two in three
    for (std::size_t i = 0; i < eager_.particles(); ++i) {
      if (skipped > 0 && below(skipped + 1) == 0) continue;
      const auto fields = fields_of(lazy);
      for (std::size_t f = 0; f < EagerStore::kFields; ++f)
        fields[f][i] = eager.fields[f][i] = real();
      lazy.held[i] = eager.held[i] = below(20) == 0 ? 0 : 1;
    }
  }

  void select(int size) {
    Eigen::ArrayXi ancestors(size);
    const int kind = below(8);
    for (int i = 0; i < size; ++i) {
      const int any = below(static_cast<int>(eager_.particles()));
      // Nobody moves (if the size is the same), few move, all are drawn anew.
      const bool stays = kind == 0 || (kind < 5 && below(4) > 0);
      ancestors[i] = stays ? i % static_cast<int>(eager_.particles()) : any;
    }
    lazy_.select(ancestors);
    eager_.select(ancestors);
    ASSERT_EQ(lazy_.particles(), size);
  }

  void blend() {
    const int size = static_cast<int>(eager_.particles());
    std::vector<int> slots(eager_.particles());
    for (int i = 0; i < size; ++i) slots[static_cast<std::size_t>(i)] = i;
    std::shuffle(slots.begin(), slots.end(), random_);
    const int lows = below(size);
    std::vector<BlendPair> pairs;
    for (int i = 0; i < lows; ++i) {
      const int high = lows + below(size - lows);
      const double share = below(10) == 0 ? 0.0 : 0.5 * below(1000) / 999.0;
      pairs.push_back(
          {slots[static_cast<std::size_t>(i)], slots[static_cast<std::size_t>(high)], share});
      if (below(4) == 0) pairs.back().total = share + 0.5 * below(1000) / 999.0;  // as printed
    }
    const auto treatment =
        below(3) == 0 ? CovarianceTreatment::moment_matched : CovarianceTreatment::keep;
    lazy_.blend(pairs, treatment);
    eager_.blend(pairs, treatment);
  }

  // A copy, or what it was made of, whatever becomes of the other.
  void go_on_with_one_of_two(bool with_copy) {
    LandmarkStore copy = lazy_;
    if (with_copy) std::swap(copy, lazy_);
    for (const auto& [number, row] : eager_.rows()) copy.row(number).x[0] += 1.0;
  }

  // To the bit.
  void compare(int number) {
    const LandmarkRow lazy = lazy_.row(number);
    const EagerStore::Row& eager = eager_.rows()[number];
    ASSERT_EQ(lazy_.birth(number), eager.birth);
    const auto fields = fields_of(lazy);
    for (std::size_t f = 0; f < EagerStore::kFields; ++f) {
      for (std::size_t i = 0; i < eager_.particles(); ++i) {
        ASSERT_EQ(std::memcmp(&fields[f][i], &eager.fields[f][i], sizeof(double)), 0)
            << "field " << f << " of row " << number << " in particle " << i << ": " << fields[f][i]
            << " instead of " << eager.fields[f][i];
      }
    }
    ASSERT_EQ(std::memcmp(lazy.held, eager.held.data(), eager_.particles()), 0);
  }

  Mixture mixture_;
  std::mt19937 random_;
  int particles_;
  LandmarkStore lazy_;
  EagerStore eager_;
};

// observe, select, resize, blend, add, remove, read; particles, rows, operations.
TEST(LandmarkStore, EqualsTheEagerOneAfterAnySequence) {
  const std::vector<std::pair<std::uint32_t, Mixture>> sequences = {
      {2000, {10, 10, 2, 10, 5, 2, 5, 20, 12, 80}},
      {1000, {3, 40, 2, 1, 3, 1, 1, 40, 10, 150}},  // mostly selections
      {1000, {3, 1, 0, 40, 4, 1, 1, 40, 25, 150}},  // mostly compensations
      {20, {5, 1000, 1, 0, 10, 2, 0, 6, 8, 8000}},  // selections that nobody asks for
      {30, {40, 10, 0, 10, 200, 20, 10, 8, 400, 1200}},
      {200, {10, 10, 0, 10, 5, 2, 5, 1, 5, 60}},
      {20, {10, 10, 5, 10, 5, 1, 5, 1100, 4, 40}}};  // whole pages: a row lies otherwise in memory
  for (std::size_t kind = 0; kind < sequences.size(); ++kind) {
    for (std::uint32_t seed = 0; seed < sequences[kind].first; ++seed) {
      Twins(seed, sequences[kind].second).run();
      ASSERT_FALSE(HasFatalFailure()) << "in sequence " << seed << " of kind " << kind;
    }
  }
}

class LandmarkStoreTest : public testing::Test {
 protected:
  // A row of the store with x = 0, 1, 2, …, held by all.
  static int add_numbered(LandmarkStore* store, std::int64_t birth = 0) {
    const int number = store->add(birth);
    const LandmarkRow row = store->row(number);
    for (int i = 0; i < store->particles(); ++i) {
      row.x[i] = i;
      row.held[i] = 1;
    }
    return number;
  }

  static std::vector<double> x_of(LandmarkStore* store, int number) {
    const LandmarkRow row = store->row(number);
    return {row.x, row.x + store->particles()};
  }

  using Values = std::vector<double>;
};

TEST_F(LandmarkStoreTest, BlendsOnlyWhatBothHold) {
  for (const CovarianceTreatment treatment : all_values<CovarianceTreatment>()) {
    LandmarkStore store(4);
    const int number = store.add(0);
    const LandmarkRow row = store.row(number);
    for (int i = 0; i < 4; ++i) {
      row.x[i] = i;
      row.y[i] = -i;
      row.xx[i] = row.yy[i] = 1.0;
      row.xy[i] = 0.25 * i;
      row.log_odds[i] = i;
      row.held[i] = i == 1 || i == 2 ? 1 : 0;
    }
    // Held by the low one only, by the high one only.
    store.blend({{1, 0, 0.5}, {3, 2, 0.5}}, treatment);
    EXPECT_EQ(x_of(&store, number), (Values{0, 1, 2, 3}));
    // By both: a = 1/4, b = 3/4, d = (1, -1).
    store.blend({{1, 2, 0.25}}, treatment);
    const LandmarkRow now = store.row(number);
    EXPECT_EQ(now.x[1], 1.75);
    EXPECT_EQ(now.y[1], -1.75);
    EXPECT_EQ(now.log_odds[1], 1.0);
    const bool matched = treatment == CovarianceTreatment::moment_matched;
    EXPECT_EQ(now.xx[1], matched ? 1.0 + 0.1875 : 1.0);
    EXPECT_EQ(now.yy[1], matched ? 1.0 + 0.1875 : 1.0);
    EXPECT_EQ(now.xy[1], matched ? 0.0625 + 0.375 - 0.1875 : 0.25);
    EXPECT_EQ(now.held[0] + now.held[3], 0);
    EXPECT_EQ(now.x[2], 2.0);
  }
}

TEST_F(LandmarkStoreTest, RowsDoNotMoveUntilThePopulationChanges) {
  LandmarkStore store(5);
  const int first = add_numbered(&store);
  const LandmarkRow row = store.row(first);
  for (int i = 0; i < 100; ++i) add_numbered(&store);
  EXPECT_EQ(store.row(first).x, row.x);
  EXPECT_EQ(store.row(first).held, row.held);
}

}  // namespace
}  // namespace pf_resampling
