// Maps that were not found by a filter: lists of landmarks.

#include <algorithm>
#include <set>
#include <sstream>

#include "pf_resampling_core/error.hpp"
#include "pf_resampling_core/files/text_file.hpp"
#include "pf_resampling_core/filters/fastslam/map_checks.hpp"
#include "pf_resampling_core/filters/fastslam/saved_map.hpp"

namespace pf_resampling {
namespace {

constexpr double kSurveyedSigma = 0.001;  // m
constexpr const char* kBlanks = " \t\r";

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

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

// What stands between the commas of a line, without its comment; nothing if it is empty.
std::vector<std::string> words_of(const std::string& line) {
  std::vector<std::string> words;
  const std::string content = line.substr(0, line.find('#'));
  if (trimmed(content).empty()) return words;
  std::istringstream stream(content + ',');
  for (std::string word; std::getline(stream, word, ',');) words.push_back(trimmed(word));
  return words;
}

// In words; nothing if all is well.
std::string fault_of_header(const std::vector<std::string>& header) {
  std::set<std::string> missing = {"id", "x", "y", "sigma"};
  const std::set<std::string> known = missing;
  for (std::size_t i = 0; i < header.size(); ++i) {
    if (known.count(header[i]) == 0) {
      // What it is instead is not said: the file may be none of ours.
      return "column " + std::to_string(i + 1) + " is not one of id, x, y, sigma";
    }
    if (missing.erase(header[i]) == 0) return "column " + header[i] + " is there twice";
  }
  missing.erase("sigma");
  return missing.empty() ? "" : "there is no column " + *missing.begin();
}

// Reads a line with as many words as the header. In words; nothing if all is well.
std::string fault_of_line(const std::vector<std::string>& header,
                          const std::vector<std::string>& words, SurveyedLandmark* landmark) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& name = header[i];
    double* const number = name == "x"   ? &landmark->position.x()
                           : name == "y" ? &landmark->position.y()
                                         : &landmark->sigma;
    const bool is_number = name == "id"
                               ? text_file::parse(words[i], map_checks::kLargestId, &landmark->id)
                               : text_file::parse(words[i], number);
    if (!is_number) return text_file::printable(words[i]) + " is no " + name;
  }
  if (landmark->sigma < 0.0) return "sigma is negative; it is a standard deviation in m";
  return map_checks::fault_of(saved(*landmark), -1);
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
  std::ifstream stream;
  text_file::open("landmark list", path, &stream);
  std::int64_t number = 1;
  const auto refuse_if = [&](const std::string& fault) {
    if (fault.empty()) return;
    throw Error("landmark list " + path + ", line " + std::to_string(number) + ": " + fault +
                "; see the format in doc/saved_files.md");
  };
  std::vector<std::string> header;
  std::vector<SurveyedLandmark> landmarks;
  std::set<std::int64_t> ids;
  for (std::string line; std::getline(stream, line); ++number) {
    const std::vector<std::string> words = words_of(line);
    if (words.empty()) continue;
    if (header.empty()) {
      refuse_if(fault_of_header(words));
      header = words;
      continue;
    }
    if (words.size() != header.size()) {
      refuse_if("there are " + std::to_string(words.size()) + " values, not " +
                std::to_string(header.size()) + " as in the header");
    }
    SurveyedLandmark landmark;
    refuse_if(fault_of_line(header, words, &landmark));
    if (!ids.insert(landmark.id).second) {
      refuse_if("landmark " + std::to_string(landmark.id) + " is there twice");
    }
    landmarks.push_back(landmark);
  }
  if (stream.bad()) refuse_if("it cannot be read on");
  if (header.empty()) refuse_if("there is no header line id,x,y");
  if (landmarks.empty()) refuse_if("there are no landmarks");
  return surveyed_map(landmarks, frame);
}

SavedMap read_map(const std::string& path, const std::string& frame) {
  return is_map_file(path) ? read_map_file(path) : read_landmark_list(path, frame);
}

}  // namespace pf_resampling
