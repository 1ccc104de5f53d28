#pragma once

#include "pf_resampling_core/files/line_reader.hpp"
#include "pf_resampling_core/files/line_writer.hpp"
#include "pf_resampling_core/filters/beacon_mcl/saved_beacon_mcl.hpp"

namespace pf_resampling {

/// The lines of a saved filter between the first and the last of a file; it is without fault
/// (fault_of()).
void write_beacon_mcl_lines(const SavedBeaconMcl& filter, text_file::LineWriter* writer);
/// Throws Error for all that write_beacon_mcl_lines() has not written so.
SavedBeaconMcl read_beacon_mcl_lines(text_file::LineReader* reader);

}  // namespace pf_resampling
