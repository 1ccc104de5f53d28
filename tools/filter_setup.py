"""How --config and --set configure the filters."""
import yaml
from command_line import Error, output_of

FILTERS = "beacon_mcl", "fastslam"


def words_of(config, assignments):
    """Those options again."""
    return [word for name, values in (("config", config), ("set", assignments)) for value in values for word in (f"--{name}", value)]


class Setup:
    """Their parameters and lists. Raises Error if neither filter takes them."""

    def __init__(self, config=(), assignments=()):
        self.words = words_of(config, assignments)
        self.faults, self.values, self.lists = {}, {}, {"beacons": [], "antennas": []}
        for name in reversed(FILTERS):  # the values of the former count
            try:
                self.values.update(yaml.safe_load(output_of("run_bag", [name, "--parameters", *self.words])))
            except Error as error:
                self.faults[name] = str(error)
        if len(self.faults) == len(FILTERS):
            raise Error("; ".join(f"{name}: {self.faults[name]}" for name in FILTERS))
        for path in config:
            with open(path, encoding="utf-8") as file:
                read = yaml.safe_load(file) or {}
            self.lists["beacons"] = read.get("beacons") or self.lists["beacons"]
            self.lists["antennas"] += read.get("antennas") or []
        self.frames_of_beacons = {str(each["frame"]).lstrip("/"): each["id"] for each in self.lists["beacons"] if "frame" in each}

    def value(self, name):
        return self.values.get(name, "")
