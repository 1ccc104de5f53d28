// How RangeMemory tells which radios are not as listed.
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "pf_resampling_core/range_memory/range_memory.hpp"

namespace pf_resampling {
namespace {

using Common = CommonUnknown;
using RadioOf = RadioUnknown;

constexpr double kCopyShare = 0.1;  // of a range in the share of those that are copies
constexpr int kFewestRanges = 30;
constexpr int kFewestRangesAtFirst = 10;  // while odometry alone has the shape of the path
// A radio has changed if all but so few of its newest ranges are off by so many standard
// deviations.
constexpr int kFewOfNewest = kFewestRanges / 5;
constexpr double kShift = 1.0;
constexpr double kSuspiciousCost = 0.6;    // mean of a range; independent ones: 0.45
constexpr double kPull = 3.0;              // gain of the cost if its place were free
constexpr double kOwnBias = 2.0;           // standard deviations
constexpr int kRounds = 4;                 // of faults and errors, one found in each
constexpr double kLeastFault = 0.3;        // m
constexpr double kPromising = 20.0;        // of the logarithm of the evidence
constexpr std::size_t kMistakesTried = 4;  // of two radios
// Along one line mirrored paths and places explain ranges as well as the true ones: no radio is
// named.
constexpr double kTurnedBeforeNaming = 1.0;  // rad, between headings of most ranges
constexpr double kMostRanges = 0.9;
// Two radios elsewhere and a scale explain what one radio elsewhere does, if they may.
constexpr double kAnotherFault = 1e-5;  // odds, before there are data
constexpr double kLooseOdds = 0.4;      // of an error that may be there, before there are data
constexpr double kGrossOdds = 1e-3;     // of odometry that counts several times what it should
constexpr double kDoubtfulNoise = 3.0;  // a factor
constexpr double kGrossLatest = 120.0;  // s, a first turn included
constexpr OdometryFactors kFactors[] = {
    {1.0, 1.0},  {0.25, 1.0}, {1.0 / 3.0, 1.0}, {0.5, 1.0}, {2.0, 1.0}, {3.0, 1.0}, {4.0, 1.0},
    {1.0, -1.0}, {1.0, 0.25}, {1.0, 1.0 / 3.0}, {1.0, 0.5}, {1.0, 2.0}, {1.0, 3.0}, {1.0, 4.0}};

bool has_fault(const RangeMode& mode) {
  return std::any_of(mode.accounts.begin(), mode.accounts.end(), [](RadioAccount account) {
    return account != RadioAccount::as_listed && account != RadioAccount::unlisted;
  });
}

}  // namespace

// m, by which the ranges of a radio are too long, as a rule: a wild range has no slope, so a bias
// of many standard deviations is not found from 0.
double RangeMemory::excess_of(int radio, const RangeMode& mode) const {
  std::vector<double> excesses;
  for (std::size_t k = 0; k < graph_.ranges.size(); ++k) {
    for (const HeldRange& range : graph_.ranges[k]) {
      if (range.radio != radio) continue;
      excesses.push_back(-residual_in(mode, k, range) * noise_.range * std::sqrt(range.variance));
    }
  }
  return excesses.empty() ? 0.0 : median_of(std::move(excesses));
}

// Of the data, with what is believed of faults before.
double RangeMemory::log_probability(const RangeMode& mode) const {
  double log_prior = 0.0;
  for (const RadioAccount account : mode.accounts) {
    const bool is_fault = account == RadioAccount::elsewhere || account == RadioAccount::biased;
    if (is_fault) log_prior += std::log(log_prior < 0.0 ? kAnotherFault : options_.fault_odds);
  }
  // One mistake swaps two.
  if (has_mistake(mode))
    log_prior += std::log(log_prior < 0.0 ? kAnotherFault : options_.fault_odds);
  const auto loose = std::count(mode.loose.begin(), mode.loose.end(), true);
  log_prior += static_cast<double>(loose) * std::log(kLooseOdds);
  return mode.belief.log_evidence / (doubt_ * doubt_) + log_prior;
}

void RangeMemory::judge_radios() {
  const int heard = std::accumulate(radios_.begin(), radios_.end(), 0,
                                    [](int sum, const Radio& radio) { return sum + radio.ranges; });
  are_judged_ = heard >= kFewestRangesAtFirst * static_cast<int>(radios_.size());
  has_turned_ = heading_spread(modes_.front()) > kTurnedBeforeNaming;
  const int fewest = time_ < kRigid ? kFewestRangesAtFirst : kFewestRanges;
  for (int round = 0; round < kRounds; ++round) {
    const RangeMode mode = modes_.front();
    std::vector<int> listed, faults;
    for (std::size_t r = 0; r < radios_.size(); ++r) {
      if (mode.accounts[r] == RadioAccount::as_listed && radios_[r].ranges >= fewest) {
        listed.push_back(static_cast<int>(r));
      } else if (mode.accounts[r] != RadioAccount::unlisted) {
        faults.push_back(static_cast<int>(r));
      }
    }
    std::vector<std::optional<RangeMode>> others;
    const std::vector<bool> is_suspicious = suspicious(mode);
    // Two may be wrong where two others are right.
    if (round == 0 && time_ < kRigid && !mode.past && radios_.size() >= 4) {
      for (RangeMode& other : with_mistakes(mode, is_suspicious)) {
        others.emplace_back(std::move(other));
      }
    }
    for (const int fault : faults) {
      const RadioAccount account = mode.accounts[static_cast<std::size_t>(fault)];
      if (account == RadioAccount::as_listed || account == RadioAccount::mistaken) continue;
      // On one side of it, a radio elsewhere looks like one with a bias.
      for (const RadioAccount other :
           {RadioAccount::as_listed, RadioAccount::elsewhere, RadioAccount::biased}) {
        if (other != account) others.push_back(with_fault(mode, fault, other, fault));
      }
      for (const int radio : listed) {
        others.push_back(with_fault(mode, radio, RadioAccount::elsewhere, fault));
      }
    }
    if (listed.size() >= 3) {
      for (const int radio : listed) {
        if (!is_suspicious[static_cast<std::size_t>(radio)]) continue;
        others.push_back(with_fault(mode, radio, RadioAccount::elsewhere, -1));
        others.push_back(with_fault(mode, radio, RadioAccount::biased, -1));
      }
    }
    for (std::size_t error = 0; error < LooseError::count; ++error) {
      others.push_back(with_other_error(mode, static_cast<LooseError::Index>(error)));
    }
    for (std::optional<RangeMode>& other : others) {
      if (!other) continue;
      // Another fault may need another error, too.
      const bool is_promising = other->accounts != mode.accounts &&
                                log_probability(*other) > log_probability(mode) - kPromising;
      for (std::size_t error = 0; is_promising && error < LooseError::count; ++error) {
        auto both = with_other_error(*other, static_cast<LooseError::Index>(error));
        if (both) modes_.push_back(std::move(*both));
      }
      modes_.push_back(std::move(*other));
    }
    weigh_modes();
    if (modes_.front().accounts == mode.accounts && modes_.front().loose == mode.loose) return;
  }
}

// rad, that the headings of most ranges are apart.
double RangeMemory::heading_spread(const RangeMode& mode) const {
  std::vector<double> headings;
  double heading = 0.0;
  for (std::size_t k = 0; k < graph_.ranges.size(); ++k) {
    heading += wrap_angle(mode.estimate.keyframes[k][2] - heading);
    headings.insert(headings.end(), graph_.ranges[k].size(), heading);
  }
  std::sort(headings.begin(), headings.end());
  const auto left_out =
      static_cast<std::size_t>(0.5 * (1.0 - kMostRanges) * static_cast<double>(headings.size()));
  return headings[headings.size() - 1 - left_out] - headings[left_out];
}

// Of each radio: whether its ranges fit badly, or pull at its place or bias.
std::vector<bool> RangeMemory::suspicious(const RangeMode& mode) const {
  const RangeLoss loss(noise_);
  std::vector<double> costs(radios_.size(), 0.0), counts(radios_.size(), 0.0);
  for (std::size_t k = 0; k < graph_.ranges.size(); ++k) {
    for (const HeldRange& range : graph_.ranges[k]) {
      const auto radio = static_cast<std::size_t>(range.radio);
      costs[radio] += loss.at(residual_in(mode, k, range), range.variance).cost;
      counts[radio] += 1.0;
    }
  }
  std::vector<bool> is_suspicious(radios_.size(), false);
  for (std::size_t r = 0; r < radios_.size(); ++r) {
    if (mode.accounts[r] != RadioAccount::as_listed || counts[r] < 1.0) continue;
    const int at = radio_at(static_cast<int>(r));
    const double information = 1.0 / (options_.surveyed * options_.surveyed);
    const Eigen::Vector2d pull =
        information * (mode.estimate.constants - mode.prior.constants).segment<2>(at);
    const Eigen::Matrix2d place =
        mode.belief.covariance.block<2, 2>(kKeyframe + at, kKeyframe + at);
    const Eigen::Matrix2d data = place.inverse() - information * Eigen::Matrix2d::Identity() +
                                 1.0 / (kElsewhere * kElsewhere) * Eigen::Matrix2d::Identity();
    const double own = (mode.estimate.constants - mode.prior.constants)[at + RadioOf::bias];
    is_suspicious[r] = costs[r] / counts[r] > kSuspiciousCost ||
                       0.5 * pull.dot(data.inverse() * pull) > kPull ||
                       std::abs(own) > kOwnBias * options_.own_bias;
  }
  return is_suspicious;
}

// Most ranges of the newest lie to one side of those before: of a radio that was moved, or has
// something in front of it, what was said before would outvote the rest for as long again.
std::optional<RangeMemory::Change> RangeMemory::newest_change() const {
  if (modes_.empty()) return std::nullopt;
  const RangeMode& mode = modes_.front();
  std::vector<std::vector<double>> newest(radios_.size());
  // Some may be silent.
  std::size_t left = 2 * kFewestRanges * radios_.size();
  for (std::size_t k = graph_.ranges.size(); k-- > 0 && left > 0;) {
    const auto& ranges = graph_.ranges[k];
    for (auto range = ranges.rbegin(); range != ranges.rend() && left > 0; ++range, --left) {
      const auto radio = static_cast<std::size_t>(range->radio);
      if (mode.estimate.takes_part[radio] && newest[radio].size() < kFewestRanges) {
        newest[radio].push_back(residual_in(mode, k, *range));
      }
    }
  }
  for (std::size_t r = 0; r < newest.size(); ++r) {
    if (newest[r].size() < kFewestRanges) continue;
    std::sort(newest[r].begin(), newest[r].end());
    const double low = newest[r][kFewOfNewest];
    const double high = newest[r][kFewestRanges - 1 - kFewOfNewest];
    // Those before are many, and seldom have to be looked at.
    if (std::max(low, -high) < 0.5 * kShift * doubt_) continue;
    std::vector<double> all;
    for (std::size_t k = 0; k < graph_.ranges.size(); ++k) {
      for (const HeldRange& range : graph_.ranges[k]) {
        if (static_cast<std::size_t>(range.radio) == r) all.push_back(residual_in(mode, k, range));
      }
    }
    if (all.size() < 2 * kFewestRanges) continue;
    all.resize(all.size() - kFewestRanges);
    const auto before = static_cast<int>(all.size());
    const double median = median_of(std::move(all));
    if (std::max(low - median, median - high) < kShift * doubt_) continue;
    return Change{static_cast<int>(r), before};
  }
  return std::nullopt;
}

void RangeMemory::forget_before(const Change& change) {
  radios_[static_cast<std::size_t>(change.radio)].ranges -= change.ranges;
  int left = change.ranges;
  for (auto& ranges : graph_.ranges) {
    ranges.erase(std::remove_if(ranges.begin(), ranges.end(),
                                [&](const HeldRange& range) {
                                  return range.radio == change.radio && left-- > 0;
                                }),
                 ranges.end());
  }
  for (RangeMode& mode : modes_) {
    mode.settled.reset();
    if (mode.past) mode.past = without_radio(change.radio, mode.prior, std::move(*mode.past));
    const auto radio = static_cast<std::size_t>(change.radio);
    if (!radios_[radio].listed) mode.estimate.takes_part[radio] = false;  // until it is found again
  }
}

// A range that is another's to the bit tells nothing, but would count as one more opinion. That of
// a radio that counts in centimetres may be so by chance.
void RangeMemory::note_copy(double range, Radio* radio) const {
  const auto copied = std::find_if(radios_.begin(), radios_.end(), [&](const Radio& other) {
    return other.id != radio->id && other.newest == range;
  });
  const bool is_copy = copied != radios_.end();
  radio->copied += kCopyShare * ((is_copy ? 1.0 : 0.0) - radio->copied);
  if (is_copy) {
    radio->copies = copied->id;
  } else {
    radio->newest = range;
  }
}

// All that it has said so far.
void RangeMemory::leave_out(int radio) {
  const auto r = static_cast<std::size_t>(radio);
  forget_before({radio, radios_[r].ranges});
  radios_[r].other_places.clear();
  next_solution_of_all_ = time_;
  if (!radios_[r].listed) return;
  const RangePrior listed = prior();
  for (RangeMode& mode : modes_) {
    set_account(radio, RadioAccount::as_listed, &mode);
    for (Eigen::VectorXd* constants : {&mode.prior.constants, &mode.estimate.constants}) {
      constants->segment<RadioOf::count>(radio_at(radio)) =
          listed.constants.segment<RadioOf::count>(radio_at(radio));
    }
  }
}

// Odometry that is grossly wrong: of several factors that which fits the coarsest path best, if it
// explains the data better than all as it is.
bool RangeMemory::try_gross_odometry() {
  const RangeMode& mode = modes_.front();
  const bool is_doubtful = std::max(noise_.translation, noise_.heading) > kDoubtfulNoise ||
                           has_fault(mode) || has_slipped_since(times_.front()) ||
                           !explains_newest();
  // Ranges may take the blame for lengths. Of a list that is wrong they take it, too, and a robot
  // that turns the wrong way would fit such a list.
  const bool may_be_long = noise_.range > kDoubtfulNoise;
  const bool is_known = mode.past || odometry_factors_ != OdometryFactors{};
  if (!(is_doubtful || may_be_long) || is_known || time_ > kGrossLatest || beacons_.size() < 2)
    return false;
  const RangeMode listed = as_listed();
  const auto with_factors = [&](const OdometryFactors& factors) {
    RangeMode other = listed;
    other.prior.constants[Common::distance_scale] = factors.distance - 1.0;
    other.prior.constants[Common::turn_scale] = factors.turn - 1.0;
    other.estimate.constants = other.prior.constants;
    return other;
  };
  OdometryFactors best;
  double least = std::numeric_limits<double>::infinity();
  for (const OdometryFactors& factors : kFactors) {
    if (!is_doubtful && factors.turn != 1.0) continue;
    const auto poses = first_poses(with_factors(factors), 2);
    if (poses.empty() || !(poses.front().first < least)) continue;
    least = poses.front().first;
    best = factors;
  }
  if (!(best != OdometryFactors{})) return false;
  const double before = log_probability(mode) + log_prior_of_noise(noise_);
  const auto kept = std::tuple(modes_, noise_, next_trial_, trial_steps_);
  noise_ = RangeNoise{};
  modes_ = starts(with_factors(best), kRefined, &noise_);
  weigh_modes();
  if (!modes_.empty()) learn_noise();
  const double after = modes_.empty() ? -std::numeric_limits<double>::infinity()
                                      : log_probability(modes_.front()) +
                                            log_prior_of_noise(noise_) + std::log(kGrossOdds);
  std::tie(modes_, noise_, next_trial_, trial_steps_) = kept;
  if (!(after > before)) return false;
  begin_anew(best);
  return true;
}

// The mode with an error that may be there, or is not there any more; nothing if it cannot be.
std::optional<RangeMode> RangeMemory::with_other_error(const RangeMode& mode,
                                                       LooseError::Index error) const {
  if (!may_be_loose(error)) return std::nullopt;
  RangeMode other = mode;
  other.settled.reset();
  other.loose[error] = !other.loose[error];
  other.prior.constants_sigma = sigmas(other.accounts, other.loose);
  if (!solved(kIterations, &other)) return std::nullopt;
  return other;
}

// Where radios do not fit: all as listed, and with one at the place of another, or both at each
// other's, those that fit best. The path without them may be far off, so each is looked for from
// starts of its own.
std::vector<RangeMode> RangeMemory::with_mistakes(const RangeMode& mode,
                                                  const std::vector<bool>& is_suspicious) const {
  const RangeMode listed = as_listed();
  // A mirrored path mistakes the other two.
  const bool may_be_others = has_mistake(mode);
  const auto may_be_wrong = [&](std::size_t radio) {
    return may_be_others || is_suspicious[radio] || mode.accounts[radio] != RadioAccount::as_listed;
  };
  // m^2: what a radio's own height adds where it hangs as high as another one.
  const auto height_of = [&](std::size_t radio, std::size_t place) {
    for (const auto& ranges : graph_.ranges) {
      for (const HeldRange& range : ranges) {
        if (static_cast<std::size_t>(range.radio) != radio || !range.height) continue;
        const Beacon& other = *radios_[place].listed;
        const double higher = other.position.z() - radios_[radio].listed->position.z();
        const double there = other.is_planar ? 0.0 : *range.height + higher;
        return there * there - *range.height * *range.height;
      }
    }
    return 0.0;
  };
  const auto mistake = [&](std::size_t radio, std::size_t place, RangeMode* other) {
    other->accounts[radio] = RadioAccount::mistaken;
    const int at = radio_at(static_cast<int>(radio));
    for (Eigen::VectorXd* constants : {&other->prior.constants, &other->estimate.constants}) {
      constants->segment<2>(at) =
          listed.prior.constants.segment<2>(radio_at(static_cast<int>(place)));
      (*constants)[at + RadioOf::height] = height_of(radio, place);
    }
  };
  std::vector<std::pair<double, RangeMode>> pairs;
  const auto consider = [&](const RangeMode& other) {
    const auto poses = first_poses(other, 2);
    if (!poses.empty()) pairs.emplace_back(poses.front().first, other);
  };
  for (std::size_t a = 0; a < radios_.size(); ++a) {
    for (std::size_t b = 0; b < radios_.size(); ++b) {
      if (a == b || !radios_[a].listed || !radios_[b].listed || !may_be_wrong(a)) continue;
      RangeMode other = listed;
      mistake(a, b, &other);
      consider(other);
      if (may_be_wrong(b) && b < a) continue;  // the other way round
      mistake(b, a, &other);
      consider(other);
    }
  }
  if (pairs.empty()) return {};
  std::sort(pairs.begin(), pairs.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  // A wrong pair explains a few ranges, too.
  pairs.resize(std::min(pairs.size(), are_judged_ ? kMistakesTried : 0));
  pairs.emplace_back(0.0, listed);
  std::vector<RangeMode> found;
  for (const auto& [cost, pair] : pairs) {
    RangeNoise noise = noise_;
    std::vector<RangeMode> begun = starts(pair, kRefinedOfMany, &noise);
    if (!begun.empty()) found.push_back(std::move(begun.front()));
  }
  return found;
}

// The mode with one radio as `account` says, and another one (`cleared`; -1: none) as listed again;
// nothing if that is no other mode. Looked for from the path without the ranges of both.
std::optional<RangeMode> RangeMemory::with_fault(const RangeMode& mode, int radio,
                                                 RadioAccount account, int cleared) const {
  const auto r = static_cast<std::size_t>(radio);
  const int at = radio_at(radio);
  RangeMode other = mode;
  other.settled.reset();
  other.estimate.takes_part[r] = false;
  const auto let_go = [&](int wrong) {
    if (other.past) other.past = without_radio(wrong, mode.prior, std::move(*other.past));
  };
  let_go(radio);
  if (cleared >= 0) {
    if (cleared != radio) let_go(cleared);
    set_account(cleared, RadioAccount::as_listed, &other);
    const int place = radio_at(cleared);
    other.estimate.takes_part[static_cast<std::size_t>(cleared)] = cleared != radio;
    other.estimate.constants.segment<RadioOf::count>(place) =
        other.prior.constants.segment<RadioOf::count>(place);
  }
  if (!solved(kIterations, &other)) return std::nullopt;
  set_account(radio, account, &other);
  other.estimate.takes_part[r] = true;
  if (account == RadioAccount::elsewhere) {
    const std::vector<Fix> found = fixes(radio, other);
    if (found.empty()) return std::nullopt;
    other.estimate.constants.segment<2>(at) = found[0].position;
  } else if (account == RadioAccount::biased) {
    other.estimate.constants[at + RadioOf::bias] += excess_of(radio, other);
  }
  if (!solved(kManyIterations, &other)) return std::nullopt;
  const Eigen::VectorXd off = other.estimate.constants - other.prior.constants;
  const double size = account == RadioAccount::elsewhere ? off.segment<2>(at).norm()
                                                         : std::abs(off[at + RadioOf::bias]);
  if (account != RadioAccount::as_listed && size < kLeastFault) return std::nullopt;
  return other;
}

}  // namespace pf_resampling
