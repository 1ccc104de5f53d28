#pragma once

#include <Eigen/Core>

#include "pf_resampling_core/parameters/parameters.hpp"
#include "pf_resampling_core/population/random_stream.hpp"
#include "pf_resampling_core/population/weights.hpp"

namespace pf_resampling {

/// Gaussian perturbation of every particle after a renewal (Mahmoud section III: "adding a Gaussian
/// perturbation around each particle position"), against impoverishment. To add one: a line here,
/// and in excitation.cpp a function and a line in the table.
enum class Excitation {
  none,
  gaussian,     ///< fixed standard deviations
  regularized,  ///< Silverman's bandwidth from the weighted covariance, scaled
  roughening,   ///< Gordon, Salmond, Smith 1993: sigma = K * range * N^(-1/d) per coordinate
};
const EnumNames<Excitation>& names_of(Excitation);
/// Throws Error that lists the known names when `name` is none of them.

struct ExcitationOptions {
  Excitation method = Excitation::regularized;
  double sigma_position = 0.05;    ///< gaussian: per axis, m, >= 0
  double sigma_heading = 0.01;     ///< gaussian: rad, >= 0
  double bandwidth_scale = 0.5;    ///< regularized: multiple of Silverman's bandwidth, in [0, 2]
  double roughening_scale = 0.05;  ///< roughening: the K of Gordon et al., in [0, 1]; they use 0.2
};

/// The parameters excitation/..., bound to `options`, which must outlive the list.
void add_parameters(ExcitationOptions* options, ParameterList* parameters);

/// Poses of all particles, structure of arrays, same sizes; heading in radians.
struct PoseArrays {
  MutableArray x;
  MutableArray y;
  MutableArray heading;
};

/// Working space, so that nothing is allocated after the first call with the largest population.
struct ExcitationWorkspace {
  Eigen::ArrayXd normals;
};

/// Perturbs the poses. `linear_weights`: normalised weights of these particles, for the covariance
/// of `regularized` (taken after selection). Three normals per particle, number 4i, 4i + 1 and
/// 4i + 2 of the stream. Headings stay within [-pi, pi]. Circular statistics for the heading: its
/// spread is that of the angle to the weighted mean direction.
void excite(const ExcitationOptions& options, ConstArray linear_weights, const RandomStream& stream,
            PoseArrays poses, ExcitationWorkspace* workspace);

}  // namespace pf_resampling
