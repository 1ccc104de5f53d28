#pragma once

namespace pf_resampling {

/// Where tests find what they read and run, without a slash at the end. Only places.cpp is compiled
/// with these paths, so that all else compiles to the same wherever it is.
extern const char* const kBuildFolder;
extern const char* const kProgramsFolder;
extern const char* const kSourceFolder;  ///< the top of the repository

}  // namespace pf_resampling
