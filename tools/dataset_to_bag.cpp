// dataset_to_bag: public data sets and CSV files as bags. See tools/datasets for the formats.
#include <filesystem>
#include <iostream>

#include "tools/common/bag.hpp"
#include "tools/common/table.hpp"
#include "tools/datasets/dataset_format.hpp"
#include "tools/datasets/recording_to_bag.hpp"

namespace pf_resampling {

// Each is in a file of that name in tools/datasets. Add yours here and to the list.
DatasetFormat plaza_format();
DatasetFormat labyrinth_format();
DatasetFormat mrclam_format();
DatasetFormat victoria_park_format();
DatasetFormat csv_format();

namespace {

std::vector<DatasetFormat> all_formats() {
  return {plaza_format(), labyrinth_format(), mrclam_format(), victoria_park_format(),
          csv_format()};
}

/// "plaza, labyrinth and csv".
std::string names_of(const std::vector<DatasetFormat>& formats) {
  std::vector<std::string> names;
  for (const DatasetFormat& format : formats) names.push_back(format.name);
  const std::string last = names.back();
  names.pop_back();
  return joined(names, ", ") + " and " + last;
}

std::string help(const std::vector<DatasetFormat>& formats) {
  std::string text =
      "Usage: rosrun pf_resampling dataset_to_bag FORMAT IN out.bag [options]\n"
      "\n"
      "Makes a bag of a recording, with odometry, ranges, beacons, landmarks, truth and tf as far "
      "as\n"
      "the recording has them.\n"
      "\n"
      "Formats (dataset_to_bag FORMAT --help says more):\n";
  for (const DatasetFormat& format : formats) {
    text += "  " + format.name + std::string(15 - format.name.size(), ' ') + format.line + "\n";
  }
  return text;
}

/// The files of a directory that is read. Bags are not: they may be of an earlier run.
std::vector<FileOfRun> files_in(const std::string& directory) {
  std::vector<FileOfRun> files;
  std::error_code unknown;
  for (const auto& entry : std::filesystem::directory_iterator(directory, unknown)) {
    const std::string path = entry.path().string();
    if (entry.is_regular_file(unknown) && !begins_like_a_bag(path)) files.push_back({path, path});
  }
  return files;
}

int convert(const DatasetFormat& format, const std::vector<std::string>& arguments) {
  CommandLine line("dataset_to_bag " + format.name, format.help);
  line.positional(format.input,
                  format.input == "DIRECTORY" ? "the directory to read" : "the file to read");
  line.positional("out.bag", "the bag to write");
  line.reads(format.input);
  line.writes("out.bag");
  if (format.add_options) format.add_options(&line);
  for (const std::string& example : format.examples) line.example(example);
  if (!line.parse(arguments)) return 0;
  const std::string in = line.text(format.input);
  require_separate(line.written(), files_in(in));
  const std::string out = line.text("out.bag");
  const Recording recording = naming(in, [&] { return format.read(in, line); });
  try {
    write_and_report(recording, in, out);
  } catch (const Error& error) {
    // What is wrong with the recording is of the input.
    if (std::string(error.what()).find(out) != std::string::npos) throw;
    throw Error(in + ": " + error.what());
  }
  return 0;
}

int dataset_to_bag(const std::vector<std::string>& arguments) {
  const std::vector<DatasetFormat> formats = all_formats();
  if (arguments.empty()) {
    throw UsageError("missing FORMAT: one of " + names_of(formats) + " (--help says more)");
  }
  if (arguments[0] == "--help" || arguments[0] == "-h") {
    std::cout << help(formats);
    return 0;
  }
  for (const DatasetFormat& format : formats) {
    if (format.name != arguments[0]) continue;
    return convert(format, {arguments.begin() + 1, arguments.end()});
  }
  throw UsageError("unknown format " + arguments[0] + ": known are " + names_of(formats));
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  return pf_resampling::run_tool("dataset_to_bag", argc, argv, pf_resampling::dataset_to_bag);
}
