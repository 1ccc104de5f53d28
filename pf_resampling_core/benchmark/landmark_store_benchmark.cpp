#include <algorithm>
#include <cstring>
#include <memory>
#include <random>
#include <vector>

#include "pf_resampling_core/benchmark/report.hpp"
#include "pf_resampling_core/filters/fastslam/landmark_store.hpp"
#include "pf_resampling_core/strategy/compensation.hpp"
#include "pf_resampling_core/strategy/resampling.hpp"

/// The landmark store's part of one FastSLAM update with 100 particles: eight landmarks are read
/// and written in all particles, then the population is renewed. Beside it the plain way: a map per
/// particle, copied whole for every particle that a selection moves, blended whole.
///
/// Three drives. In the first two the robot sees eight neighbouring landmarks, of which one is new
/// every fourth step, or every step, round a loop that takes in the whole map. In the third any
/// eight are seen, which nothing that moves does: the worst case for the store, and for the
/// processor's caches.
namespace pf_resampling {
namespace {

constexpr int kParticles = 100;
constexpr int kSeen = 8;
constexpr int kRenewals = 64;  // different ones, in turn
constexpr int kFields = 6;

enum class Drive { slow, fast, scattered };

const char* name_of(Drive drive) {
  switch (drive) {
    case Drive::slow:
      return "one new in 4 steps";
    case Drive::fast:
      return "one new each step";
    case Drive::scattered:
      break;
  }
  return "scattered";
}

enum class Kind { nothing, selection, keep, moment_matched };

struct Renewals {
  std::vector<Eigen::ArrayXi> selections;
  std::vector<std::vector<BlendPair>> compensations;

  // Weights as at an effective sample size of about one half of the particles.
  Renewals() {
    std::mt19937_64 random(1);
    std::exponential_distribution<double> exponential;
    Resampler resampler;
    for (std::uint32_t step = 0; step < kRenewals; ++step) {
      Eigen::ArrayXd weights(kParticles);
      for (int i = 0; i < kParticles; ++i) weights[i] = exponential(random);
      weights /= weights.sum();
      const RandomStream stream(1, RandomPurpose::test, step);
      selections.emplace_back(resampler.resample(weights, kParticles, stream).ancestors);
      compensations.push_back(compensate({}, weights, stream).pairs);
    }
  }
};

class Seen {
 public:
  Seen(Drive drive, int landmarks) : drive_(drive), landmarks_(landmarks) {}

  // Numbers of the landmarks seen next, all different.
  const int* next() {
    int first = 0;
    int distance = 1;
    if (drive_ == Drive::scattered) {
      // So far from each other that they share nothing.
      first = std::uniform_int_distribution<int>(0, landmarks_ - 1)(random_);
      distance = std::max(1, landmarks_ / kSeen - 1);
    } else {
      first = step_ / (drive_ == Drive::slow ? 4 : 1) % landmarks_;
      ++step_;
    }
    for (int i = 0; i < kSeen; ++i) seen_[i] = (first + i * distance) % landmarks_;
    return seen_;
  }

 private:
  Drive drive_;
  int landmarks_;
  int step_ = 0;
  int seen_[kSeen] = {};
  std::mt19937_64 random_{2};
};

// As an update by a Kalman filter does to memory, with next to no arithmetic.
class Ours {
 public:
  explicit Ours(int landmarks) : store_(kParticles) {
    for (int i = 0; i < landmarks; ++i) {
      const LandmarkRow row = store_.row(store_.add(i));
      std::fill(row.held, row.held + kParticles, std::uint8_t{1});
    }
  }

  void see(const int* numbers) {
    for (int i = 0; i < kSeen; ++i) {
      const LandmarkRow row = store_.row(numbers[i]);
      for (double* field : {row.x, row.y, row.xx, row.xy, row.yy, row.log_odds}) {
        for (int particle = 0; particle < kParticles; ++particle) field[particle] += 1e-3;
      }
    }
  }
  void select(const Eigen::ArrayXi& ancestors) { store_.select(ancestors); }
  void blend(const std::vector<BlendPair>& pairs, CovarianceTreatment treatment) {
    store_.blend(pairs, treatment);
  }

 private:
  LandmarkStore store_;
};

class Eager {
 public:
  explicit Eager(int landmarks)
      : size_(static_cast<std::size_t>(landmarks * kFields)), maps_(size_ * kParticles) {}

  void see(const int* numbers) {
    for (std::size_t particle = 0; particle < kParticles; ++particle) {
      double* map = maps_.data() + particle * size_;
      for (int i = 0; i < kSeen; ++i) {
        for (int f = 0; f < kFields; ++f) map[numbers[i] * kFields + f] += 1e-3;
      }
    }
  }

  // Survivors keep their slots, so only what moves is copied.
  void select(const Eigen::ArrayXi& ancestors) {
    for (int i = 0; i < kParticles; ++i) {
      if (ancestors[i] != i) std::memcpy(map(i), map(ancestors[i]), size_ * sizeof(double));
    }
  }

  void blend(const std::vector<BlendPair>& pairs, CovarianceTreatment treatment) {
    for (const BlendPair& pair : pairs) {
      double* low = map(pair.low);
      const double* high = map(pair.high);
      const double a = pair.share;
      const double b = 1.0 - a;
      if (treatment == CovarianceTreatment::keep) {
        for (std::size_t i = 0; i < size_; i += kFields) {
          for (std::size_t f = 0; f < 2; ++f) low[i + f] = a * low[i + f] + b * high[i + f];
        }
        continue;
      }
      for (std::size_t i = 0; i < size_; i += kFields) {
        const double dx = high[i] - low[i];
        const double dy = high[i + 1] - low[i + 1];
        for (std::size_t f = 0; f < 5; ++f) low[i + f] = a * low[i + f] + b * high[i + f];
        low[i + 2] += a * b * dx * dx;
        low[i + 3] += a * b * dx * dy;
        low[i + 4] += a * b * dy * dy;
      }
    }
  }

 private:
  double* map(int particle) { return maps_.data() + static_cast<std::size_t>(particle) * size_; }

  std::size_t size_;
  std::vector<double> maps_;
};

template <typename Store>
class Updates {
 public:
  Updates(Drive drive, Kind kind, int landmarks)
      : kind_(kind), seen_(drive, landmarks), store_(landmarks) {}

  void step() {
    store_.see(seen_.next());
    const std::size_t turn = turn_++ % kRenewals;
    if (kind_ == Kind::selection) store_.select(renewals().selections[turn]);
    if (kind_ == Kind::keep) {
      store_.blend(renewals().compensations[turn], CovarianceTreatment::keep);
    }
    if (kind_ == Kind::moment_matched) {
      store_.blend(renewals().compensations[turn], CovarianceTreatment::moment_matched);
    }
  }

 private:
  static const Renewals& renewals() {
    static const Renewals all;
    return all;
  }

  Kind kind_;
  Seen seen_;
  std::size_t turn_ = 0;
  Store store_;
};

// `steps_before`, not measured: until every landmark has been seen again, so that the store lags as
// it ever will. Made when it is its turn, and unmade when another is: the maps are large.
template <typename Store>
void measure_updates(const std::string& section, const std::string& contender, Drive drive,
                     Kind kind, int landmarks, int steps_before) {
  static std::shared_ptr<Updates<Store>> current;
  static int next_id = 0;
  static int current_id = -1;
  const int id = next_id++;
  const auto prepare = [=] {
    if (current_id == id) return;
    current.reset();
    current = std::make_shared<Updates<Store>>(drive, kind, landmarks);
    current_id = id;
    for (int i = 0; i < steps_before; ++i) current->step();
  };
  measure(
      section, name_of(drive), contender, landmarks, [] { current->step(); }, false, prepare);
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  using namespace pf_resampling;
  for (const auto& [kind, name] :
       {std::make_pair(Kind::nothing, "no renewal"), std::make_pair(Kind::selection, "selection"),
        std::make_pair(Kind::keep, "compensation, keep"),
        std::make_pair(Kind::moment_matched, "compensation, matched")}) {
    for (const Drive drive : {Drive::slow, Drive::fast, Drive::scattered}) {
      for (const int landmarks : {35, 1000, 10000, 100000}) {
        // No row lags by more than 64 compensations.
        const int before = kind == Kind::selection ? 5 * landmarks : 200;
        measure_updates<Ours>(name, "ours", drive, kind, landmarks, before);
        if (landmarks <= 10000) {
          measure_updates<Eager>(name, "a map per particle", drive, kind, landmarks, 10);
        }
      }
    }
  }
  TableUnit unit;
  unit.text = "us of processor time per update of the store, 100 particles; columns: landmarks";
  unit.per_particle = false;
  unit.nanoseconds = 1000.0;
  unit.with_growth = true;
  return run_and_report(argc, argv, "Landmark store", unit);
}
