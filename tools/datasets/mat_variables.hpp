#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace pf_resampling {

/// A variable of a MATLAB file, as its header describes it.
struct MatVariable {
  std::string name;         ///< empty: it has none
  bool is_numeric = false;  ///< of integers or floating-point numbers, not of text, cells, ...
  bool is_complex = false;
  std::vector<std::uint32_t> dimensions;
  std::uint64_t place = 0;   ///< where it begins in the file, with the eight bytes of its tag
  std::uint64_t length = 0;  ///< bytes, with those of its tag
};

/// The variables of a MATLAB file of versions 5 to 7, in the order of the file ("MAT-File Format",
/// MathWorks, chapter "Level 5 MAT-File Format"). The library that reads what is in them believes
/// what a file says, and takes memory for it: here it is looked at whether each variable ends where
/// the file says, and whether its header is one. Throws Error that names the file: it cannot be
/// read, is no such file, truncated or damaged.
std::vector<MatVariable> variables_of_mat_file(const std::string& path);

/// A MATLAB file with that variable alone. Throws Error: the file at `path` cannot be read.
std::string file_of_variable(const std::string& path, const MatVariable& variable);

}  // namespace pf_resampling
