// Recordings in the formats of others: refused in one line that names the file, or a bag.
#include "pf_resampling_core/error.hpp"
#include "test/fuzz/fuzz_target.hpp"
#include "test/fuzz/saved_text.hpp"
#include "tools/datasets/csv.hpp"
#include "tools/datasets/mrclam.hpp"
#include "tools/datasets/plaza.hpp"
#include "tools/datasets/recording_to_bag.hpp"
#include "tools/worlds/map_file.hpp"

namespace pf_resampling::fuzz {
namespace {

template <typename Read>
void read_and_write(const Read& read) {
  try {
    const Recording recording = read();
    report(recording);
    write_recording(recording, new_file("recording.bag"));
  } catch (const Error& error) {
    require_one_line(error);
  }
}

}  // namespace

void csv_dataset(const std::uint8_t* bytes, std::size_t size) {
  const std::string folder = folder_of(
      text_of(bytes, size), {"odometry.csv", "ranges.csv", "beacons.csv", "frames.csv",
                             "landmark_observations.csv", "landmarks.csv", "ground_truth.csv"});
  read_and_write([&] { return read_csv(folder, 1.0); });
}

void mrclam_dataset(const std::uint8_t* bytes, std::size_t size) {
  const std::string folder = folder_of(
      text_of(bytes, size), {"Barcodes.dat", "Robot1_Odometry.dat", "Robot1_Measurement.dat",
                             "Robot1_Groundtruth.dat", "Landmark_Groundtruth.dat"});
  read_and_write([&] { return read_mrclam(folder, {}); });
}

void mat_dataset(const std::uint8_t* bytes, std::size_t size) {
  const std::string path = file_of(text_of(bytes, size), "input.mat");
  read_and_write([&] { return read_plaza(path, {}); });
  try {
    check_world(load_map(path));
  } catch (const Error& error) {
    require_one_line(error);
  }
}

}  // namespace pf_resampling::fuzz
