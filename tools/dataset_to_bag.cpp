// dataset_to_bag: public data sets and CSV files as bags. See tools/datasets for the formats.
#include <cmath>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "tools/common/command_line.hpp"
#include "tools/datasets/csv.hpp"
#include "tools/datasets/labyrinth.hpp"
#include "tools/datasets/mrclam.hpp"
#include "tools/datasets/plaza.hpp"
#include "tools/datasets/recording_to_bag.hpp"
#include "tools/datasets/victoria_park.hpp"

namespace {

using namespace pf_resampling;
namespace po = boost::program_options;

const char* const kHelp =
    "Usage: rosrun pf_resampling dataset_to_bag FORMAT IN out.bag [options]\n"
    "\n"
    "Makes a bag of a recording, with odometry, ranges, beacons, landmarks, truth and tf as far "
    "as\n"
    "the recording has them.\n"
    "\n"
    "Formats (dataset_to_bag FORMAT --help says more):\n"
    "  plaza          MATLAB files of the CMU range-only data sets (Plaza, Gesling, Kurth)\n"
    "  labyrinth      text files of TU Chemnitz (Labyrinth, UWB)\n"
    "  mrclam         text files of UTIAS (multi-robot data sets 1 to 9), one robot\n"
    "  victoria_park  text and MATLAB files of Sydney (Victoria Park), trees already found\n"
    "  csv            a directory with CSV files of your own\n";

const char* const kFormats = "plaza, labyrinth, mrclam, victoria_park and csv";

double metres_per(const std::string& unit) {
  if (unit == "m") return 1.0;
  if (unit == "ft") return kMetresPerFoot;
  throw UsageError("--range-unit " + unit + ": known are m and ft");
}

/// "x,y,z" is for all antennas, "N:x,y,z" for the one of that number in the file.
std::map<int, Recording::Frame> antennas_from(const std::vector<std::string>& places) {
  std::map<int, Recording::Frame> antennas;
  for (const std::string& place : places) {
    const std::size_t colon = place.find(':');
    int number = -1;
    if (colon != std::string::npos) {
      number = static_cast<int>(parse_numbers("antenna", place.substr(0, colon), 1)[0]);
    }
    const std::string where = colon == std::string::npos ? place : place.substr(colon + 1);
    const std::vector<double> xyz = parse_numbers("antenna", where, 3);
    antennas[number] = {"antenna", xyz[0], xyz[1], xyz[2], 0.0};
  }
  return antennas;
}

int write_and_report(const Recording& recording, const std::string& in, const std::string& out) {
  write_recording(recording, out);
  std::cout << in << "\n" << report(recording) << "wrote " << out << "\n";
  return 0;
}

int plaza(const std::vector<std::string>& arguments) {
  CommandLine line("dataset_to_bag plaza",
                   "Makes a bag of a MATLAB file with the variables DR [t distance dheading], TD\n"
                   "[t antenna beacon range], TL [beacon x y] and GT [t x y heading].");
  line.positional("FILE.mat", "the file to read");
  line.positional("out.bag", "the bag to write");
  line.options()("range-unit", po::value<std::string>()->value_name("m|ft"),
                 "unit of the ranges; without it, it is found from the true distances");
  line.repeatable_option(
      "antenna", "[N:]x,y,z",
      "where the antenna (of number N) sits on the robot, m; may be given several times");
  line.example("dataset_to_bag plaza Plaza2.mat plaza2.bag");
  line.example("dataset_to_bag plaza kurth.mat kurth.bag --range-unit ft --antenna 0.2,0,0.5");
  if (!line.parse(arguments)) return 0;
  PlazaOptions options;
  if (line.has("range-unit")) {
    options.metres_per_unit = metres_per(line.get<std::string>("range-unit"));
  }
  if (line.has("antenna")) {
    options.antennas = antennas_from(line.get<std::vector<std::string>>("antenna"));
  }
  const std::string in = line.get<std::string>("FILE.mat");
  return write_and_report(read_plaza(in, options), in, line.get<std::string>("out.bag"));
}

int labyrinth(const std::vector<std::string>& arguments) {
  CommandLine line("dataset_to_bag labyrinth",
                   "Makes a bag of a directory with one file *Input.txt (lines range2 and\n"
                   "odom2diff) and, if there is truth, one *GT.txt (lines point2).");
  line.positional("DIRECTORY", "the directory to read");
  line.positional("out.bag", "the bag to write");
  line.example("dataset_to_bag labyrinth labyrinth_uwb labyrinth.bag");
  if (!line.parse(arguments)) return 0;
  const std::string in = line.get<std::string>("DIRECTORY");
  return write_and_report(read_labyrinth(in), in, line.get<std::string>("out.bag"));
}

int mrclam(const std::vector<std::string>& arguments) {
  CommandLine line("dataset_to_bag mrclam",
                   "Makes a bag of what one robot of a directory with Robot<n>_Odometry.dat,\n"
                   "Robot<n>_Measurement.dat, Barcodes.dat and, if there is truth,\n"
                   "Robot<n>_Groundtruth.dat and Landmark_Groundtruth.dat recorded. Landmark ids\n"
                   "are subject numbers, from 6; observations of robots are left out.");
  line.positional("DIRECTORY", "the directory to read");
  line.positional("out.bag", "the bag to write");
  line.options()("robot", po::value<int>()->default_value(1)->value_name("N"), "whose recording")(
      "odometry-delay", po::value<double>()->default_value(0.0)->value_name("SECONDS"),
      "added to the times of the odometry; on data set 6 the truth follows it by 0.2 s");
  line.example("dataset_to_bag mrclam MRCLAM_Dataset6 robot1.bag --robot 1");
  if (!line.parse(arguments)) return 0;
  MrclamOptions options;
  options.robot = line.get<int>("robot");
  options.odometry_delay = line.get<double>("odometry-delay");
  if (!(std::abs(options.odometry_delay) <= 10.0)) {
    throw UsageError("--odometry-delay has to be between -10 and 10 s");
  }
  const std::string in = line.get<std::string>("DIRECTORY");
  return write_and_report(read_mrclam(in, options), in, line.get<std::string>("out.bag"));
}

int victoria_park(const std::vector<std::string>& arguments) {
  CommandLine line(
      "dataset_to_bag victoria_park",
      "Makes a bag of a directory with time.txt, speed.txt and steering.txt (or\n"
      "aa3_dr.mat), lasersampling.txt, ObservationDistance.txt, ObservationAngle.txt\n"
      "and, if there is truth, aa3_gpsx.mat. base_link is the middle of the rear axle.");
  line.positional("DIRECTORY", "the directory to read");
  line.positional("out.bag", "the bag to write");
  line.example("dataset_to_bag victoria_park victoria_park victoria_park.bag");
  if (!line.parse(arguments)) return 0;
  const std::string in = line.get<std::string>("DIRECTORY");
  return write_and_report(read_victoria_park(in), in, line.get<std::string>("out.bag"));
}

int csv(const std::vector<std::string>& arguments) {
  CommandLine line(
      "dataset_to_bag csv",
      "Makes a bag of a directory with any of\n"
      "  odometry.csv               t,x,y,heading or t,distance,dheading or t,v,omega\n"
      "  ranges.csv                 t,beacon,range[,variance]\n"
      "  beacons.csv                beacon,x,y[,z]\n"
      "  landmark_observations.csv  t,id,range,bearing[,range_variance,bearing_variance]\n"
      "  landmarks.csv              id,x,y\n"
      "  ground_truth.csv           t,x,y[,heading]\n"
      "  frames.csv                 frame,x,y[,z][,yaw]: where antenna or sensor sits on the "
      "robot\n"
      "The first line names the columns, in any order; # begins a comment. Seconds, metres and\n"
      "radians; id -1: unknown; variance 0: unknown. distance and dheading are since the row\n"
      "before; v and omega hold until the next row.");
  line.positional("DIRECTORY", "the directory to read");
  line.positional("out.bag", "the bag to write");
  line.options()("range-unit", po::value<std::string>()->default_value("m")->value_name("m|ft"),
                 "unit of the measured ranges");
  line.example("dataset_to_bag csv my_recording my_recording.bag");
  if (!line.parse(arguments)) return 0;
  const double metres_per_unit = metres_per(line.get<std::string>("range-unit"));
  const std::string in = line.get<std::string>("DIRECTORY");
  return write_and_report(read_csv(in, metres_per_unit), in, line.get<std::string>("out.bag"));
}

int dataset_to_bag(const std::vector<std::string>& arguments) {
  if (arguments.empty()) {
    throw UsageError(std::string("missing FORMAT: one of ") + kFormats + " (--help says more)");
  }
  const std::vector<std::string> rest(arguments.begin() + 1, arguments.end());
  if (arguments[0] == "--help" || arguments[0] == "-h") {
    std::cout << kHelp;
    return 0;
  }
  if (arguments[0] == "plaza") return plaza(rest);
  if (arguments[0] == "labyrinth") return labyrinth(rest);
  if (arguments[0] == "mrclam") return mrclam(rest);
  if (arguments[0] == "victoria_park") return victoria_park(rest);
  if (arguments[0] == "csv") return csv(rest);
  throw UsageError("unknown format " + arguments[0] + ": known are " + kFormats);
}

}  // namespace

int main(int argc, char** argv) {
  return run_tool("dataset_to_bag", argc, argv, dataset_to_bag);
}
