#include "mat_file.hpp"

#include <matio.h>

#include <cstdint>
#include <filesystem>

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

}  // namespace

struct MatFile::Handle {
  mat_t* file = nullptr;
};

MatFile::MatFile(const std::string& path) : path_(path), handle_(std::make_unique<Handle>()) {
  if (!std::filesystem::exists(path)) throw Error(path + ": no such file");
  if (std::filesystem::is_directory(path)) throw Error(path + ": is a directory, not a file");
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
  if (variable->data == nullptr) throw Error(place + " cannot be read; is the file truncated?");
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
    names += (names.empty() ? "" : ", ") + std::string(variable->name);
  }
  return names.empty() ? "nothing" : names;
}

}  // namespace pf_resampling
