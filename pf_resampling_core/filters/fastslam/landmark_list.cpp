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
constexpr const char* kHeader = "id,x,y";
constexpr const char* kHeaderWithSigma = "id,x,y,sigma";

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

// Without its comment and blanks.
std::string content_of(const std::string& line) {
  std::string content = line.substr(0, line.find('#'));
  const auto is_blank = [](char letter) {
    return letter == ' ' || letter == '\t' || letter == '\r';
  };
  content.erase(std::remove_if(content.begin(), content.end(), is_blank), content.end());
  return content;
}

// Reads "7,10.5,2" or "7,10.5,2,0.02". In words; nothing if all is well.
std::string fault_of_line(const std::string& line, bool has_sigma, SurveyedLandmark* landmark) {
  std::istringstream words(line);
  std::string commas = ",,,";
  words >> landmark->id >> commas[0] >> landmark->position.x() >> commas[1] >>
      landmark->position.y();
  if (has_sigma) words >> commas[2] >> landmark->sigma;
  if (!words || commas != ",,," || !(words >> std::ws).eof()) {
    return std::string("an id and ") + (has_sigma ? "three" : "two") +
           " numbers expected, with commas between them";
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
  std::string header;
  std::vector<SurveyedLandmark> landmarks;
  std::set<std::int64_t> ids;
  for (std::string line; std::getline(stream, line); ++number) {
    const std::string content = content_of(line);
    if (content.empty()) continue;
    if (header.empty()) {
      // What it is instead is not said: the file may be none of ours.
      const bool is_header = content == kHeader || content == kHeaderWithSigma;
      refuse_if(is_header ? "" : "this is not the header id,x,y or id,x,y,sigma");
      header = content;
      continue;
    }
    SurveyedLandmark landmark;
    refuse_if(fault_of_line(line.substr(0, line.find('#')), header == kHeaderWithSigma, &landmark));
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
