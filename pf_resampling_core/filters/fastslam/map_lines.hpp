#pragma once

#include "pf_resampling_core/files/line_reader.hpp"
#include "pf_resampling_core/files/line_writer.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"

namespace pf_resampling {

/// The lines of a saved map between the first and the last of a file; the map has been checked.
void write_map_lines(const SavedMap& map, text_file::LineWriter* writer);
/// Throws Error for all that write_map_lines() has not written so.
SavedMap read_map_lines(text_file::LineReader* reader);

}  // namespace pf_resampling
