#include "src/checkpoint/checkpoint_keeper.hpp"

#include <exception>
#include <filesystem>

#include "src/diagnostics/diagnostics.hpp"

namespace pf_resampling {

void add_parameters(CheckpointOptions* options, ParameterList* list) {
  list->push_back(basic(text_parameter("checkpoint/file", &options->file,
                                       "Live: file of the periodic checkpoint, from which the node "
                                       "continues at the start; empty: none.")));
  list->push_back(real_above_parameter("checkpoint/period", &options->period, 0.0, 1e6, "s",
                                       "Period of the checkpoints, in real (not simulated) time."));
}

CheckpointKeeper::~CheckpointKeeper() {
  if (writing_.valid()) writing_.wait();
}

void CheckpointKeeper::start(const std::function<void(const std::string& path)>& resume) {
  if (!is_used()) return;
  std::error_code trouble;  // such as no permission to look: then reading says what it is
  if (!std::filesystem::exists(options_.file, trouble) && !trouble) return;
  try {
    resume(options_.file);
    start_ = "from " + options_.file;
    log_(LogLevel::info, "continuing from the checkpoint " + options_.file);
  } catch (const std::exception& error) {
    problem_ = std::string("started from nothing: ") + error.what();
    log_(LogLevel::error, problem_);
  }
}

bool CheckpointKeeper::is_due() {
  if (!is_used()) return false;
  take_result(false);
  const std::chrono::duration<double> since = Clock::now() - last_;
  return !writing_.valid() && since.count() >= options_.period;
}

void CheckpointKeeper::write(Write write) {
  take_result(true);
  last_ = Clock::now();
  writing_ = std::async(std::launch::async, [write = std::move(write), path = options_.file] {
    try {
      write(path);
      return std::string();
    } catch (const std::exception& error) {
      return std::string(error.what());
    } catch (...) {
      return path + " was not written, for an unknown reason";
    }
  });
}

std::string CheckpointKeeper::write_now(const std::string& path, const Write& write) {
  const std::string& file = path.empty() ? options_.file : path;
  if (file.empty()) {
    throw Error("checkpoint: no file is given; give one, or set the parameter checkpoint/file");
  }
  take_result(true);
  write(file);
  if (path.empty()) {
    last_ = Clock::now();
    ++written_;
    problem_.clear();
  }
  return "checkpoint written to " + file;
}

void CheckpointKeeper::take_result(bool wait) {
  if (!writing_.valid()) return;
  if (!wait && writing_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  const std::string before = problem_;
  problem_ = writing_.get();
  ++(problem_.empty() ? written_ : failed_);
  if (!problem_.empty() && problem_ != before) log_(LogLevel::warning, problem_);
}

void CheckpointKeeper::report(const std::string& name, diagnostic_msgs::DiagnosticArray* array) {
  if (is_used()) array->status.push_back(diagnostic(name));
}

diagnostic_msgs::DiagnosticStatus CheckpointKeeper::diagnostic(const std::string& name) {
  take_result(false);
  diagnostic_msgs::DiagnosticStatus status = make_diagnostic(name);
  if (!problem_.empty()) worsen(diagnostic_msgs::DiagnosticStatus::WARN, problem_, &status);
  if (status.message.empty()) status.message = "fine";
  const std::chrono::duration<double> since = Clock::now() - last_;
  add_value("file", options_.file, &status);
  add_value("started", start_, &status);
  add_value("written", std::to_string(written_), &status);
  add_value("failed", std::to_string(failed_), &status);
  add_value("last [s ago]", written_ > 0 ? number_text(since.count()) : "never", &status);
  return status;
}

}  // namespace pf_resampling
