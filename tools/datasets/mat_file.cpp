#include "tools/datasets/mat_file.hpp"

#include <matio.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {

namespace {

using Variable = std::unique_ptr<matvar_t, decltype(&Mat_VarFree)>;

template <typename Number>
Eigen::MatrixXd converted(const void* data, Eigen::Index rows, Eigen::Index columns) {
  using Matrix = Eigen::Matrix<Number, Eigen::Dynamic, Eigen::Dynamic>;
  return Eigen::Map<const Matrix>(static_cast<const Number*>(data), rows, columns)
      .template cast<double>();
}

/// The library would print its own errors to stderr; ours name the file.
void be_silent(int /*level*/, char* /*message*/) {}

/// Whether a MATLAB 5 file ends before its last variable does: the library would give what there is
/// of it, and call the rest zero. Each variable begins with its type and its length in bytes.
bool is_truncated(const std::string& path) {
  constexpr std::uint64_t kHeader = 128;
  constexpr std::uint64_t kTag = 8;
  std::ifstream file(path, std::ios::binary);
  std::array<char, kHeader> header{};
  file.read(header.data(), kHeader);
  const std::string order(header.end() - 2, header.end());
  if (!file || (order != "IM" && order != "MI")) return false;  // another version of the format
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
  if (handle_->file == nullptr) throw Error(path + ": is not a MATLAB file");
}

MatFile::~MatFile() {
  Mat_Close(handle_->file);
}

std::optional<Eigen::MatrixXd> MatFile::matrix(const std::string& name,
                                               Eigen::Index columns) const {
  Mat_Rewind(handle_->file);
  const Variable variable(Mat_VarRead(handle_->file, name.c_str()), &Mat_VarFree);
  if (variable == nullptr) return std::nullopt;
  const std::string place = path_ + ": variable " + name;
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
