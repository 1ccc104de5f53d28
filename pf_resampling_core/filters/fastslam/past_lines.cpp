#include "pf_resampling_core/filters/fastslam/past_lines.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

using text_file::append;
using text_file::LineReader;
using text_file::LineWriter;

constexpr std::int64_t kMost = std::numeric_limits<int>::max() / 4;

// The numbers of each part in the order in which they are saved; visit(number).
template <typename Matrix, typename Visit>
void for_each_entry(Matrix& matrix, const Visit& visit) {
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) visit(matrix(i, j));
  }
}

template <typename Pose, typename Visit>
void for_each_number_of_pose(Pose& pose, const Visit& visit) {
  visit(pose.x);
  visit(pose.y);
  visit(pose.heading);
}

template <typename Motion, typename Visit>
void for_each_number_of_motion(Motion& motion, const Visit& visit) {
  for_each_number_of_pose(motion.mean, visit);
  for_each_entry(motion.covariance, visit);
  for_each_entry(motion.sensitivity, visit);
}

template <typename Sighting, typename Visit>
void for_each_number_of_sighting(Sighting& sighting, const Visit& visit) {
  visit(sighting.range);
  visit(sighting.bearing);
  visit(sighting.range_variance);
  visit(sighting.bearing_variance);
  for_each_number_of_pose(sighting.sensor, visit);
}

template <typename Error, typename Visit>
void for_each_number_of_error(Error& error, const Visit& visit) {
  for_each_entry(error.error, visit);
  for_each_entry(error.by_ranges, visit);
  for_each_entry(error.by_bearings, visit);
  for_each_entry(error.by_motions, visit);
  for_each_entry(error.by_prior, visit);
}

// Words of a line, one after the other.
class Words {
 public:
  explicit Words(const LineReader* reader, std::size_t first = 1) : reader_(reader), next_(first) {}
  void operator()(double& number) const { number = reader_->finite(next_++); }

 private:
  const LineReader* reader_;
  mutable std::size_t next_;
};

// Adds numbers to a line.
class Numbers {
 public:
  explicit Numbers(std::string* text) : text_(text) {}
  void operator()(double number) const { append(number, text_); }

 private:
  std::string* text_;
};

void write_prior(const GaussianPrior& prior, LineWriter* writer) {
  std::string text = "past_prior " + std::to_string(prior.landmarks.size());
  for_each_number_of_pose(prior.pose, Numbers(&text));
  for_each_entry(prior.constants, Numbers(&text));
  for_each_entry(prior.odometry_given_path, Numbers(&text));
  writer->line(text);
  for (std::size_t l = 0; l < prior.landmarks.size(); ++l) {
    text = "past_prior_landmark";
    for_each_entry(prior.landmarks[l], Numbers(&text));
    for_each_entry(prior.landmarks_given_path[l], Numbers(&text));
    writer->line(text);
  }
  for (Eigen::Index i = 0; i < prior.size(); ++i) {
    text = "past_prior_row";
    append(prior.gradient[i], &text);
    for (Eigen::Index j = 0; j <= i; ++j) append(prior.information(i, j), &text);
    writer->line(text);
  }
}

GaussianPrior read_prior(LineReader* reader, std::size_t most_landmarks) {
  GaussianPrior prior;
  reader->take("past_prior", 1 + 3 + kSensorConstants + kOdometryConstants * kOdometryConstants);
  const std::int64_t landmarks = reader->integer(1, static_cast<std::int64_t>(most_landmarks));
  const Words words(reader, 2);
  for_each_number_of_pose(prior.pose, words);
  for_each_entry(prior.constants, words);
  for_each_entry(prior.odometry_given_path, words);
  for (std::int64_t l = 0; l < landmarks; ++l) {
    reader->take("past_prior_landmark", 6);
    const Words place(reader);
    prior.landmarks.emplace_back();
    prior.landmarks_given_path.emplace_back();
    for_each_entry(prior.landmarks.back(), place);
    for_each_entry(prior.landmarks_given_path.back(), place);
  }
  // Memory grows with what is in the file, never with what it says is to come.
  std::vector<double> numbers;
  for (Eigen::Index i = 0; i < prior.size(); ++i) {
    const std::size_t count = static_cast<std::size_t>(i) + 2;
    reader->take("past_prior_row", count);
    for (std::size_t word = 1; word <= count; ++word) numbers.push_back(reader->finite(word));
  }
  prior.gradient.resize(prior.size());
  prior.information.resize(prior.size(), prior.size());
  auto number = numbers.begin();
  for (Eigen::Index i = 0; i < prior.size(); ++i) {
    prior.gradient[i] = *number++;
    for (Eigen::Index j = 0; j <= i; ++j) {
      prior.information(i, j) = prior.information(j, i) = *number++;
    }
  }
  return prior;
}

void write_sightings(const std::vector<SightingFactor>& sightings, LineWriter* writer) {
  for (const SightingFactor& sighting : sightings) {
    std::string text = "past_sighting";
    append(std::int64_t{sighting.pose}, &text);
    append(std::int64_t{sighting.landmark}, &text);
    for_each_number_of_sighting(sighting, Numbers(&text));
    writer->line(text);
  }
}

void write_blocks(const std::vector<PredictedBlock>& blocks, const std::string& keyword,
                  LineWriter* writer) {
  for (const PredictedBlock& block : blocks) {
    writer->line(keyword + " " + std::to_string(block.size()));
    for (const PredictionError& error : block) {
      std::string text = "past_error";
      for_each_number_of_error(error, Numbers(&text));
      writer->line(text);
    }
  }
}

std::vector<PredictedBlock> read_blocks(std::int64_t count, const std::string& keyword,
                                        LineReader* reader) {
  std::vector<PredictedBlock> blocks;
  for (std::int64_t i = 0; i < count; ++i) {
    reader->take(keyword, 1);
    const std::int64_t errors = reader->integer(1, kMost);
    blocks.emplace_back();
    for (std::int64_t k = 0; k < errors; ++k) {
      reader->take("past_error", 2 + 4 * 4);
      blocks.back().emplace_back();
      for_each_number_of_error(blocks.back().back(), Words(reader));
    }
  }
  return blocks;
}

bool is_scale(double scale) {
  return scale >= 1.0 && scale <= kLargestNoiseScale;
}

}  // namespace

void write_past_lines(const SmoothedPastState& past, LineWriter* writer) {
  const SmoothingGraph& graph = past.graph;
  writer->line(
      "# what a redraw draws from: numbers of poses, landmarks, sightings; longest absence of a");
  writer->line(
      "# landmark of the last update; poses that are decided; the prior; then a line for each");
  writer->line("past " + std::to_string(graph.poses.size()) + " " +
               std::to_string(graph.landmarks.size()) + " " +
               std::to_string(graph.sightings.size() + graph.unassigned.size()) + " " +
               std::to_string(past.longest_absence) + " " + std::to_string(past.decided));
  if (graph.poses.empty()) return;
  write_prior(graph.prior, writer);
  std::string text = "past_constants";
  for_each_entry(graph.constants, Numbers(&text));
  writer->line(text);
  for (std::size_t l = 0; l < graph.landmarks.size(); ++l) {
    text = "past_landmark";
    append(past.landmark_ids[l], &text);
    append(std::int64_t{past.last_seen[l]}, &text);
    append(std::int64_t{past.is_dormant[l] ? 1 : 0}, &text);
    for_each_entry(graph.landmarks[l], Numbers(&text));
    writer->line(text);
  }
  for (std::size_t i = 0; i < graph.poses.size(); ++i) {
    text = "past_pose";
    for_each_number_of_pose(graph.poses[i], Numbers(&text));
    writer->line(text);
    if (i + 1 == graph.poses.size()) break;
    text = "past_motion";
    for_each_number_of_motion(graph.motions[i], Numbers(&text));
    writer->line(text);
  }
  write_sightings(graph.sightings, writer);
  write_sightings(graph.unassigned, writer);
  writer->line(
      "# how noisy the data were found: scales of ranges, bearings and odometry, seconds of the");
  writer->line("# newest pose and of the last test, numbers of passages and windows predicted");
  const NoiseScales& noise = graph.noise;
  text = "past_noise";
  for (const double number :
       {noise.range, noise.bearing, noise.motion, past.time, past.validated}) {
    append(number, &text);
  }
  writer->line(text + " " + std::to_string(past.passages.size()) + " " +
               std::to_string(past.windows.size()));
  write_blocks(past.passages, "past_passage", writer);
  write_blocks(past.windows, "past_window", writer);
}

SmoothedPastState read_past_lines(LineReader* reader) {
  SmoothedPastState past;
  SmoothingGraph& graph = past.graph;
  reader->take("past", 5);
  const std::int64_t poses = reader->integer(1, kMost);
  const std::int64_t landmarks = reader->integer(2, kMost);
  const std::int64_t sightings = reader->integer(3, kMost);
  past.longest_absence = static_cast<int>(reader->integer(4, kMost));
  past.decided = static_cast<int>(reader->integer(5, -kMost, kMost));
  if (poses == 0) return past;
  graph.prior = read_prior(reader, static_cast<std::size_t>(landmarks));
  reader->take("past_constants", kSensorConstants);
  for_each_entry(graph.constants, Words(reader));
  for (std::int64_t l = 0; l < landmarks; ++l) {
    reader->take("past_landmark", 5);
    past.landmark_ids.push_back(reader->integer(1, -1, std::int64_t{1} << 62));
    past.last_seen.push_back(static_cast<int>(reader->integer(2, -kMost, kMost)));
    past.is_dormant.push_back(reader->integer(3, 1) == 1);
    graph.landmarks.emplace_back();
    for_each_entry(graph.landmarks.back(), Words(reader, 4));
  }
  for (std::int64_t i = 0; i < poses; ++i) {
    reader->take("past_pose", 3);
    graph.poses.push_back(reader->pose(1));
    if (i + 1 == poses) break;
    reader->take("past_motion", 3 + 9 + 3 * kOdometryConstants);
    graph.motions.emplace_back();
    for_each_number_of_motion(graph.motions.back(), Words(reader));
  }
  for (std::int64_t i = 0; i < sightings; ++i) {
    reader->take("past_sighting", 9);
    SightingFactor sighting;
    sighting.pose = static_cast<int>(reader->integer(1, poses - 1));
    sighting.landmark = static_cast<int>(reader->integer(2, -1, kMost));
    for_each_number_of_sighting(sighting, Words(reader, 3));
    (sighting.landmark >= 0 ? graph.sightings : graph.unassigned).push_back(sighting);
  }
  reader->take("past_noise", 7);
  graph.noise = {reader->finite(1), reader->finite(2), reader->finite(3)};
  past.time = reader->finite(4);
  past.validated = reader->finite(5);
  const std::int64_t passages = reader->integer(6, kMost);
  const std::int64_t windows = reader->integer(7, kMost);
  past.passages = read_blocks(passages, "past_passage", reader);
  past.windows = read_blocks(windows, "past_window", reader);
  reader->refuse_if(fault_of(past));
  return past;
}

std::string fault_of(const SmoothedPastState& past) {
  const SmoothingGraph& graph = past.graph;
  if (graph.poses.empty()) return {};
  if (past.landmark_ids.size() != graph.landmarks.size() ||
      past.last_seen.size() != graph.landmarks.size() ||
      past.is_dormant.size() != graph.landmarks.size()) {
    return "what a redraw draws from has not an id and a last sighting for each landmark";
  }
  const GaussianPrior& prior = graph.prior;
  const bool fits = prior.landmarks.size() <= graph.landmarks.size() &&
                    prior.landmarks_given_path.size() == prior.landmarks.size() &&
                    prior.information.rows() == prior.size() &&
                    prior.information.cols() == prior.size() &&
                    prior.gradient.size() == prior.size();
  if (!fits || !prior.information.allFinite() || !prior.gradient.allFinite()) {
    return "the prior of what a redraw draws from has not the size of its landmarks, or is not "
           "finite";
  }
  if (!is_scale(graph.noise.range) || !is_scale(graph.noise.bearing) ||
      !is_scale(graph.noise.motion) || !std::isfinite(past.time) ||
      !std::isfinite(past.validated)) {
    return "the noise of what a redraw draws from has a scale that is not between 1 and 20, or a "
           "time that is not finite";
  }
  try {
    check(graph);
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

}  // namespace pf_resampling
