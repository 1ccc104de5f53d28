// Maps that were not found by a filter: lists of landmarks.

#include <algorithm>
#include <array>
#include <set>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/text_file.hpp"
#include "pf_resampling_core/filters/fastslam/map_checks.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"

namespace pf_resampling {
namespace {

constexpr double kSurveyedSigma = 0.001;  // m
constexpr std::array<const char*, 4> kColumns = {"id", "x", "y", "sigma"};
constexpr std::size_t kNone = kColumns.size();
constexpr std::size_t kSigma = 3;  // among them; the others have to be there

SavedLandmark saved(const SurveyedLandmark& surveyed) {
  SavedLandmark landmark;
  landmark.estimate.id = surveyed.id;
  landmark.estimate.mean = landmark.last_seen = surveyed.position;
  const double sigma = surveyed.sigma > 0.0 ? surveyed.sigma : kSurveyedSigma;
  landmark.estimate.covariance = sigma * sigma * Eigen::Matrix2d::Identity();
  landmark.estimate.held = 1.0;
  landmark.estimate.log_odds = FastSlamOptions().association.largest_log_odds;
  return landmark;
}

class ListReader {
 public:
  explicit ListReader(const std::string& path) : path_(path) {
    text_file::open("landmark list", path, &stream_);
  }

  [[noreturn]] void refuse(const std::string& fault) const {
    throw Error("landmark list " + path_ + ", line " + std::to_string(lines_) + ": " + fault +
                "; see the format in doc/saved_files.md");
  }

  /// The next line with anything on it, word by word; false at the end.
  bool take(std::vector<std::string>* words) {
    std::string line;
    for (++lines_; std::getline(stream_, line); ++lines_) {
      words->clear();
      line.erase(std::min(line.find('#'), line.size()));
      if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
      for (std::size_t begin = 0; begin <= line.size();) {
        const std::size_t end = std::min(line.find(',', begin), line.size());
        words->push_back(trimmed(line.substr(begin, end - begin)));
        begin = end + 1;
      }
      return true;
    }
    if (stream_.bad()) refuse("it cannot be read on");
    return false;
  }

 private:
  static std::string trimmed(const std::string& text) {
    const std::size_t begin = text.find_first_not_of(" \t\r");
    if (begin == std::string::npos) return {};
    return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
  }

  std::string path_;
  std::ifstream stream_;
  std::int64_t lines_ = 0;
};

// For each of kColumns where it stands; kNone if it does not.
std::vector<std::size_t> columns_of(const ListReader& reader,
                                    const std::vector<std::string>& header) {
  std::vector<std::size_t> places(kColumns.size(), kNone);
  for (std::size_t i = 0; i < header.size(); ++i) {
    const auto known = std::find(kColumns.begin(), kColumns.end(), header[i]);
    if (known == kColumns.end()) {
      // What it is instead is not said: the file may be none of ours.
      reader.refuse("column " + std::to_string(i + 1) + " is not one of id, x, y, sigma");
    }
    std::size_t& place = places[static_cast<std::size_t>(known - kColumns.begin())];
    if (place != kNone) reader.refuse("column " + header[i] + " is there twice");
    place = i;
  }
  for (std::size_t k = 0; k < kColumns.size(); ++k) {
    if (places[k] == kNone && k < kSigma) {
      reader.refuse(std::string("there is no column ") + kColumns[k]);
    }
  }
  return places;
}

// It begins with a brace; until version 2 with its name.
bool is_map_file(const std::string& path) {
  std::ifstream stream;
  text_file::open("map file", path, &stream);
  std::string word;
  stream >> word;
  return word.rfind('{', 0) == 0 || word == "pf_resampling";
}

}  // namespace

SavedMap surveyed_map(const std::vector<SurveyedLandmark>& landmarks, const std::string& frame) {
  SavedMap map;
  map.frame = frame;
  map.association = DataAssociation::known;
  for (const SurveyedLandmark& landmark : landmarks) map.landmarks.push_back(saved(landmark));
  std::stable_sort(
      map.landmarks.begin(), map.landmarks.end(),
      [](const SavedLandmark& a, const SavedLandmark& b) { return a.estimate.id < b.estimate.id; });
  if (!map.landmarks.empty()) map.next_id = map.landmarks.back().estimate.id + 1;
  check_saved_map(map);
  return map;
}

SavedMap read_landmark_list(const std::string& path, const std::string& frame) {
  ListReader reader(path);
  std::vector<std::string> words;
  if (!reader.take(&words)) reader.refuse("there is no header line id,x,y");
  const std::vector<std::size_t> columns = columns_of(reader, words);
  const std::size_t width = words.size();
  std::vector<SurveyedLandmark> landmarks;
  std::set<std::int64_t> ids;
  while (reader.take(&words)) {
    if (words.size() != width) {
      reader.refuse("there are " + std::to_string(words.size()) + " values, not " +
                    std::to_string(width) + " as in the header");
    }
    SurveyedLandmark landmark;
    std::array<double, kColumns.size()> values{};
    for (std::size_t k = 0; k < kColumns.size(); ++k) {
      if (columns[k] == kNone) continue;
      const std::string& word = words[columns[k]];
      const bool is_number = k == 0 ? text_file::parse(word, map_checks::kLargestId, &landmark.id)
                                    : text_file::parse(word, &values[k]);
      if (!is_number) {
        reader.refuse(text_file::printable(word) + " is no " + kColumns[k]);
      }
    }
    if (!ids.insert(landmark.id).second) {
      reader.refuse("landmark " + std::to_string(landmark.id) + " is there twice");
    }
    landmark.position << values[1], values[2];
    if (values[kSigma] < 0.0) reader.refuse("sigma is negative; it is a standard deviation in m");
    landmark.sigma = values[kSigma];
    const std::string fault = map_checks::fault_of(saved(landmark), -1);
    if (!fault.empty()) reader.refuse(fault);
    landmarks.push_back(landmark);
  }
  if (landmarks.empty()) reader.refuse("there are no landmarks");
  return surveyed_map(landmarks, frame);
}

SavedMap read_map(const std::string& path, const std::string& frame) {
  return is_map_file(path) ? read_map_file(path) : read_landmark_list(path, frame);
}

}  // namespace pf_resampling
