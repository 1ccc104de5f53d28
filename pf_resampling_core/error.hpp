#pragma once

#include <stdexcept>
#include <string>

namespace pf_resampling {

/// What every function of this library throws on input it cannot use. The text is one line that
/// names the thing, the value and the remedy; programs print it as it is.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace pf_resampling
