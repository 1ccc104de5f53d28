// Which landmark an observation is of, in each particle; and which landmarks there are at all.

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/filters/fastslam/fastslam.hpp"
#include "pf_resampling_core/filters/fastslam/kernels.hpp"
#include "pf_resampling_core/population/pose_statistics.hpp"

namespace pf_resampling {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Share of the sensor's view in which a landmark that is not seen counts as missed: at the rim it
// may be out of it.
constexpr double kSureShare = 0.8;
// How far, in standard deviations, candidates are looked for; and in metres, for what landmarks are
// uncertain.
constexpr double kSearchSigmas = 5.0;
constexpr double kSearchMargin = 2.0;

}  // namespace

void FastSlam::associate(const std::vector<RangeBearingObservation>& observations,
                         const Pose2& sensor) {
  associations_.resize(observations.size());
  for (Association& association : associations_) {
    association.rows.clear();
    association.started_row = -1;
    association.starts.setZero(particles_.size());
  }
  for (const RangeBearingObservation& observation : observations) {
    view_.add(observation.range, observation.bearing);
  }
  if (association_ == DataAssociation::known) {
    for (std::size_t k = 0; k < observations.size(); ++k) associate_known(observations, k);
  } else {
    associate_by_likelihood(observations, sensor);
  }
  for (Association& association : associations_) {
    association.accepted.setZero(particles_.size(),
                                 static_cast<Eigen::Index>(association.rows.size()));
  }
}

void FastSlam::associate_known(const std::vector<RangeBearingObservation>& observations,
                               std::size_t k) {
  Association& association = associations_[k];
  const auto found = row_of_id_.find(observations[k].id);
  if (found != row_of_id_.end()) {
    association.rows.push_back(found->second);
    const LandmarkRow landmark = store_.row(found->second);
    association.takes.resize(particles_.size(), 1);
    for (Eigen::Index i = 0; i < particles_.size(); ++i) {
      association.takes(i, 0) = landmark.held[i];
    }
    // Particles that gave the landmark up start it anew.
    if (!options_.map.frozen) association.starts = 1.0 - association.takes.col(0);
    return;
  }
  // The first of two observations of a new landmark in one scan starts it; the other would know it
  // too late.
  for (std::size_t earlier = 0; earlier < k; ++earlier) {
    if (observations[earlier].id == observations[k].id) return;
  }
  if (!options_.map.frozen) association.starts.setOnes();
}

void FastSlam::associate_by_likelihood(const std::vector<RangeBearingObservation>& observations,
                                       const Pose2& sensor) {
  const Eigen::Index count = particles_.size();
  const PoseStatistics statistics =
      pose_statistics(particles_.weight, particles_.x, particles_.y, particles_.heading);
  const double place_sigma = std::sqrt(statistics.covariance(0, 0) + statistics.covariance(1, 1) +
                                       proposal_.col(0).maxCoeff() + proposal_.col(3).maxCoeff());
  const double heading_sigma = std::sqrt(statistics.covariance(2, 2) + proposal_.col(5).maxCoeff());
  const Pose2 eye = compose(statistics.mean, sensor);

  std::vector<Eigen::ArrayXXd> distances(observations.size());
  std::vector<Eigen::ArrayXXd> likelihoods(observations.size());
  std::int64_t pairs = 0;
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const kernels::Observation z =
        kernels::make_observation(options_.sensor, observations[k], sensor);
    const Eigen::Vector2d place = place_seen(eye, z.range, z.bearing);
    const double sigma = std::sqrt(z.range_variance + z.range * z.range * z.bearing_variance) +
                         place_sigma + z.range * heading_sigma;
    Association& association = associations_[k];
    index_.near(place, kSearchMargin + kSearchSigmas * sigma, &association.rows);
    const Eigen::Index candidates = static_cast<Eigen::Index>(association.rows.size());
    pairs += candidates * count;
    if (pairs > options_.association.max_pairs) {
      throw Error(std::to_string(observations.size()) + " observations without id have more than " +
                  std::to_string(options_.association.max_pairs) +
                  " pairs with the landmarks near them in " + std::to_string(count) +
                  " particles; filter the observations");
    }
    association.takes.setZero(count, candidates);
    distances[k].resize(count, candidates);
    likelihoods[k].resize(count, candidates);
    for (Eigen::Index c = 0; c < candidates; ++c) {
      const LandmarkRow row = store_.row(association.rows[static_cast<std::size_t>(c)]);
      kernels::match(z, count, proposal(), row, distances[k].col(c).data(),
                     likelihoods[k].col(c).data());
      for (Eigen::Index i = 0; i < count; ++i) {
        if (row.held[i] == 0) distances[k](i, c) = kInfinity;
      }
    }
  }
  for (Eigen::Index i = 0; i < count; ++i) choose(i, distances, likelihoods);
  weigh_new_landmarks();
}

// Of new landmarks, anywhere in view, per m and rad.
double FastSlam::log_density_of_new() const {
  constexpr double kNarrowest = 1e-3;  // m, rad: all that was seen yet may be of one place
  const double view = std::max(kNarrowest, view_.range) * 2.0 * std::max(kNarrowest, view_.bearing);
  return std::log(options_.association.new_landmark_share / view);
}

// What matches nothing is as likely as a new landmark is. Particles that have matched it weigh
// more, so a robot that comes back finds its map instead of starting another.
void FastSlam::weigh_new_landmarks() {
  const double log_density = log_density_of_new();
  for (const Association& association : associations_) {
    for (Eigen::Index i = 0; i < particles_.size(); ++i) {
      // There may be no candidates: of an empty array no row is taken.
      const bool is_matched = !association.rows.empty() && (association.takes.row(i) > 0.0).any();
      if (!is_matched) particles_.log_weight[i] += log_density;
    }
  }
}

// One particle's decision: the likeliest pairs first; what is beyond the outer gate of all is new.
void FastSlam::choose(Eigen::Index particle, const std::vector<Eigen::ArrayXXd>& distances,
                      const std::vector<Eigen::ArrayXXd>& likelihoods) {
  const DataAssociationOptions& options = options_.association;
  const bool exclusive = association_ == DataAssociation::mutual_exclusion;
  pairs_.clear();
  for (std::size_t k = 0; k < distances.size(); ++k) {
    for (Eigen::Index c = 0; c < distances[k].cols(); ++c) {
      if (distances[k](particle, c) < options.new_landmark_gate) {
        pairs_.push_back({likelihoods[k](particle, c), static_cast<int>(k), static_cast<int>(c)});
      }
    }
  }
  std::sort(pairs_.begin(), pairs_.end(), [](const CandidatePair& a, const CandidatePair& b) {
    if (a.log_likelihood != b.log_likelihood) return a.log_likelihood > b.log_likelihood;
    return a.observation != b.observation ? a.observation < b.observation
                                          : a.candidate < b.candidate;
  });
  decided_.assign(distances.size(), 0);
  taken_.clear();
  for (const CandidatePair& pair : pairs_) {
    const std::size_t k = static_cast<std::size_t>(pair.observation);
    const int row = associations_[k].rows[static_cast<std::size_t>(pair.candidate)];
    if (decided_[k] != 0) continue;
    if (exclusive && std::find(taken_.begin(), taken_.end(), row) != taken_.end()) continue;
    associations_[k].takes(particle, pair.candidate) = 1.0;
    decided_[k] = 1;
    taken_.push_back(row);
  }
  for (std::size_t k = 0; k < distances.size() && !options_.map.frozen; ++k) {
    if (decided_[k] == 0) associations_[k].starts[particle] = 1.0;
  }
}

void FastSlam::note_outcomes(const std::vector<RangeBearingObservation>& observations) {
  outcomes_.assign(observations.size(), {});
  Eigen::Index heaviest = 0;
  particles_.weight.maxCoeff(&heaviest);
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const Association& association = associations_[k];
    ObservationOutcome& outcome = outcomes_[k];
    for (std::size_t c = 0; c < association.rows.size(); ++c) {
      const auto accepted = association.accepted.col(static_cast<Eigen::Index>(c));
      outcome.accepted += (particles_.weight * accepted).sum();
      if (accepted[heaviest] > 0.0) outcome.landmark = store_.birth(association.rows[c]);
    }
    outcome.accepted += (particles_.weight * association.starts).sum();
    outcome.is_new = association.starts[heaviest] > 0.0;
    if (outcome.is_new && association.started_row >= 0) {
      outcome.landmark = store_.birth(association.started_row);
    }
    if (!association.rows.empty() && !outcome.is_believed()) ++status_.gated;
  }
}

// Log-odds of existence: up for what was seen, down for what should have been; and where the
// landmarks are now.
void FastSlam::update_existence(const std::vector<RangeBearingObservation>& observations,
                                const Pose2& sensor) {
  const DataAssociationOptions& options = options_.association;
  Eigen::Index heaviest = 0;
  particles_.weight.maxCoeff(&heaviest);
  std::vector<int> seen;
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const Association& association = associations_[k];
    for (std::size_t c = 0; c < association.rows.size(); ++c) {
      const int row = association.rows[c];
      const LandmarkRow landmark = store_.row(row);
      const auto accepted = association.accepted.col(static_cast<Eigen::Index>(c));
      if (association_ == DataAssociation::known) doubt(k, observations[k], sensor);
      if (!(accepted > 0.0).any()) continue;
      for (Eigen::Index i = 0; i < particles_.size(); ++i) {
        landmark.log_odds[i] = std::min(options.largest_log_odds,
                                        landmark.log_odds[i] + options.seen_log_odds * accepted[i]);
      }
      seen.push_back(row);
    }
    if (association.started_row >= 0) seen.push_back(association.started_row);
  }
  for (const int row : seen) index_.place(row, representative(row, heaviest));
  if (options.missed_log_odds == 0.0) return;
  // An id that was read twice is there, even if it is hidden most of the time.
  const double most_missed = association_ == DataAssociation::known
                                 ? options.seen_log_odds
                                 : std::numeric_limits<double>::infinity();

  const double range =
      kSureShare *
      (options_.sensor.maximum_range > 0.0 ? options_.sensor.maximum_range : view_.range);
  const double bearing =
      kSureShare *
      (options_.sensor.field_of_view > 0.0 ? 0.5 * options_.sensor.field_of_view : view_.bearing);
  const Pose2 eye = compose(particles_.pose(heaviest), sensor);
  std::vector<int> near;
  index_.near({eye.x, eye.y}, range, &near);
  // The sensor of each particle, and where it looks: in view is what is within the angle of that.
  const Eigen::Index count = particles_.size();
  Eigen::ArrayXd eye_x(count), eye_y(count), look_x(count), look_y(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Pose2 at = compose(particles_.pose(i), sensor);
    eye_x[i] = at.x;
    eye_y[i] = at.y;
    look_x[i] = std::cos(at.heading);
    look_y[i] = std::sin(at.heading);
  }
  const double least_cosine = std::cos(std::min(bearing, kPi));
  for (const int row : near) {
    if (std::find(seen.begin(), seen.end(), row) != seen.end()) continue;
    const LandmarkRow landmark = store_.row(row);
    double held = 0.0;
    for (Eigen::Index i = 0; i < particles_.size(); ++i) {
      if (landmark.held[i] == 0) continue;
      const double dx = landmark.x[i] - eye_x[i];
      const double dy = landmark.y[i] - eye_y[i];
      const double distance = std::sqrt(dx * dx + dy * dy);
      const bool in_view =
          distance < range && dx * look_x[i] + dy * look_y[i] > least_cosine * distance;
      const bool is_missed = in_view && landmark.log_odds[i] <= most_missed;
      if (is_missed) landmark.log_odds[i] -= options.missed_log_odds;
      if (landmark.log_odds[i] < options.removal_log_odds) landmark.held[i] = 0;
      held += landmark.held[i] != 0 ? particles_.weight[i] : 0.0;
    }
    if (!(held > 0.0)) {
      forget(store_.birth(row));
      remove_landmark(row);
    }
  }
}

// The id was read where its landmark cannot be. If most of the scan is not where it should be, the
// robot is lost, and if another landmark is there, its id was misread. If neither, it was perhaps
// misread when it was first seen: if that goes on, the landmark is given up, to be started anew
// where the id is seen next.
void FastSlam::doubt(std::size_t observation, const RangeBearingObservation& seen,
                     const Pose2& sensor) {
  const DataAssociationOptions& options = options_.association;
  const Association& association = associations_[observation];
  const Eigen::ArrayXd contradicted =
      association.takes.col(0) * (1.0 - association.accepted.col(0));
  if (!(contradicted > 0.0).any()) return;
  const auto fit = std::count_if(
      outcomes_.begin(), outcomes_.end(),
      [](const ObservationOutcome& other) { return other.accepted > 0.5 && !other.is_new; });
  if (2 * fit < static_cast<std::ptrdiff_t>(outcomes_.size())) return;
  const int row = association.rows.front();
  Eigen::Index heaviest = 0;
  (particles_.weight * contradicted).maxCoeff(&heaviest);
  const Pose2 eye = compose(particles_.pose(heaviest), sensor);
  const kernels::Observation z = kernels::make_observation(options_.sensor, seen, sensor);
  const double sigma = std::sqrt(z.range_variance + z.range * z.range * z.bearing_variance);
  std::vector<int> near;
  index_.near(place_seen(eye, z.range, z.bearing), std::sqrt(options.gate) * sigma, &near);
  if (near.size() > 1 || (near.size() == 1 && near.front() != row)) return;
  const LandmarkRow landmark = store_.row(row);
  for (Eigen::Index i = 0; i < particles_.size(); ++i) {
    if (contradicted[i] == 0.0) continue;
    landmark.log_odds[i] -= options.seen_log_odds;
    if (landmark.log_odds[i] < options.removal_log_odds) landmark.held[i] = 0;
  }
}

// Where the heaviest particle that holds a landmark has it.
Eigen::Vector2d FastSlam::representative(int row, Eigen::Index heaviest) {
  const LandmarkRow landmark = store_.row(row);
  Eigen::Index holder = heaviest;
  if (landmark.held[heaviest] == 0) {
    double most = -1.0;
    for (Eigen::Index i = 0; i < particles_.size(); ++i) {
      if (landmark.held[i] != 0 && particles_.weight[i] > most) {
        most = particles_.weight[i];
        holder = i;
      }
    }
  }
  return landmark.mean(holder);
}

}  // namespace pf_resampling
