#include "src/checkpoint/pose_keeper.hpp"

#include <exception>
#include <filesystem>

#include "src/diagnostics/diagnostics.hpp"

namespace pf_resampling {

void add_parameters(SavedPoseOptions* options, ParameterList* list) {
  list->push_back(real_parameter(
      "pose/save_every", &options->save_every, 0.0, 1e6, "s",
      "Live: period, in real time, of saving the pose to a file, also done at the end; at the "
      "start the robot is placed there if it can still be there. 0: off."));
  list->push_back(
      real_above_parameter("pose/oldest", &options->oldest, 0.0, 1e9, "s",
                           "Live: a saved pose older than this is not used at the start."));
}

PoseKeeper::PoseKeeper(const SavedPoseOptions& options,
                       const std::function<std::string()>& default_file,
                       const PeriodicWriter::Log& log)
    : is_wanted_(options.save_every > 0.0),
      log_(log),
      writer_(file_of(options, default_file, &problem_), options.save_every, log) {
  if (!problem_.empty()) log_(LogLevel::error, problem_);
}

std::string PoseKeeper::file_of(const SavedPoseOptions& options,
                                const std::function<std::string()>& default_file,
                                std::string* problem) {
  if (!(options.save_every > 0.0)) return "";
  try {
    return default_file();
  } catch (const std::exception& error) {
    *problem = std::string("the pose is not saved: ") + error.what();
    return "";
  }
}

std::optional<SavedPose> PoseKeeper::read() {
  if (!writer_.is_used()) return std::nullopt;
  std::error_code trouble;  // such as no permission to look: then reading says what it is
  if (!std::filesystem::exists(file(), trouble) && !trouble) return std::nullopt;
  try {
    return read_saved_pose(file());
  } catch (const std::exception& error) {
    const std::string problem = std::string("the saved pose is not used: ") + error.what();
    writer_.note_problem(problem);
    log_(LogLevel::warning, problem);
    return std::nullopt;
  }
}

void PoseKeeper::report(const std::string& name, const std::string& started,
                        diagnostic_msgs::DiagnosticArray* array) {
  if (!is_wanted_) return;
  diagnostic_msgs::DiagnosticStatus status = make_diagnostic(name);
  if (!problem_.empty()) worsen(diagnostic_msgs::DiagnosticStatus::WARN, problem_, &status);
  writer_.report(started, &status);
  array->status.push_back(status);
}

}  // namespace pf_resampling
