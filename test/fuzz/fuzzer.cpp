// A libFuzzer program of the target that FUZZ_TARGET names.
#include "test/fuzz/fuzz_target.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  pf_resampling::fuzz::FUZZ_TARGET(bytes, size);
  return 0;
}
