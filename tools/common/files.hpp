#pragma once

#include <string>

namespace pf_resampling {

/// The contents of a file. Throws Error naming the file if it is missing, unreadable or no regular
/// file.
std::string read_file(const std::string& path);

/// Throws Error unless there is a regular file of that name; `what` is what it has to be ("bag"). A
/// pipe has no end to begin at, and waits for a writer that may never come.
void require_regular_file(const std::string& path, const std::string& what);

/// Writes `contents` as a NewFile, so that `path` is either the old file or the whole new one.
/// Throws Error naming the file and the reason.
void write_file(const std::string& path, const std::string& contents);

}  // namespace pf_resampling
