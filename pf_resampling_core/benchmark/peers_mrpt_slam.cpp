#include <mrpt/bayes/CParticleFilter.h>
#include <mrpt/maps/CBeaconMap.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservationBeaconRanges.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/slam/CMonteCarloLocalization2D.h>

#include "pf_resampling_core/benchmark/peers.hpp"

struct MrptBeaconMcl::Implementation {
  explicit Implementation(int size) : particles(static_cast<std::size_t>(size)) {}

  mrpt::slam::CMonteCarloLocalization2D particles;
  mrpt::bayes::CParticleFilter filter;
  double sigma = 0.0;
};

MrptBeaconMcl::MrptBeaconMcl(int particles, const std::vector<BeaconPosition>& beacons,
                             double sigma)
    : implementation_(new Implementation(particles)) {
  auto map = mrpt::maps::CBeaconMap::Create();
  for (std::size_t i = 0; i < beacons.size(); ++i) {
    mrpt::maps::CBeacon beacon;
    beacon.m_typePDF = mrpt::maps::CBeacon::pdfGauss;
    beacon.m_ID = static_cast<mrpt::maps::CBeacon::TBeaconID>(i);
    beacon.m_locationGauss.mean = mrpt::poses::CPoint3D(beacons[i].x, beacons[i].y, 0.0);
    beacon.m_locationGauss.cov.setDiagonal(1e-6);
    map->push_back(beacon);
  }
  map->likelihoodOptions.rangeStd = static_cast<float>(sigma);
  auto& pdf = implementation_->particles;
  pdf.resetDeterministic(mrpt::math::TPose2D(0.0, 0.0, 0.0), static_cast<std::size_t>(particles));
  pdf.options.metricMap = map;
  implementation_->sigma = sigma;
  auto& options = implementation_->filter.m_options;
  options.PF_algorithm = mrpt::bayes::CParticleFilter::pfStandardProposal;
  options.resamplingMethod = mrpt::bayes::CParticleFilter::prSystematic;
  options.adaptiveSampleSize = false;
  options.BETA = 1.1;  // always
}

MrptBeaconMcl::~MrptBeaconMcl() = default;

void MrptBeaconMcl::step(double dx, double dheading, double sigma_position, double sigma_heading,
                         const std::vector<double>& ranges) {
  mrpt::obs::CActionRobotMovement2D movement;
  mrpt::obs::CActionRobotMovement2D::TMotionModelOptions model;
  model.modelSelection = mrpt::obs::CActionRobotMovement2D::mmGaussian;
  model.gaussianModel.a1 = model.gaussianModel.a2 = 0.0F;
  model.gaussianModel.a3 = model.gaussianModel.a4 = 0.0F;
  model.gaussianModel.minStdXY = static_cast<float>(sigma_position);
  model.gaussianModel.minStdPHI = static_cast<float>(sigma_heading);
  movement.computeFromOdometry(mrpt::poses::CPose2D(dx, 0.0, dheading), model);
  mrpt::obs::CActionCollection actions;
  actions.insert(movement);

  auto observation = mrpt::obs::CObservationBeaconRanges::Create();
  observation->stdError = static_cast<float>(implementation_->sigma);
  observation->maxSensorDistance = 100.0F;
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    mrpt::obs::CObservationBeaconRanges::TMeasurement measurement;
    measurement.beaconID = static_cast<int32_t>(i);
    measurement.sensedDistance = static_cast<float>(ranges[i]);
    observation->sensedData.push_back(measurement);
  }
  mrpt::obs::CSensoryFrame frame;
  frame.insert(observation);
  implementation_->filter.executeOn(implementation_->particles, &actions, &frame);
}

double MrptBeaconMcl::mean_x() const {
  return implementation_->particles.getMeanVal().x();
}

double MrptBeaconMcl::mean_y() const {
  return implementation_->particles.getMeanVal().y();
}
