#include "pf_resampling_core/strategy/excitation.hpp"

#include <algorithm>
#include <cmath>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/geometry.hpp"
#include "pf_resampling_core/population/matrix_root.hpp"
#include "pf_resampling_core/population/pose_statistics.hpp"
#include "pf_resampling_core/population/vector_math.hpp"

namespace pf_resampling {
namespace {

constexpr double kDimensions = 3.0;

// pose_i <- pose_i + pull * (centre - pose_i) + root * z_i.
struct Perturbation {
  Eigen::Matrix3d root = Eigen::Matrix3d::Zero();  // lower triangular
  double pull = 0.0;
  Pose2 centre;
};

PF_RESAMPLING_VECTOR_CLONES
void perturb(const double root[6], double pull, const Pose2& centre, std::int64_t count,
             const double* z0, const double* z1, const double* z2, const double* moves, double* x,
             double* y, double* heading) {
  for (std::int64_t i = 0; i < count; ++i) {
    const double noise_x = root[0] * z0[i];
    const double noise_y = root[1] * z0[i] + root[2] * z1[i];
    const double noise_heading = root[3] * z0[i] + root[4] * z1[i] + root[5] * z2[i];
    const double to_centre = wrap_angle_vector(centre.heading - heading[i]);
    x[i] += moves[i] * (noise_x + pull * (centre.x - x[i]));
    y[i] += moves[i] * (noise_y + pull * (centre.y - y[i]));
    heading[i] = wrap_angle_vector(heading[i] + moves[i] * (noise_heading + pull * to_centre));
  }
}

Perturbation fixed_deviations(const ExcitationOptions& options, ConstArray, const PoseArrays&) {
  Perturbation perturbation;
  perturbation.root.diagonal() << options.sigma_position, options.sigma_position,
      options.sigma_heading;
  return perturbation;
}

// Silverman (1986, section 4.3.2): the bandwidth that is best for a Gaussian, here scaled down
// since a population may have several modes; West (1993) for the pull towards the mean.
Perturbation regularization(const ExcitationOptions& options, ConstArray weights,
                            const PoseArrays& poses) {
  const PoseStatistics statistics = pose_statistics(weights, poses.x, poses.y, poses.heading);
  const double exponent = 1.0 / (kDimensions + 4.0);
  const double silverman = std::pow(4.0 / (kDimensions + 2.0), exponent) *
                           std::pow(statistics.effective_sample_size, -exponent);
  const double bandwidth = std::min(1.0, options.bandwidth_scale * silverman);
  Perturbation perturbation;
  perturbation.root = bandwidth * lower_root(statistics.covariance);
  perturbation.pull = options.keep_variance ? 1.0 - std::sqrt(1.0 - bandwidth * bandwidth) : 0.0;
  perturbation.centre = statistics.mean;
  return perturbation;
}

// Gordon, Salmond, Smith (1993): per coordinate, in proportion to its range over the population.
// That of the headings is taken about the first one, so that a cloud astride of pi does not pass
// for a full circle.
Perturbation roughening(const ExcitationOptions& options, ConstArray, const PoseArrays& poses) {
  double lowest = 0.0;
  double highest = 0.0;
  for (Eigen::Index i = 0; i < poses.heading.size(); ++i) {
    const double offset = wrap_angle(poses.heading[i] - poses.heading[0]);
    lowest = std::min(lowest, offset);
    highest = std::max(highest, offset);
  }
  const double scale =
      options.roughening_scale * std::pow(static_cast<double>(poses.x.size()), -1.0 / kDimensions);
  Perturbation perturbation;
  perturbation.root.diagonal() << scale * (poses.x.maxCoeff() - poses.x.minCoeff()),
      scale * (poses.y.maxCoeff() - poses.y.minCoeff()), scale * (highest - lowest);
  return perturbation;
}

// The first copy of an ancestor is the one in the ancestor's own slot; where the population has
// shrunk so that it has none, the first slot that names it.
void hold_first_copies(ConstIndices ancestors, ExcitationWorkspace* workspace) {
  const int count = static_cast<int>(ancestors.size());
  workspace->is_held.assign(static_cast<std::size_t>(ancestors.maxCoeff()) + 1, 0);
  for (int i = 0; i < count; ++i) {
    const int ancestor = ancestors[i];
    std::uint8_t& is_held = workspace->is_held[static_cast<std::size_t>(ancestor)];
    const bool is_first = ancestor == i || (ancestor >= count && is_held == 0);
    if (!is_first) continue;
    is_held = 1;
    workspace->moves[i] = 0.0;
  }
}

// The one table of excitations: their names, parameters and tests come from it.
struct ExcitationRow {
  Excitation excitation;
  const char* name;  // as users write it
  Perturbation (*perturbation)(const ExcitationOptions& options, ConstArray weights,
                               const PoseArrays& poses);  // null: none
};
constexpr ExcitationRow kExcitations[] = {
    {Excitation::none, "none", nullptr},
    {Excitation::gaussian, "gaussian", fixed_deviations},
    {Excitation::regularized, "regularized", regularization},
    {Excitation::roughening, "roughening", roughening},
};

const ExcitationRow& row_of(Excitation excitation) {
  for (const ExcitationRow& row : kExcitations) {
    if (row.excitation == excitation) return row;
  }
  throw Error("excitation " + std::to_string(static_cast<int>(excitation)) + " is unknown");
}

}  // namespace

const EnumNames<Excitation>& names_of(Excitation) {
  static const EnumNames<Excitation> names = [] {
    std::vector<std::pair<Excitation, std::string>> list;
    for (const ExcitationRow& row : kExcitations) list.emplace_back(row.excitation, row.name);
    return EnumNames<Excitation>("excitation", list);
  }();
  return names;
}

void add_parameters(ExcitationOptions* options, ParameterList* parameters) {
  ParameterList& list = *parameters;
  list.push_back(choice_parameter("excitation/method", &options->method,
                                  "Noise that is added to the particles after a renewal."));
  list.push_back(real_parameter("excitation/sigma_position", &options->sigma_position, 0.0, 100.0,
                                "m", "gaussian: standard deviation of the position, per axis."));
  list.push_back(real_parameter("excitation/sigma_heading", &options->sigma_heading, 0.0, 3.2,
                                "rad", "gaussian: standard deviation of the heading."));
  list.push_back(real_parameter("excitation/bandwidth_scale", &options->bandwidth_scale, 0.0, 2.0,
                                "", "regularized: bandwidth, as a multiple of Silverman's."));
  list.push_back(boolean_parameter("excitation/keep_variance", &options->keep_variance,
                                   "regularized: pull the particles towards their mean, so that "
                                   "the noise does not increase their variance."));
  list.push_back(real_parameter("excitation/roughening_scale", &options->roughening_scale, 0.0, 1.0,
                                "", "roughening: the factor K of Gordon (1993)."));
  list.push_back(boolean_parameter("excitation/duplicates_only", &options->duplicates_only,
                                   "Leave the first copy of each particle where it is."));
}

void excite(const ExcitationOptions& options, ConstArray linear_weights, ConstIndices ancestors,
            const RandomStream& stream, PoseArrays poses, ExcitationWorkspace* workspace) {
  const Eigen::Index count = poses.x.size();
  const ExcitationRow& excitation = row_of(options.method);
  if (excitation.perturbation == nullptr || count == 0) return;
  const Perturbation perturbation = excitation.perturbation(options, linear_weights, poses);

  workspace->normals.resize(4 * count);
  double* z = workspace->normals.data();
  stream.fill_normal4(0, count, z, z + count, z + 2 * count, z + 3 * count);

  workspace->moves.setOnes(count);
  if (options.duplicates_only) hold_first_copies(ancestors, workspace);
  const Eigen::Matrix3d& l = perturbation.root;
  const double root[6] = {l(0, 0), l(1, 0), l(1, 1), l(2, 0), l(2, 1), l(2, 2)};
  perturb(root, perturbation.pull, perturbation.centre, count, z, z + count, z + 2 * count,
          workspace->moves.data(), poses.x.data(), poses.y.data(), poses.heading.data());
}

}  // namespace pf_resampling
