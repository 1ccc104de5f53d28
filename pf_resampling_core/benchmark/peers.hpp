#pragma once

#include <cstddef>
#include <memory>
#include <vector>

/// Other libraries behind plain functions, so that their headers stay in files of their own.

/// MRPT: log-weights to ancestor indices.
enum class MrptScheme { multinomial, residual, stratified, systematic };
void mrpt_resample(MrptScheme scheme, const std::vector<double>& log_weights,
                   std::vector<std::size_t>* ancestors);

/// MRPT's CMonteCarloLocalization2D with a CBeaconMap: one step of motion, ranges to all beacons
/// and systematic resampling.
struct BeaconPosition {
  double x;
  double y;
};
class MrptBeaconMcl {
 public:
  MrptBeaconMcl(int particles, const std::vector<BeaconPosition>& beacons, double sigma);
  ~MrptBeaconMcl();
  /// Motion in the robot's frame with its standard deviations; ranges in the order of the beacons.
  void step(double dx, double dheading, double sigma_position, double sigma_heading,
            const std::vector<double>& ranges);
  double mean_x() const;
  double mean_y() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};
