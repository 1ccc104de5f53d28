#pragma once

#include <cstdint>

#include "pf_resampling_core/filters/fastslam/landmark_store.hpp"
#include "pf_resampling_core/filters/fastslam/options.hpp"
#include "pf_resampling_core/models/landmark_observation.hpp"
#include "pf_resampling_core/models/odometry_motion.hpp"
#include "pf_resampling_core/population/weights.hpp"

/// The loops over particles of fastslam.cpp: the extended Kalman filters of pose and landmarks, in
/// Kalman gain form (the pose covariance has rank 2 after one control step, so it is never
/// inverted).
namespace pf_resampling::kernels {

/// m^2, rad^2: a tenth of a millimetre, of a milliradian. Nothing is better known than that, and
/// narrower Gaussians would be lost in rounding.
inline constexpr double kSmallestVariance = 1e-8;

/// Gaussian over the pose of each particle: its proposal distribution.
struct PoseGaussians {
  double *x, *y, *heading;
  double *xx, *xy, *xh, *yy, *yh, *hh;
};

/// One observation, the noise of the sensor, and where that sits on the robot.
struct Observation {
  double range, bearing;                    // m, rad
  double range_variance, bearing_variance;  // m^2, rad^2
  double sensor_x, sensor_y, sensor_yaw;    // m, m, rad
};

/// The observation with the model's noise where it has none of its own.
Observation make_observation(const LandmarkSensorOptions& model, const RangeBearingObservation& z,
                             const Pose2& sensor);

/// Moves every particle by its row of `motion` (x, y, heading in its body frame) and starts its
/// proposal with the motion's covariance.
void predict(const Eigen::ArrayXXd& motion, const Eigen::Matrix3d& covariance, std::int64_t count,
             const PoseGaussians& pose);

/// Squared Mahalanobis distance and log likelihood of the observation in each particle.
void match(const Observation& observation, std::int64_t count, const PoseGaussians& pose,
           const LandmarkRow& landmark, double* distance, double* log_likelihood);

/// Squared Mahalanobis distance of the observation in what the whole population predicts: the mean
/// and the covariance of the mixture of its Gaussians, of the particles that hold the landmark.
/// Two is expected of a population that is as sure as it may be. `weights`: of the particles; not
/// all of those that hold the landmark may be zero.
double squared_innovation(const Observation& observation, ConstArray weights,
                          const PoseGaussians& pose, const LandmarkRow& landmark);

/// Takes the observation of a landmark into the proposal, where `takes` is 1 and the observation is
/// within the gate; weighs the particle (beyond the gate as if at it); accepted: 1 where it was
/// taken in.
void propose(const Observation& observation, double gate, std::int64_t count,
             const PoseGaussians& pose, const LandmarkRow& landmark, const double* takes,
             double* log_weight, double* accepted);

/// Draws the pose from the proposal, with normals z0 … z2; the proposal's mean becomes the draw.
void draw(std::int64_t count, const double* z0, const double* z1, const double* z2,
          const PoseGaussians& pose);

/// The motion from a former pose (x, y, heading) to the present one, in the body frame of the
/// former, which it replaces.
void motion_since(std::int64_t count, const PoseGaussians& pose, double* x, double* y,
                  double* heading);

/// Updates the landmark with the observation from the drawn pose (Joseph form), where accepted
/// is 1.
void update(const Observation& observation, std::int64_t count, const PoseGaussians& pose,
            const double* accepted, const LandmarkRow& landmark);

/// Starts the landmark from the drawn pose, where `starts` is 1.
void start(const Observation& observation, std::int64_t count, const PoseGaussians& pose,
           const double* starts, double log_odds, const LandmarkRow& landmark);

}  // namespace pf_resampling::kernels
