#include "src/checkpoint/checkpoint_keeper.hpp"

#include <filesystem>

#include "pf_resampling_core/error.hpp"
#include "src/diagnostics/diagnostics.hpp"

namespace pf_resampling {

void add_parameters(CheckpointOptions* options, ParameterList* list) {
  list->push_back(basic(text_parameter("checkpoint/file", &options->file,
                                       "Live: file of the periodic checkpoint, from which the node "
                                       "continues at the start; empty: none.")));
  list->push_back(real_above_parameter("checkpoint/period", &options->period, 0.0, 1e6, "s",
                                       "Period of the checkpoints, in real (not simulated) time."));
}

bool CheckpointKeeper::start(const std::function<void(const std::string& path)>& resume) {
  if (!is_used()) return false;
  std::error_code trouble;  // such as no permission to look: then reading says what it is
  if (!std::filesystem::exists(writer_.file(), trouble) && !trouble) return false;
  try {
    resume(writer_.file());
    start_ = "from " + writer_.file();
    log_(LogLevel::info, "continuing from the checkpoint " + writer_.file());
    return true;
  } catch (const std::exception& error) {
    const std::string problem = std::string("started from nothing: ") + error.what();
    writer_.note_problem(problem);
    log_(LogLevel::error, problem);
    return false;
  }
}

std::string CheckpointKeeper::write_now(const std::string& path, const Write& write) {
  const std::string& file = path.empty() ? writer_.file() : path;
  if (file.empty()) {
    throw Error("checkpoint: no file is given; give one, or set the parameter checkpoint/file");
  }
  writer_.write_now(write, path);
  return "checkpoint written to " + file;
}

void CheckpointKeeper::report(const std::string& name, diagnostic_msgs::DiagnosticArray* array) {
  if (is_used()) array->status.push_back(diagnostic(name));
}

diagnostic_msgs::DiagnosticStatus CheckpointKeeper::diagnostic(const std::string& name) {
  diagnostic_msgs::DiagnosticStatus status = make_diagnostic(name);
  writer_.report(start_, &status);
  return status;
}

}  // namespace pf_resampling
