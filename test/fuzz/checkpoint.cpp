// Checkpoints of both filters: what is read can be written, read again and gone on from.
#include "src/checkpoint/checkpoint.hpp"

#include "pf_resampling_core/error.hpp"
#include "test/beacon_mcl_rig.hpp"
#include "test/fastslam_rig.hpp"
#include "test/fuzz/fuzz_target.hpp"
#include "test/fuzz/saved_text.hpp"

namespace pf_resampling::fuzz {
namespace {

template <typename AnyRig>
void resume(const typename AnyRig::Checkpoint& checkpoint) {
  auto options = AnyRig::Drive::options();
  options.filter.particles = 20;
  AnyRig run(options);
  if (AnyRig::kTopic == Rig::kTopic) run.feed(AnyRig::Drive::messages(0.0));
  try {
    run.pipeline.resume(checkpoint);
  } catch (const Error& error) {
    require_one_line(error);
    return;
  }
  run.feed(AnyRig::Drive::messages(1.0, 2.0));
  require(all_finite(run.out), "a checkpoint that was taken makes something that is not finite");
}

struct BeaconMclResumed : Rig {
  using Rig::Rig;
  using Checkpoint = BeaconMclCheckpoint;
};
struct FastSlamResumed : FastSlamRig {
  using FastSlamRig::FastSlamRig;
  using Checkpoint = FastSlamCheckpoint;
};

template <typename AnyRig, typename Read>
void read_and_resume(const std::string& path, const Read& read) {
  typename AnyRig::Checkpoint checkpoint;
  try {
    checkpoint = read(path);
  } catch (const Error& error) {
    require_one_line(error);
    return;
  }
  const std::string copy = new_file("copy");
  write_checkpoint(copy, checkpoint);
  read(copy);
  resume<AnyRig>(checkpoint);
}

}  // namespace

void checkpoint(const std::uint8_t* bytes, std::size_t size) {
  const std::string content = text_of(bytes, size);
  const std::string path = file_of(with_first_line(kCheckpointFile, content));
  read_and_resume<BeaconMclResumed>(path, read_beacon_mcl_checkpoint);
  read_and_resume<FastSlamResumed>(path, read_fastslam_checkpoint);
}

}  // namespace pf_resampling::fuzz
