#include "test/places.hpp"

namespace pf_resampling {

const char* const kBuildFolder = PF_RESAMPLING_BUILD;
const char* const kProgramsFolder = PF_RESAMPLING_PROGRAMS;
const char* const kSourceFolder = PF_RESAMPLING_SOURCE;

}  // namespace pf_resampling
