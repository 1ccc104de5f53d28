#include "tools/datasets/mat_file.hpp"

#include <matio.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <memory>
#include <system_error>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/text_file.hpp"

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

/// A file in memory that has a name as long as this lives.
class FileInMemory {
 public:
  FileInMemory() : descriptor_(memfd_create("variable", MFD_CLOEXEC)) {}
  ~FileInMemory() { close(descriptor_); }
  FileInMemory(const FileInMemory&) = delete;
  FileInMemory& operator=(const FileInMemory&) = delete;

  /// Throws std::system_error: there is no memory for it.
  void append(const std::string& bytes) {
    for (std::size_t written = 0; written < bytes.size();) {
      const ssize_t count = write(descriptor_, bytes.data() + written, bytes.size() - written);
      if (count <= 0) throw std::system_error(errno, std::generic_category(), "file in memory");
      written += static_cast<std::size_t>(count);
    }
  }

  std::string name() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

}  // namespace

MatFile::MatFile(const std::string& path) : path_(path), variables_(variables_of_mat_file(path)) {}

std::optional<Eigen::MatrixXd> MatFile::matrix(const std::string& name,
                                               Eigen::Index columns) const {
  const std::string place = path_ + ": variable " + name;
  const auto found =
      std::find_if(variables_.begin(), variables_.end(),
                   [&](const MatVariable& variable) { return variable.name == name; });
  if (found == variables_.end()) return std::nullopt;
  if (!found->is_numeric) throw Error(place + " is not a matrix of numbers");
  if (found->dimensions.size() != 2 || found->is_complex) {
    throw Error(place + " is not a real matrix");
  }
  // The library sees this variable alone: it reads the others on its way there, cells of cells too.
  FileInMemory copy;
  copy.append(file_of_variable(path_, *found));
  Mat_LogInitFunc("pf_resampling", be_silent);
  const std::unique_ptr<mat_t, decltype(&Mat_Close)> file(
      Mat_Open(copy.name().c_str(), MAT_ACC_RDONLY), &Mat_Close);
  if (file == nullptr) throw Error(path_ + ": is not a MATLAB file that can be read");
  const Variable variable(Mat_VarReadNext(file.get()), &Mat_VarFree);
  const auto rows = static_cast<Eigen::Index>(found->dimensions[0]);
  const auto width = static_cast<Eigen::Index>(found->dimensions[1]);
  if (variable == nullptr || variable->rank != 2 || variable->isComplex != 0 ||
      variable->dims[0] != found->dimensions[0] || variable->dims[1] != found->dimensions[1]) {
    throw Error(place + " cannot be read; is the file damaged?");
  }
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
  constexpr std::size_t kShown = 20;
  std::string names;
  for (std::size_t i = 0; i < std::min(kShown, variables_.size()); ++i) {
    const std::string& name = variables_[i].name;
    names += names.empty() ? "" : ", ";
    names += name.empty() ? "one without a name" : text_file::letters(name);
  }
  if (variables_.size() > kShown) names += ", ...";
  return names.empty() ? "nothing" : names;
}

}  // namespace pf_resampling
