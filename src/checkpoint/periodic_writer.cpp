#include "src/checkpoint/periodic_writer.hpp"

#include <exception>
#include <utility>

#include "src/diagnostics/diagnostics.hpp"

namespace pf_resampling {

PeriodicWriter::~PeriodicWriter() {
  if (writing_.valid()) writing_.wait();
}

bool PeriodicWriter::is_due() {
  if (!is_used()) return false;
  take_result(false);
  const std::chrono::duration<double> since = Clock::now() - last_;
  return !writing_.valid() && since.count() >= period_;
}

void PeriodicWriter::write(Write write) {
  take_result(true);
  last_ = Clock::now();
  writing_ = std::async(std::launch::async, [write = std::move(write), path = file_] {
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

void PeriodicWriter::write_now(const Write& write, const std::string& other_file) {
  take_result(true);
  write(other_file.empty() ? file_ : other_file);
  if (!other_file.empty()) return;
  last_ = Clock::now();
  ++written_;
  problem_.clear();
}

void PeriodicWriter::take_result(bool wait) {
  if (!writing_.valid()) return;
  if (!wait && writing_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  const std::string before = problem_;
  problem_ = writing_.get();
  ++(problem_.empty() ? written_ : failed_);
  if (!problem_.empty() && problem_ != before) log_(LogLevel::warning, problem_);
}

void PeriodicWriter::report(const std::string& started, diagnostic_msgs::DiagnosticStatus* status) {
  take_result(false);
  if (!problem_.empty()) worsen(diagnostic_msgs::DiagnosticStatus::WARN, problem_, status);
  if (status->message.empty()) status->message = "fine";
  const std::chrono::duration<double> since = Clock::now() - last_;
  add_value("file", file_, status);
  add_value("started", started, status);
  add_value("written", std::to_string(written_), status);
  add_value("failed", std::to_string(failed_), status);
  add_value("last [s ago]", written_ > 0 ? number_text(since.count()) : "never", status);
}

}  // namespace pf_resampling
