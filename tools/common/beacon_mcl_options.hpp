#pragma once

#include "beacon_mcl_node/pipeline_options.hpp"
#include "tools/common/beacon_mcl_bag.hpp"
#include "tools/common/command_line.hpp"

namespace pf_resampling {

/// Adds the options by which a program lets range-beacon localization be configured: --config,
/// --set and the topics --odom, --ranges, --beacons.
void add_beacon_mcl_options(CommandLine* line);

/// Of these --ranges and --beacons alone, which are this filter's own.
void add_beacon_mcl_topics(CommandLine* line);

/// What they say, on top of the shipped defaults. Throws Error naming file or assignment.
BeaconMclPipelineOptions read_beacon_mcl_options(const CommandLine& line);

BeaconMclTopics beacon_mcl_topics(const CommandLine& line);

}  // namespace pf_resampling
