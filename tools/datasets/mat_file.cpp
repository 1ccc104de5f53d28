#include "tools/datasets/mat_file.hpp"

#include <matio.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

namespace {

constexpr std::size_t kHeader = 128;  // bytes

using Variable = std::unique_ptr<matvar_t, decltype(&Mat_VarFree)>;

template <typename Number>
Eigen::MatrixXd converted(const void* data, Eigen::Index rows, Eigen::Index columns) {
  using Matrix = Eigen::Matrix<Number, Eigen::Dynamic, Eigen::Dynamic>;
  return Eigen::Map<const Matrix>(static_cast<const Number*>(data), rows, columns)
      .template cast<double>();
}

/// The library would print its own errors to stderr; ours name the file.
void be_silent(int /*level*/, char* /*message*/) {}

/// The order of the bytes with which the header of a MATLAB file of versions 5 to 7 ends: 256 as an
/// integer of two bytes, then "IM" or "MI". Other files are refused: the library would take
/// anything for version 4, which has no mark of its own, and take memory for whatever lengths it
/// sees there.
std::string byte_order(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::array<char, kHeader> header{};
  file.read(header.data(), header.size());
  const std::string mark(header.end() - 4, header.end());
  if (!file || (mark != std::string("\0\1IM", 4) && mark != std::string("\1\0MI", 4))) {
    throw Error(path + ": is not a MATLAB file of versions 5 to 7 (save it with -v7)");
  }
  return mark.substr(2);
}

/// Whether a MATLAB file ends before its last variable does: the library would give what there is
/// of it, and call the rest zero. Each variable begins with its type and its length in bytes.
bool is_truncated(const std::string& path) {
  constexpr std::uint64_t kTag = 8;
  const std::string order = byte_order(path);
  std::ifstream file(path, std::ios::binary);
  const std::uint64_t size = std::filesystem::file_size(path);
  for (std::uint64_t place = kHeader; place < size;) {
    std::array<unsigned char, kTag> tag{};
    file.seekg(static_cast<std::streamoff>(place));
    file.read(reinterpret_cast<char*>(tag.data()), kTag);
    if (!file) return true;
    std::uint64_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      length = 256 * length + (order == "MI" ? tag[4 + i] : tag[7 - i]);
    }
    place += kTag + length;
    if (place > size) return true;
  }
  return false;
}

/// Whether a file of that many bytes can hold a matrix of so many values: each takes a byte at
/// least, and compression (deflate) makes 1032 bytes of one at most. The library believes what the
/// file says, and takes memory for it.
bool can_hold(std::uintmax_t bytes, std::size_t rows, std::size_t columns) {
  constexpr double kMostExpansion = 1032.0;
  return static_cast<double>(rows) * static_cast<double>(columns) <=
         kMostExpansion * static_cast<double>(bytes);
}

}  // namespace

struct MatFile::Handle {
  mat_t* file = nullptr;
};

MatFile::MatFile(const std::string& path) : path_(path), handle_(std::make_unique<Handle>()) {
  if (!std::filesystem::exists(path)) throw Error(path + ": no such file");
  if (std::filesystem::is_directory(path)) throw Error(path + ": is a directory, not a file");
  if (is_truncated(path)) throw Error(path + ": is truncated");
  Mat_LogInitFunc("pf_resampling", be_silent);
  handle_->file = Mat_Open(path.c_str(), MAT_ACC_RDONLY);
  if (handle_->file == nullptr) throw Error(path + ": is not a MATLAB file that can be read");
}

MatFile::~MatFile() {
  Mat_Close(handle_->file);
}

std::optional<Eigen::MatrixXd> MatFile::matrix(const std::string& name,
                                               Eigen::Index columns) const {
  const std::string place = path_ + ": variable " + name;
  Mat_Rewind(handle_->file);
  const Variable stated(Mat_VarReadInfo(handle_->file, name.c_str()), &Mat_VarFree);
  if (stated == nullptr) return std::nullopt;
  if (stated->rank != 2 || stated->isComplex != 0) throw Error(place + " is not a real matrix");
  if (!can_hold(std::filesystem::file_size(path_), stated->dims[0], stated->dims[1])) {
    throw Error(place + " has " + std::to_string(stated->dims[0]) + " x " +
                std::to_string(stated->dims[1]) +
                " values, more than a file of its size can hold; is it damaged?");
  }
  Mat_Rewind(handle_->file);
  const Variable variable(Mat_VarRead(handle_->file, name.c_str()), &Mat_VarFree);
  if (variable == nullptr) throw Error(place + " cannot be read; is the file damaged?");
  if (variable->rank != 2 || variable->isComplex != 0) throw Error(place + " is not a real matrix");
  const auto rows = static_cast<Eigen::Index>(variable->dims[0]);
  const auto width = static_cast<Eigen::Index>(variable->dims[1]);
  if (rows == 0) return Eigen::MatrixXd(0, columns);
  if (width < columns) {
    throw Error(place + " has " + std::to_string(width) + " columns, " + std::to_string(columns) +
                " are needed");
  }
  const auto values = static_cast<std::size_t>(rows) * static_cast<std::size_t>(width);
  if (variable->data == nullptr || variable->data_size <= 0 ||
      variable->nbytes / static_cast<std::size_t>(variable->data_size) < values) {
    throw Error(place + " cannot be read; is the file truncated?");
  }
  switch (variable->class_type) {
    case MAT_C_DOUBLE:
      return converted<double>(variable->data, rows, width);
    case MAT_C_SINGLE:
      return converted<float>(variable->data, rows, width);
    case MAT_C_INT32:
      return converted<std::int32_t>(variable->data, rows, width);
    case MAT_C_UINT32:
      return converted<std::uint32_t>(variable->data, rows, width);
    case MAT_C_INT16:
      return converted<std::int16_t>(variable->data, rows, width);
    case MAT_C_UINT16:
      return converted<std::uint16_t>(variable->data, rows, width);
    case MAT_C_UINT8:
      return converted<std::uint8_t>(variable->data, rows, width);
    default:
      throw Error(place + " is not a matrix of numbers");
  }
}

std::string MatFile::names() const {
  std::string names;
  Mat_Rewind(handle_->file);
  while (true) {
    const Variable variable(Mat_VarReadNextInfo(handle_->file), &Mat_VarFree);
    if (variable == nullptr) break;
    const std::string name = variable->name == nullptr ? "one without a name" : variable->name;
    names += (names.empty() ? "" : ", ") + name;
  }
  return names.empty() ? "nothing" : names;
}

}  // namespace pf_resampling
