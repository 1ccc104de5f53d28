// How a RangeMemory is saved.
#include "pf_resampling_core/range_memory/saved_range_memory.hpp"

#include <algorithm>
#include <string>
#include <vector>

namespace pf_resampling {
namespace {

// Many, so each is a row of numbers.
using Row = std::vector<double*>;

void append_numbers(OdometryIncrement* motion, Row* row) {
  row->insert(row->end(),
              {&motion->duration, &motion->mean.x, &motion->mean.y, &motion->mean.heading});
  for (int i = 0; i < 9; ++i) row->push_back(motion->covariance.data() + i);
  for (int i = 0; i < 9; ++i) row->push_back(motion->slip_covariance.data() + i);
  for (int i = 0; i < 3; ++i) row->push_back(motion->yaw_rate_sensitivity.data() + i);
  for (int i = 0; i < 3; ++i) row->push_back(motion->turn_scale_sensitivity.data() + i);
}

Row numbers_of(OdometryIncrement* motion) {
  Row row;
  append_numbers(motion, &row);
  return row;
}

Row numbers_of(HeldRange* range) {
  Row row = {&range->range, &range->variance, &range->antenna.x(), &range->antenna.y(),
             &range->height};
  append_numbers(&range->since, &row);
  return row;
}

template <typename Element>
void describe_rows(Archive& archive, const char* name, std::vector<Element>* list) {
  Element sample;
  const auto columns = static_cast<Eigen::Index>(numbers_of(&sample).size());
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(list->size()), columns);
  const auto for_each = [&](const auto& visit) {
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
      const Row numbers = numbers_of(&(*list)[static_cast<std::size_t>(i)]);
      for (Eigen::Index j = 0; j < columns; ++j) {
        visit(rows(i, j), *numbers[static_cast<std::size_t>(j)]);
      }
    }
  };
  for_each([](double& saved, double& number) { saved = number; });
  archive(name, rows);
  if (!archive.is_reading()) return;
  if (rows.rows() > 0 && rows.cols() != columns) {
    archive.refuse("the rows of " + std::string(name) + " have to have " + std::to_string(columns) +
                   " numbers");
  }
  list->resize(static_cast<std::size_t>(rows.rows()));
  for_each([](double& saved, double& number) { number = saved; });
}

void describe_graph(Archive& archive, RangeGraph* graph) {
  std::vector<HeldRange> ranges;
  std::vector<int> keyframes, radios;
  for (std::size_t k = 0; k < graph->ranges.size(); ++k) {
    for (const HeldRange& range : graph->ranges[k]) {
      ranges.push_back(range);
      radios.push_back(range.radio);
      keyframes.push_back(static_cast<int>(k));
    }
  }
  describe_rows(archive, "motions", &graph->motions);
  describe_rows(archive, "ranges", &ranges);
  archive("range_radios", radios);
  archive("range_keyframes", keyframes);
  if (!archive.is_reading()) return;
  graph->ranges.assign(graph->motions.size() + 1, {});
  if (radios.size() != ranges.size() || keyframes.size() != ranges.size()) {
    archive.refuse("the memory needs a radio and a keyframe for every range");
  }
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    if (keyframes[i] < 0 || keyframes[i] >= graph->keyframes()) {
      archive.refuse("a range of the memory is of a keyframe that is not there");
    }
    ranges[i].radio = radios[i];
    graph->ranges[static_cast<std::size_t>(keyframes[i])].push_back(ranges[i]);
  }
}

void describe_motion(Archive& archive, const char* name, OdometryIncrement* motion) {
  std::vector<OdometryIncrement> one = {*motion};
  describe_rows(archive, name, &one);
  if (one.size() != 1) archive.refuse(std::string(name) + " has to be one motion");
  *motion = one.front();
}

bool is_of(const RangeEstimate& estimate, std::size_t radios) {
  return estimate.constants.size() == radio_at(static_cast<int>(radios)) &&
         estimate.takes_part.size() == radios && !estimate.keyframes.empty();
}

bool is_mode(const RangeMode& mode, std::size_t radios, std::size_t keyframes) {
  const Eigen::Index constants = radio_at(static_cast<int>(radios));
  const Eigen::Index size = KeyframeUnknown::count + constants;
  const RangePrior& prior = mode.prior;
  const bool has_belief = !mode.belief.is_usable || (mode.belief.covariance.rows() == size &&
                                                     mode.belief.covariance.cols() == size);
  const auto is_past = [&](const RangePast& past) {
    return past.keyframe >= 0 && static_cast<std::size_t>(past.keyframe) < keyframes &&
           past.constants.size() == constants && past.information.rows() == size &&
           past.information.cols() == size && past.gradient.size() == size;
  };
  return mode.accounts.size() == radios && is_of(mode.estimate, radios) &&
         mode.estimate.keyframes.size() == keyframes && prior.constants.size() == constants &&
         prior.constants_sigma.size() == constants && (prior.constants_sigma.array() > 0.0).all() &&
         (prior.first_sigma.array() > 0.0).all() && has_belief &&
         (!mode.past || (is_past(*mode.past) && mode.past->keyframe == 0)) &&
         (!mode.settled || is_past(*mode.settled));
}

}  // namespace

void describe(Archive& archive, RadioPlace& place) {
  archive("position", place.position);
  archive("covariance", place.covariance);
  archive("probability", place.probability);
}

void describe(Archive& archive, RangePrior& prior) {
  archive("first", prior.first);
  archive("first_sigma", prior.first_sigma);
  archive("constants", prior.constants);
  archive("constants_sigma", prior.constants_sigma);
  archive("yaw_rate_walk", prior.yaw_rate_walk);
}

void describe(Archive& archive, RangeEstimate& estimate) {
  archive("keyframes", estimate.keyframes);
  archive("constants", estimate.constants);
  archive("takes_part", estimate.takes_part);
}

void describe(Archive& archive, RangeBelief& belief) {
  if (!archive.something(belief.is_usable)) {
    belief = RangeBelief{};
    return;
  }
  belief.is_usable = true;
  archive("cost", belief.cost);
  archive("log_evidence", belief.log_evidence);
  archive("covariance", belief.covariance);
}

void describe(Archive& archive, RangePast& past) {
  archive("keyframe", past.keyframe);
  archive("state", past.state);
  archive("constants", past.constants);
  archive("information", past.information);
  archive("gradient", past.gradient);
  archive("log_evidence", past.log_evidence);
}

void describe(Archive& archive, RangeMode& mode) {
  std::vector<int> accounts;
  for (const RadioAccount account : mode.accounts) accounts.push_back(static_cast<int>(account));
  archive("accounts", accounts);
  archive("loose", mode.loose);
  archive("prior", mode.prior);
  archive("estimate", mode.estimate);
  archive("belief", mode.belief);
  archive("past", mode.past);
  archive("settled", mode.settled);
  archive("probability", mode.probability);
  if (!archive.is_reading()) return;
  mode.accounts.clear();
  for (const int account : accounts) {
    if (account < 0 || account > static_cast<int>(RadioAccount::unlisted)) {
      archive.refuse("what it says of a radio is none of what there is");
    }
    mode.accounts.push_back(static_cast<RadioAccount>(account));
  }
}

void describe(Archive& archive, RangeMemory& memory) {
  std::vector<int> ids, counts;
  std::vector<std::vector<RadioPlace>> other_places;
  for (const RangeMemory::Radio& radio : memory.radios_) {
    ids.push_back(radio.id);
    counts.push_back(radio.ranges);
    other_places.push_back(radio.other_places);
  }
  archive("first", memory.first_);
  archive("radios", ids);
  archive("counts", counts);
  archive("other_places", other_places);
  describe_graph(archive, &memory.graph_);
  archive("times", memory.times_);
  describe_motion(archive, "pending", &memory.pending_);
  archive("time", memory.time_);
  archive("lever_is_stated", memory.lever_is_stated_);
  archive("range_noise", memory.noise_.range);
  archive("translation_noise", memory.noise_.translation);
  archive("heading_noise", memory.noise_.heading);
  archive("robust_width", memory.noise_.robust_width);
  archive("modes", memory.modes_);
  archive("before", memory.before_);
  archive("next_solution_of_all", memory.next_solution_of_all_);
  archive("doubt", memory.doubt_);
  archive("has_turned", memory.has_turned_);
  archive("next_trial", memory.next_trial_);
  archive("trial_steps", memory.trial_steps_);
  if (!archive.is_reading()) return;
  if (counts.size() != ids.size() || other_places.size() != ids.size()) {
    archive.refuse("the memory needs a count of ranges and a list of places for every radio");
  }
  memory.radios_.resize(ids.size());
  for (std::size_t r = 0; r < ids.size(); ++r) {
    memory.radios_[r].id = ids[r];
    memory.radios_[r].ranges = counts[r];
    memory.radios_[r].other_places = other_places[r];
  }
}

std::string fault_of(const RangeMemory& memory) {
  const std::size_t radios = memory.radios_.size();
  const std::size_t keyframes = memory.times_.size();
  for (const auto& ranges : memory.graph_.ranges) {
    for (const HeldRange& range : ranges) {
      if (range.radio < 0 || static_cast<std::size_t>(range.radio) >= radios ||
          !(range.variance > 0.0)) {
        return "a range of the memory is of no radio, or has no variance";
      }
    }
  }
  const bool are_modes =
      std::all_of(memory.modes_.begin(), memory.modes_.end(),
                  [&](const RangeMode& mode) { return is_mode(mode, radios, keyframes); });
  const bool is_before = !memory.before_ || (is_of(*memory.before_, radios) &&
                                             memory.before_->keyframes.size() <= keyframes);
  if (memory.graph_.ranges.size() != keyframes || !are_modes || !is_before) {
    return "the memory is inconsistent: its solutions are not of its keyframes and radios";
  }
  const RangeNoise& noise = memory.noise_;
  if (!(noise.range > 0.0) || !(noise.translation > 0.0) || !(noise.heading > 0.0) ||
      !(noise.robust_width > 1.0) || !(memory.doubt_ >= 1.0) || memory.next_trial_ < 0) {
    return "the memory has a factor of noise that is out of range";
  }
  return {};
}

bool RangeMemory::resume(const RangeMemory& saved) {
  for (const RangeMode& mode : saved.modes_) {
    for (std::size_t r = 0; r < saved.radios_.size(); ++r) {
      const bool was_listed = mode.accounts[r] != RadioAccount::unlisted;
      if (was_listed != (listed(saved.radios_[r].id) != nullptr)) return false;
    }
  }
  RangeMemory anew = saved;
  anew.options_ = options_;
  anew.beacons_ = beacons_;
  anew.calibration_ = calibration_;
  for (Radio& radio : anew.radios_) {
    radio.listed.reset();
    if (const Beacon* beacon = listed(radio.id)) radio.listed = *beacon;
    radio.calibration = calibration_of(radio.id);
  }
  *this = std::move(anew);
  return true;
}

}  // namespace pf_resampling
