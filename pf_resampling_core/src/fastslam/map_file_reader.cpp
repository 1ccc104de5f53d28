#include <fstream>
#include <limits>

#include "map_checks.hpp"
#include "map_file.hpp"
#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/fastslam/saved_map.hpp"

namespace pf_resampling {
namespace {

using map_checks::fault_of;
using map_file::Checksum;
using map_file::ClassicLocale;
using map_file::kFirstLine;
using map_file::kFirstWords;
using map_file::printable;

constexpr std::size_t kLongestLine = 1000;

class MapReader {
 public:
  explicit MapReader(const std::string& path) : path_(path) {
    map_file::open("map file", path, &stream_);
    take_line();
    if (line_.rfind(kFirstWords, 0) != 0) {
      throw Error("map file " + path + ", line 1: " + printable(line_) +
                  " is not how a map begins; name one that save_map wrote");
    }
    if (line_ != kFirstLine) {
      throw Error("map file " + path + ", line 1: " + printable(line_) +
                  " is of a version that this program does not read, which is \"" + kFirstLine +
                  "\"; save the map again with this program");
    }
  }

  [[noreturn]] void refuse(const std::string& fault) const {
    throw Error("map file " + path_ + ", line " + std::to_string(lines_) + ": " + fault +
                "; the file is damaged: save the map again or take another copy");
  }
  void refuse_if(const std::string& fault) const {
    if (!fault.empty()) refuse(fault);
  }

  /// Takes the next line that is no comment: `keyword` and so many words.
  void take(const std::string& keyword, std::size_t words) {
    do {
      take_line();
    } while (!line_.empty() && line_.front() == '#');
    words_.clear();
    std::size_t begin = 0;
    while (begin <= line_.size()) {
      const std::size_t end = std::min(line_.find(' ', begin), line_.size());
      words_.push_back(line_.substr(begin, end - begin));
      begin = end + 1;
    }
    if (words_.front() != keyword) {
      refuse(printable(line_) + " stands where a line \"" + keyword + "\" has to be");
    }
    if (words_.size() != words + 1) {
      refuse("after \"" + keyword + "\" there are " + std::to_string(words_.size() - 1) +
             " values, not " + std::to_string(words));
    }
  }

  const std::string& word(std::size_t i) const { return words_[i]; }

  double real(std::size_t i) const {
    const std::string& word = words_[i];
    if (word == "-inf") return -std::numeric_limits<double>::infinity();
    double value = 0.0;
    if (!map_file::parse(word, &value)) {
      refuse(printable(word) + " is not a number");
    }
    return value;
  }

  std::int64_t integer(std::size_t i, std::int64_t most) const {
    const std::string& word = words_[i];
    std::int64_t value = 0;
    if (!map_file::parse(word, most, &value)) {
      refuse(printable(word) + " is not a whole number from 0 to " + std::to_string(most));
    }
    return value;
  }

  /// Whether all is as it was written, and nothing comes after.
  void take_end() {
    const std::string expected = checksum_.end_line(lines_);
    take_line();
    if (line_ != expected) {
      refuse(printable(line_) + " is not the end that belongs to what comes before, which is \"" +
             expected + "\"");
    }
    if (stream_.peek() != std::char_traits<char>::eof()) refuse("there is more after the end");
  }

 private:
  void take_line() {
    ++lines_;
    line_.clear();
    std::streambuf* const buffer = stream_.rdbuf();
    while (true) {
      const int letter = buffer->sbumpc();
      if (letter == std::char_traits<char>::eof()) {
        refuse(line_.empty() && lines_ > 1 ? "the file ends before the map does"
                                           : "the file ends within this line");
      }
      if (letter == '\n') break;
      if (line_.size() == kLongestLine) refuse("the line is too long");
      line_ += static_cast<char>(letter);
    }
    checksum_.add(line_);
    checksum_.add("\n");
  }

  std::string path_;
  std::ifstream stream_;
  std::string line_;
  std::vector<std::string> words_;
  std::int64_t lines_ = 0;
  Checksum checksum_;
};

DataAssociation association_of(const MapReader& reader) {
  for (const DataAssociation association : all_data_associations()) {
    if (to_string(association) == reader.word(1)) return association;
  }
  reader.refuse(printable(reader.word(1)) + " is no data association");
}

Eigen::Matrix2d covariance_of(const MapReader& reader, std::size_t first) {
  Eigen::Matrix2d covariance;
  covariance << reader.real(first), reader.real(first + 1), reader.real(first + 1),
      reader.real(first + 2);
  return covariance;
}

void read_head(MapReader* reader, SavedMap* map) {
  reader->take("frame", 1);
  map->frame = reader->word(1);
  reader->refuse_if(map_checks::fault_of_frame(map->frame));
  reader->take("association", 1);
  map->association = association_of(*reader);
  reader->take("next_id", 1);
  map->next_id = reader->integer(1, map_checks::kLargestId + 1);
  reader->take("step", 1);
  map->step =
      static_cast<std::uint32_t>(reader->integer(1, std::numeric_limits<std::uint32_t>::max()));
  reader->take("scans_since_renewal", 1);
  map->observations_since_renewal = reader->integer(1, std::numeric_limits<std::int64_t>::max());
  reader->take("view", 2);
  map->view_range = reader->real(1);
  map->view_bearing = reader->real(2);
  reader->refuse_if(map_checks::fault_of_view(map->view_range, map->view_bearing));
  reader->take("pose", 3);
  map->pose.mean = {reader->real(1), reader->real(2), reader->real(3)};
  reader->refuse_if(map_checks::fault_of_pose(map->pose.mean));
  reader->take("pose_covariance", 6);
  map->pose.covariance << reader->real(1), reader->real(2), reader->real(3), reader->real(2),
      reader->real(4), reader->real(5), reader->real(3), reader->real(5), reader->real(6);
  reader->refuse_if(map_checks::fault_of_pose_covariance(map->pose.covariance));
}

SavedLandmark read_landmark(MapReader* reader, std::int64_t previous) {
  reader->take("landmark", 10);
  SavedLandmark landmark;
  LandmarkEstimate& estimate = landmark.estimate;
  estimate.id = reader->integer(1, map_checks::kLargestId);
  estimate.mean = {reader->real(2), reader->real(3)};
  estimate.covariance = covariance_of(*reader, 4);
  estimate.held = reader->real(7);
  estimate.log_odds = reader->real(8);
  landmark.last_seen = {reader->real(9), reader->real(10)};
  reader->refuse_if(fault_of(landmark, previous));
  return landmark;
}

// Memory grows with what is in the file, never with what it says is to come.
SavedParticle read_particle(MapReader* reader, const SavedMap& map) {
  reader->take("particle", 6);
  SavedParticle particle;
  particle.pose = {reader->real(1), reader->real(2), reader->real(3)};
  particle.log_weight = reader->real(4);
  particle.weight = reader->real(5);
  reader->refuse_if(fault_of(particle));
  const std::int64_t count = reader->integer(6, static_cast<std::int64_t>(map.landmarks.size()));
  std::int64_t previous = -1;
  for (std::int64_t i = 0; i < count; ++i) {
    reader->take("has", 7);
    ParticleLandmark landmark;
    landmark.id = reader->integer(1, map_checks::kLargestId);
    landmark.mean = {reader->real(2), reader->real(3)};
    landmark.covariance = covariance_of(*reader, 4);
    landmark.log_odds = reader->real(7);
    reader->refuse_if(fault_of(landmark, previous, map));
    previous = landmark.id;
    particle.landmarks.push_back(landmark);
  }
  return particle;
}

void read_odometry_errors(MapReader* reader, SavedMap* map) {
  OdometryErrorState& errors = map->odometry_errors;
  reader->take("odometry_velocity", 3);
  errors.velocity << reader->real(1), reader->real(2), reader->real(3);
  for (int row = 0; row < OdometryErrorEstimator::kCount; ++row) {
    reader->take("odometry_errors_covariance", static_cast<std::size_t>(row) + 1);
    for (int column = 0; column <= row; ++column) {
      errors.covariance(row, column) = errors.covariance(column, row) =
          reader->real(static_cast<std::size_t>(column) + 1);
    }
  }
  errors.means.setZero(static_cast<Eigen::Index>(map->particles.size()),
                       OdometryErrorEstimator::kCount);
  for (Eigen::Index i = 0; i < errors.means.rows(); ++i) {
    reader->take("odometry_errors", OdometryErrorEstimator::kCount);
    for (int error = 0; error < OdometryErrorEstimator::kCount; ++error) {
      errors.means(i, error) = reader->real(static_cast<std::size_t>(error) + 1);
    }
  }
  reader->refuse_if(fault_of(errors, map->particles.size()));
}

}  // namespace

SavedMap read_map_file(const std::string& path) {
  const ClassicLocale locale;
  MapReader reader(path);
  SavedMap map;
  read_head(&reader, &map);
  reader.take("landmarks", 1);
  const std::int64_t landmarks = reader.integer(1, map_checks::kLargestId);
  for (std::int64_t i = 0; i < landmarks; ++i) {
    const std::int64_t previous = map.landmarks.empty() ? -1 : map.landmarks.back().estimate.id;
    map.landmarks.push_back(read_landmark(&reader, previous));
  }
  reader.take("particles", 1);
  const std::int64_t particles = reader.integer(1, map_checks::kMostParticles);
  for (std::int64_t i = 0; i < particles; ++i) map.particles.push_back(read_particle(&reader, map));
  read_odometry_errors(&reader, &map);
  reader.refuse_if(map_checks::fault_of_whole(map));
  reader.take_end();
  return map;
}

}  // namespace pf_resampling
