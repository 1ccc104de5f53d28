#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling::fuzz {

/// What a fuzzer feeds. Anything that `run` throws is a finding; what has to hold whatever the
/// bytes are is checked by require().
struct Target {
  const char* name;
  void (*run)(const std::uint8_t* bytes, std::size_t size);
};

/// All there are. `make fuzz` runs each with ever new bytes, the test fuzz_corpora_test with those
/// of test/fuzz/corpora/<name>/.
const std::vector<Target>& targets();

/// Something is not as it has to be whatever the input is.
struct BrokenInvariant : std::logic_error {
  using std::logic_error::logic_error;
};
inline void require(bool holds, const std::string& what) {
  if (!holds) throw BrokenInvariant(what);
}

inline void require_one_line(const Error& error) {
  const std::string what = error.what();
  require(!what.empty() && what.size() < 2000 && what.find('\n') == std::string::npos,
          "an error is no line: " + what);
}

/// Decisions, taken from bytes one after the other; zeros once they are used up.
class Bytes {
 public:
  Bytes(const std::uint8_t* bytes, std::size_t size) : bytes_(bytes), left_(size) {}

  bool empty() const { return left_ == 0; }
  std::uint8_t byte() {
    if (left_ == 0) return 0;
    --left_;
    return *bytes_++;
  }
  /// From 0 to `end` - 1; `end` is at most 65536.
  int below(int end) {
    if (end <= 1) return 0;
    const int value = end <= 256 ? byte() : byte() + 256 * byte();
    return value % end;
  }
  bool flip() { return below(2) == 1; }
  std::int32_t integer() { return raw<std::int32_t>(); }
  /// Of moderate size, -128 to 127.99.
  double moderate() { return (raw<std::int16_t>()) / 256.0; }
  /// Any there is: moderate, special or of any bits.
  double number();

 private:
  template <typename Number>
  Number raw() {
    std::uint8_t buffer[sizeof(Number)];
    for (std::uint8_t& one : buffer) one = byte();
    Number number;
    std::memcpy(&number, buffer, sizeof number);
    return number;
  }

  const std::uint8_t* bytes_;
  std::size_t left_;
};

/// A file of these bytes, until the next call; returns its path.
std::string file_of(const std::string& bytes, const std::string& name = "input");
/// A file that does not exist, in a folder of this process.
std::string new_file(const std::string& name = "output");

void map_file(const std::uint8_t* bytes, std::size_t size);
void beacon_mcl_messages(const std::uint8_t* bytes, std::size_t size);
void fastslam_messages(const std::uint8_t* bytes, std::size_t size);

}  // namespace pf_resampling::fuzz
