#pragma once

#include <string>

namespace pf_resampling {

/// Whether all records of a bag (format 2.0, wiki.ros.org/Bags/Format/2.0) are where its index says
/// and end where they should: rosbag takes lengths and places as the file has them, and reads
/// beyond its memory where these are wrong. Takes one pass over the file. What a message holds is
/// not looked at. Refuses what would take rosbag hours or gigabytes, too: messages or chunks that
/// overlap, chunks that claim far more than the file has, and more than 5000 connections. Throws
/// Error that names the file.
void check_bag_structure(const std::string& path);

}  // namespace pf_resampling
