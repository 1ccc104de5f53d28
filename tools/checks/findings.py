"""Which filter can use a bag, by which command, and what is odd in it."""
import re
import shlex
from collections import Counter
from dataclasses import dataclass, field

from command_line import answer_of
from filter_setup import FILTERS

from .survey import LANDMARK_TYPES, ODOMETRY_TYPES, RANGE_TYPES, survey_of, unit_of_ranges

BEACONS = "pf_resampling/BeaconArray"
TOPICS_OF = {"beacon_mcl": ("odom", "imu", "ranges", "sensor_ranges", "beacons"), "fastslam": ("odom", "imu", "landmarks")}


@dataclass
class Verdict:
    """Whether a filter can run on a bag."""
    filter: str
    problems: list = field(default_factory=list)  # why it cannot, a line each
    advice: list = field(default_factory=list)  # options of check_bag and run_bag that could mend a problem each
    command: str = ""  # what runs it, with the options that this bag needs

    def text(self):
        return f"ready for {self.filter}: " + (f"no: {'; '.join(self.problems)}" if self.problems else "yes")

    def is_worth_a_try(self):
        """Whether what is advised could mend all that is wrong."""
        return 0 < len(self.problems) == len(self.advice)


class Checker:
    def __init__(self, bag, topics, usual, setup):
        self.bag, self.topics, self.usual, self.setup = bag, topics, usual, setup
        self.survey = survey_of(bag, topics, setup)
        self.verdicts = {name: Verdict(name) for name in FILTERS}
        self.remarks = []
        self.settings = list(setup.words)  # options of run_bag: those given, and for frames of other names

    def remark(self, text):
        if text not in self.remarks:
            self.remarks.append(text)

    def blame(self, problem, filters=FILTERS):
        for name in filters:
            self.verdicts[name].problems.append(problem)

    def advise(self, words, filters=FILTERS):
        for advice in (self.verdicts[name].advice for name in filters):
            advice += [words] * (words not in advice)

    def check(self):
        for name, fault in self.setup.faults.items():
            self.blame(fault, [name])
        self.check_presence()
        self.check_frames()
        for name, verdict in self.verdicts.items():
            if not verdict.problems:
                self.run(name, verdict)
            verdict.command = " ".join(map(shlex.quote, ["rosrun", "pf_resampling", "run_bag", name, self.bag.name, "out.bag",
                                                         *self.options_of(name), *self.settings]))
        return self

    def options_of(self, name):
        return [word for role in TOPICS_OF[name] if getattr(self.topics, role) != getattr(self.usual, role)
                for word in (f"--{role.replace('_', '-')}", getattr(self.topics, role))]

    # ---- what is there ----

    def need(self, role, types, filters=FILTERS, instead=""):
        """no /odom ..., /robot/odom could be it"""
        name, known = getattr(self.topics, role), self.survey.types
        if known.get(name) in types:
            return
        problem = (f"{name} is a {known[name]}" if name in known else f"no {name}") + f" (needed: {types[0]})"
        # Ground truth and what filters say are poses, too.
        outputs = self.topics.ground_truth, "/pose", "/initialpose", "/amcl_pose"
        others = [other for other, kind in known.items() if kind in types and other != name and other not in outputs]
        if others and not instead:
            self.advise([f"--{role}", others[0]], filters)
        problem += "".join(f", {other} could be it (--{role} {other}; for the node {role}:={other})" for other in others)
        self.blame(problem + instead, filters)

    def check_presence(self):
        survey, value, known = self.survey, self.setup.value, self.survey.types
        if value("odometry_input/source") != "tf":
            self.need("odom", ODOMETRY_TYPES, instead=self.odometry_on_tf())
        elif not survey.base_frames:
            self.blame(f"nothing on /tf says where '{value('frames/base')}' is in '{value('frames/odom')}'")
        self.check_imu()
        if survey.ranges == self.topics.ranges:
            sensors = [name for name, kind in known.items() if kind == "sensor_msgs/Range"]
            if sensors and self.topics.ranges not in known:
                self.advise(["--sensor-ranges", sensors[0]], ["beacon_mcl"])
            self.need("ranges", RANGE_TYPES, ["beacon_mcl"], "".join(
                f", {name} could be it (--sensor-ranges {name}; for the node sensor_ranges:={name})" for name in sensors))
        if not self.setup.lists["beacons"]:
            self.need("beacons", [BEACONS], ["beacon_mcl"], " (or give the beacons in the configuration: --config beacons.yaml)")
        pattern = value("landmark_input/tag_pattern")
        if not pattern:
            self.need("landmarks", LANDMARK_TYPES, ["fastslam"], self.tags_instead())
        elif not survey.has_tags and self.topics.landmarks not in known:
            self.blame(f"no {self.topics.landmarks}, and no frame in /tf has a name that fits landmark_input/tag_pattern {pattern}",
                       ["fastslam"])

    def odometry_on_tf(self):
        """Transforms that could be odometry, where there is no such topic."""
        known, (odom, base, space) = self.survey.types, [self.setup.value(f"frames/{name}") for name in ("odom", "base", "map")]
        if self.topics.odom in known or "nav_msgs/Odometry" in [
                kind for name, kind in known.items() if name != self.topics.ground_truth]:
            return ""
        for parent, child in sorted(self.survey.transforms):
            if child in (base, "base_footprint") and parent != space:
                words = ["--set", "odometry_input/source=tf", *["--set", f"frames/odom={parent}"] * (parent != odom),
                         *["--set", f"frames/base={child}"] * (child != base)]
                self.advise(words)
                return f", '{parent}' -> '{child}' on /tf could be it ({' '.join(map(shlex.quote, words))})"
        return ""

    def check_imu(self):
        if self.setup.value("odometry_input/imu_heading") != "none":
            return self.need("imu", ["sensor_msgs/Imu"])
        for name, kind in self.survey.types.items():
            if kind == "sensor_msgs/Imu":
                option = "" if name == self.usual.imu else f"--imu {name} "
                self.remark(f"{name} is an IMU: {option}--set odometry_input/imu_heading=yaw_rate takes the turns from it, "
                            "orientation its heading, if it has a good one")

    def tags_instead(self):
        """What frames with a number in /tf could be, as detectors of tags publish them."""
        if self.topics.landmarks in self.survey.types:
            return ""
        for parent, child in sorted(self.survey.transforms):
            match = re.fullmatch(r"(.*\D)[0-9]+", child)
            if match and parent != "map" and parent not in self.survey.odometry_frames | self.survey.base_frames:
                setting = f"landmark_input/tag_pattern={match.group(1)}(\\d+)"
                self.advise(["--set", setting], ["fastslam"])
                return f", '{child}' on /tf could be a tag (--set {shlex.quote(setting)})"
        return ""

    # ---- what is odd ----

    def check_frames(self):
        odom = self.survey.odometry_frames
        for frames, name in ((odom, "odom"), (self.survey.base_frames, "base"), ({self.survey.beacon_frame}, "map")):
            usual = self.setup.value(f"frames/{name}")
            for frame in sorted(frames - {"", usual}):
                self.remark(f"frame '{frame}' instead of '{usual}': set the parameter frames/{name} to it")
                if len(frames) == 1:
                    self.settings += ["--set", f"frames/{name}={frame}"]
        for parent, child in sorted(self.survey.transforms):
            if child in odom:
                self.remark(f"/tf places '{child}' in '{parent}': that is from another localization; leave it out when you play "
                            "the bag")

        if "" in self.survey.base_frames:
            self.remark(f"{self.topics.odom} names no child_frame_id: it is taken as that of '{self.setup.value('frames/base')}' "
                        "(frames/base)")
        antennas, named = sorted(str(each["frame"]) for each in self.setup.lists["antennas"]), self.survey.range_frames
        if antennas and named and named.isdisjoint(antennas):
            self.remark(f"the list `antennas` places '{antennas[0]}', but {self.survey.ranges} is measured from "
                        f"{', '.join(sorted(named))}: --set range_input/antenna={antennas[0]} says that it is (for drivers that "
                        "name no frame)")

    def run(self, name, verdict):
        """A dry run of the filter tells what it can use."""
        said = answer_of("run_bag", [name, self.bag.name, "--dry-run", *self.options_of(name), *self.settings])
        if not said["used"]:
            verdict.problems.append(said["why_none"])
            return
        for line in said["remarks"]:
            self.remark(line)
        (self.check_ranges if name == "beacon_mcl" else self.check_ids)(said["observed"])

    def check_ranges(self, measured):
        heard = {beacon for _, beacon, _ in measured}
        if 0 < len(heard) < 3:
            self.remark(f"ranges to only {len(heard)} known beacons: the pose may stay ambiguous")
        unit = unit_of_ranges(measured, self.survey.beacons)
        if unit:
            self.blame(f"{self.survey.ranges}: ranges are about {unit[0]} for the distances between the beacons, as if {unit[1]}: "
                       "both have to be in metres", ["beacon_mcl"])

    def check_ids(self, ids):
        topic = "/tf (tags)" if self.survey.has_tags else self.topics.landmarks
        if max(ids, default=0) < 0:
            self.remark(f"{topic}: without ids; the filter associates them by their positions")
        elif ids and max(Counter(each for each in ids if each >= 0).values()) == 1:
            self.remark(f"{topic}: no id is seen twice, so no landmark can correct the odometry (association/method "
                        "mutual_exclusion ignores ids)")
