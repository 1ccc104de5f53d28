#pragma once

#include <string>

#include "tools/datasets/recording.hpp"

namespace pf_resampling {

/// Reads a folder with any of odometry.csv (columns t,x,y,heading or t,distance,dheading or
/// t,v,omega), ranges.csv (t,beacon,range[,variance]), beacons.csv (beacon,x,y[,z]),
/// landmark_observations.csv (t,id,range,bearing[,range_variance,bearing_variance]), landmarks.csv
/// (id,x,y), ground_truth.csv (t,x,y[,heading]) and frames.csv (frame,x,y[,z][,yaw]). How a file
/// has to look: csv_table.hpp. Ids: -1 is unknown.
///
/// Odometry of the kind t,distance,dheading: distance driven and angle turned since the row above
/// (mid-point rule); of the kind t,v,omega: velocities that hold from t to the next row.
/// `metres_per_unit`: of all measured ranges (and their variance, squared); places are in metres.
/// Throws Error that names file, line, column and value.
Recording read_csv(const std::string& directory, double metres_per_unit);

}  // namespace pf_resampling
