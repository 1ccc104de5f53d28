#pragma once

#include <string>

#include "pf_resampling_core/files/line_reader.hpp"
#include "pf_resampling_core/files/line_writer.hpp"
#include "pf_resampling_core/filters/fastslam/smoothed_past.hpp"

namespace pf_resampling {

/// The lines of a saved map about what a redraw draws from.
void write_past_lines(const SmoothedPastState& past, text_file::LineWriter* writer);
/// Throws Error for all that write_past_lines() has not written so.
SmoothedPastState read_past_lines(text_file::LineReader* reader);

/// What is wrong with it, in words; nothing if all is well.
std::string fault_of(const SmoothedPastState& past);

}  // namespace pf_resampling
