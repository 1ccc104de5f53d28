// Operations on the landmark store, and on the plain one that applies each at once: the same bits.
#include "pf_resampling_core/filters/fastslam/landmark_store.hpp"

#include <algorithm>
#include <cstring>
#include <iterator>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/test/filters/fastslam/eager_landmark_store.hpp"
#include "test/fuzz/fuzz_target.hpp"

namespace pf_resampling::fuzz {
namespace {

constexpr int kMostParticles = 24;
constexpr std::size_t kMostRows = 20;

class Twins {
 public:
  explicit Twins(Bytes* bytes)
      : bytes_(bytes), lazy_(1 + bytes->below(kMostParticles)), eager_(lazy_.particles()) {}

  void run() {
    while (!bytes_->empty()) {
      step();
      const auto used = static_cast<std::int64_t>(eager_.rows().size());
      require(lazy_.log_length() <= std::max<std::int64_t>(4096, 4 * used), "the log has no end");
    }
    for (const auto& [number, row] : eager_.rows()) compare(number);
  }

 private:
  void step() {
    switch (bytes_->below(8)) {
      case 0:
        return add();
      case 1:
        return observe();
      case 2:
        return select(lazy_.particles());
      case 3:
        return select(1 + bytes_->below(kMostParticles));
      case 4:
        return blend();
      case 5:
        return remove();
      case 6:
        return compare_any();
      default:
        return go_on_with_copy();
    }
  }

  int any_row() {
    auto it = eager_.rows().begin();
    std::advance(it, bytes_->below(static_cast<int>(eager_.rows().size())));
    return it->first;
  }

  void add() {
    if (eager_.rows().size() >= kMostRows) return;
    const std::int64_t birth = bytes_->integer();
    const int row = lazy_.add(birth);
    require(eager_.rows().count(row) == 0, "a row was given out twice");
    eager_.add(row, birth);
  }

  void remove() {
    if (eager_.rows().empty()) return;
    const int row = any_row();
    lazy_.remove(row);
    require(!lazy_.is_used(row), "a removed row is in use");
    eager_.rows().erase(row);
  }

  // A value of all particles from one decision: bytes go into the order of operations.
  void observe() {
    if (eager_.rows().empty()) return;
    const int number = any_row();
    compare(number);
    const LandmarkRow lazy = lazy_.row(number);
    EagerStore::Row& eager = eager_.rows()[number];
    const double value = bytes_->moderate();
    const int skipped = bytes_->below(4);
    double* const fields[] = {lazy.x, lazy.y, lazy.xx, lazy.xy, lazy.yy, lazy.log_odds};
    for (std::size_t i = 0; i < eager_.particles(); ++i) {
      if (skipped > 0 && i % 4 == static_cast<std::size_t>(skipped)) continue;
      for (std::size_t f = 0; f < EagerStore::kFields; ++f) {
        fields[f][i] = eager.fields[f][i] =
            value * static_cast<double>(i + 1) + static_cast<double>(f);
      }
      lazy.held[i] = eager.held[i] = skipped == 2 && i % 3 == 0 ? 0 : 1;
    }
  }

  void select(int size) {
    Eigen::ArrayXi ancestors(size);
    // One beyond the end, and one before the beginning, to be refused.
    for (int i = 0; i < size; ++i) ancestors[i] = bytes_->below(lazy_.particles() + 2) - 1;
    const bool fits = (ancestors >= 0).all() && (ancestors < lazy_.particles()).all();
    bool refused = false;
    try {
      lazy_.select(ancestors);
    } catch (const Error&) {
      refused = true;
    }
    require(refused == !fits, "a selection is refused that is one, or taken that is none");
    if (fits) eager_.select(ancestors);
  }

  // Lows are the first few of an order of the slots, highs come from the rest.
  void blend() {
    const int size = lazy_.particles();
    const int lows = bytes_->below(size);
    const int step = 1 + bytes_->below(size);
    std::vector<BlendPair> pairs;
    for (int i = 0; i < lows; ++i) {
      const int high = lows + (i * step) % (size - lows);
      pairs.push_back({i, high, 0.5 * bytes_->byte() / 255.0});
      if (bytes_->flip()) pairs.back().total = pairs.back().share + 0.5 * bytes_->byte() / 255.0;
    }
    const auto treatment =
        bytes_->flip() ? CovarianceTreatment::moment_matched : CovarianceTreatment::keep;
    lazy_.blend(pairs, treatment);
    eager_.blend(pairs, treatment);
  }

  // A copy, or what it was made of, whatever becomes of the other.
  void go_on_with_copy() {
    LandmarkStore copy = lazy_;
    if (bytes_->flip()) std::swap(copy, lazy_);
    for (const auto& [number, row] : eager_.rows()) copy.row(number).x[0] += 1.0;
  }

  void compare_any() {
    if (!eager_.rows().empty()) compare(any_row());
  }

  void compare(int number) {
    const LandmarkRow lazy = lazy_.row(number);
    const EagerStore::Row& eager = eager_.rows()[number];
    require(lazy_.birth(number) == eager.birth, "a row is another's");
    const double* const fields[] = {lazy.x, lazy.y, lazy.xx, lazy.xy, lazy.yy, lazy.log_odds};
    for (std::size_t f = 0; f < EagerStore::kFields; ++f) {
      require(
          std::memcmp(fields[f], eager.fields[f].data(), eager_.particles() * sizeof(double)) == 0,
          "a field differs from that of the store that applies each step at once");
    }
    require(std::memcmp(lazy.held, eager.held.data(), eager_.particles()) == 0,
            "who holds a landmark differs");
  }

  Bytes* bytes_;
  LandmarkStore lazy_;
  EagerStore eager_;
};

}  // namespace

void landmark_store(const std::uint8_t* bytes, std::size_t size) {
  Bytes decisions(bytes, std::min<std::size_t>(size, 4096));
  Twins(&decisions).run();
}

}  // namespace pf_resampling::fuzz
