#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace pf_resampling {

/// A MATLAB 5 file of real matrices, put together by hand after MathWorks' "MAT-File Format"
/// (chapter "Level 5 MAT-File Format"), so that the reader is tested against another's writing.
class MatFileWriter {
 public:
  MatFileWriter() {
    bytes_ = "MATLAB 5.0 MAT-file";
    bytes_.resize(124, ' ');
    bytes_ += std::string("\x00\x01IM", 4);
  }

  /// Adds a matrix, given row by row.
  MatFileWriter& add(const std::string& name, const std::vector<std::vector<double>>& rows) {
    const auto columns = rows.empty() ? std::size_t{0} : rows.front().size();
    std::string inner;
    inner += element(6, integers({6, 0}));  // flags: class double
    inner += element(5, integers({static_cast<std::uint32_t>(rows.size()),
                                  static_cast<std::uint32_t>(columns)}));
    inner += element(1, name);
    std::string numbers;
    for (std::size_t column = 0; column < columns; ++column) {
      for (const auto& row : rows) numbers += raw(row[column]);
    }
    inner += element(9, numbers);
    bytes_ += element(14, inner);
    return *this;
  }

  /// Adds an element of the file: one that is compressed is not padded, a matrix is of such a
  /// length already.
  MatFileWriter& add_element(std::uint32_t type, const std::string& data) {
    bytes_ += raw(type) + raw(static_cast<std::uint32_t>(data.size())) + data;
    return *this;
  }

  const std::string& bytes() const { return bytes_; }

  static std::string integers(const std::vector<std::uint32_t>& numbers) {
    std::string bytes;
    for (const std::uint32_t number : numbers) bytes += raw(number);
    return bytes;
  }
  /// Type, length, data, padded to eight bytes.
  static std::string element(std::uint32_t type, const std::string& data) {
    std::string bytes = raw(type) + raw(static_cast<std::uint32_t>(data.size())) + data;
    bytes.resize((bytes.size() + 7) / 8 * 8, '\0');
    return bytes;
  }

 private:
  template <typename Number>
  static std::string raw(Number number) {
    std::string bytes(sizeof(number), '\0');
    std::memcpy(bytes.data(), &number, sizeof(number));
    return bytes;
  }

  std::string bytes_;
};

}  // namespace pf_resampling
