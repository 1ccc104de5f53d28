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

// pose_i <- pose_i + root * z_i, root lower triangular.
PF_RESAMPLING_VECTOR_CLONES
void perturb(const double root[6], std::int64_t count, const double* z0, const double* z1,
             const double* z2, double* x, double* y, double* heading) {
  for (std::int64_t i = 0; i < count; ++i) {
    x[i] += root[0] * z0[i];
    y[i] += root[1] * z0[i] + root[2] * z1[i];
    heading[i] =
        wrap_angle_vector(heading[i] + (root[3] * z0[i] + root[4] * z1[i] + root[5] * z2[i]));
  }
}

Eigen::Matrix3d diagonal(double x, double y, double heading) {
  return Eigen::Vector3d(x, y, heading).asDiagonal();
}

Eigen::Matrix3d fixed_deviations(const ExcitationOptions& options, ConstArray, const PoseArrays&) {
  return diagonal(options.sigma_position, options.sigma_position, options.sigma_heading);
}

// Silverman (1986, section 4.3.2): the bandwidth that is best for a Gaussian, here scaled down
// since a population may have several modes.
Eigen::Matrix3d regularization(const ExcitationOptions& options, ConstArray weights,
                               const PoseArrays& poses) {
  const PoseStatistics statistics = pose_statistics(weights, poses.x, poses.y, poses.heading);
  const double exponent = 1.0 / (kDimensions + 4.0);
  const double silverman = std::pow(4.0 / (kDimensions + 2.0), exponent) *
                           std::pow(statistics.effective_sample_size, -exponent);
  const double bandwidth = std::min(1.0, options.bandwidth_scale * silverman);
  return bandwidth * lower_root(statistics.covariance);
}

// Gordon, Salmond, Smith (1993): per coordinate, in proportion to its range over the population.
// That of the headings is taken about the first one, so that a cloud astride of pi does not pass
// for a full circle.
Eigen::Matrix3d roughening(const ExcitationOptions& options, ConstArray, const PoseArrays& poses) {
  double lowest = 0.0;
  double highest = 0.0;
  for (Eigen::Index i = 0; i < poses.heading.size(); ++i) {
    const double offset = wrap_angle(poses.heading[i] - poses.heading[0]);
    lowest = std::min(lowest, offset);
    highest = std::max(highest, offset);
  }
  const double scale =
      options.roughening_scale * std::pow(static_cast<double>(poses.x.size()), -1.0 / kDimensions);
  return diagonal(scale * (poses.x.maxCoeff() - poses.x.minCoeff()),
                  scale * (poses.y.maxCoeff() - poses.y.minCoeff()), scale * (highest - lowest));
}

// The one table of excitations: their names, parameters and tests come from it.
struct ExcitationRow {
  Excitation excitation;
  const char* name;  // as users write it
  // Lower triangular root of the covariance of what is added; null: nothing is.
  Eigen::Matrix3d (*root)(const ExcitationOptions& options, ConstArray weights,
                          const PoseArrays& poses);
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
                                  "Noise added to the particles after a renewal."));
  list.push_back(real_parameter("excitation/sigma_position", &options->sigma_position, 0.0, 100.0,
                                "m", "gaussian: standard deviation of the position, per axis."));
  list.push_back(real_parameter("excitation/sigma_heading", &options->sigma_heading, 0.0, 3.2,
                                "rad", "gaussian: standard deviation of the heading."));
  list.push_back(real_parameter("excitation/bandwidth_scale", &options->bandwidth_scale, 0.0, 2.0,
                                "", "regularized: bandwidth, as a multiple of Silverman's."));
  list.push_back(real_parameter("excitation/roughening_scale", &options->roughening_scale, 0.0, 1.0,
                                "", "roughening: the factor K of Gordon (1993)."));
}

void excite(const ExcitationOptions& options, ConstArray linear_weights, const RandomStream& stream,
            PoseArrays poses, ExcitationWorkspace* workspace) {
  const Eigen::Index count = poses.x.size();
  const ExcitationRow& excitation = row_of(options.method);
  if (excitation.root == nullptr || count == 0) return;
  const Eigen::Matrix3d l = excitation.root(options, linear_weights, poses);

  workspace->normals.resize(4 * count);
  double* z = workspace->normals.data();
  stream.fill_normal4(0, count, z, z + count, z + 2 * count, z + 3 * count);

  const double root[6] = {l(0, 0), l(1, 0), l(1, 1), l(2, 0), l(2, 1), l(2, 2)};
  perturb(root, count, z, z + count, z + 2 * count, poses.x.data(), poses.y.data(),
          poses.heading.data());
}

}  // namespace pf_resampling
