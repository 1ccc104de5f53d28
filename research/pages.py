"""The pages doc/studies/recordings.html and faults.html: what data/page_NAME.yaml says, with tables from the figures in doc/data."""
from report_document import Document
from report_measures import TOO_LARGE, read_data

RECORDINGS = ("robot 1", "robot 2", "robot 3", "reference world")


def with_error(estimate, decimals, factor=1.0):
    """mean ± standard error; a dash without values."""
    if estimate is None:
        return "–"
    mean = factor * estimate["mean"]
    if mean > TOO_LARGE:
        return f"> {TOO_LARGE:.0f}"
    return f"{mean:.{decimals}f}" + (f' ± {factor * estimate["standard_error"]:.{decimals}f}' if estimate["count"] > 1 else "")


def number(value, decimals):
    return "–" if value is None else f"> {TOO_LARGE:.0f}" if value > TOO_LARGE else f"{value:.{decimals}f}"


def listed(rows, name, decimals=3, factor=1.0):
    """The same figure of several rows, or its mean; a dash for those that have none."""
    values = [row.get(name) for row in rows]
    values = [value["mean"] if isinstance(value, dict) else value for value in values]
    return ", ".join(number(value and factor * value, decimals) for value in values)


def row_named(rows, name):
    """The row of a list that has this name."""
    return next(row for row in rows if row["name"] == name)


class Page(Document):
    """What data/page_NAME.yaml lays out, with the figures of doc/data."""

    def __init__(self, name, data):
        layout = read_data(f"page_{name}")
        super().__init__(layout["title"])
        self.data, park = data, data["victoria_park"]
        self.numbers = {"redraw": park["medians"]["redraw"], "fast": park["medians"]["resampling, 1000 particles"],
                        "least_squares": park["least_squares"]}
        self.lay_out(layout["page"])

    def add_text(self, text):
        super().add_text(text.format(**self.numbers))

    def add_picture(self, given):
        self.add_figure(**given)

    def add_strategies(self):
        """Every cell: robots 1, 2, 3 and the reference world."""
        def cells(row):
            of = [row[recording] for recording in RECORDINGS]
            return [row["name"], *(listed(of, name) for name in ("online_raw", "online", "path", "landmarks")),
                    listed(of, "poses_inside", 0, 100.0), listed(of, "poses_nees", 1), listed(of, "landmarks_inside", 0, 100.0),
                    listed(of, "landmarks_nees", 1), listed(of, "ancestors", 0), listed(of, "processor_s", 1),
                    f'{sum(each["diverged"] for each in of)} of {sum(each["runs"] for each in of)}']

        found = self.data["recordings"]
        bounds = [row_named(found["bounds"], recording) for recording in RECORDINGS]
        last = ["**least squares**", *(listed(bounds, name) for name in ("online_raw", "online", "path", "landmarks")), *[""] * 7]
        self.add_rows("Every strategy; each cell: robots 1, 2, 3 of MRCLAM 6 and the reference world",
                      ["Strategy", "Online, raw (m)", "Online, aligned (m)", "Final path (m)", "Landmarks (m)", "Poses inside (%)",
                       "NEES, poses", "Landmarks inside (%)", "NEES, landmarks", "Ancestors", "Processor (s)", "Diverged"],
                      [*(cells(row) for row in found["strategies"]), last])

    def add_without_ids(self):
        rows = []
        for row in self.data["recordings"]["without_ids"]:
            robot = row["name"].split(", ")[-1]
            bound = row_named(self.data["recordings"]["bounds"], robot)["path"]
            rows.append([row["strategy"], robot.split()[-1], f'{row["diverged"]} of {row["runs"]}',
                         with_error(row.get("online"), 3), with_error(row.get("path"), 3), f'{row["path"]["mean"] / bound:.2f}',
                         number(row.get("path_worst"), 3), with_error(row.get("landmarks"), 3),
                         ", ".join(f"{runs} × {count}" for count, runs in row.get("counts", []))])
        self.add_rows("Without ids", ["Strategy", "Robot", "Diverged", "Online, aligned (m)", "Final path (m)", "Over least squares",
                                      "Worst seed (m)", "Landmarks (m)", "Landmarks (false)"], rows, texts=(0, 8))

    def add_victoria_park(self):
        self.add_rows("Victoria Park", ["Strategy", "Seed", "Median distance to GPS (m)", "Final path, mean (m)", "Landmarks",
                                        "Processor (s)", "Peak memory (MiB)"],
                      [[row["strategy"], str(row["seed"]), number(row["median"], 2), number(row["path"], 2), str(row["map_size"]),
                        number(row["processor_s"], 0), str(row["peak_memory_mib"])] for row in self.data["victoria_park"]["rows"]])

    def add_recording(self, key_and_title):
        key, title = key_and_title
        study = self.data["faults"][key]
        self.add_section(key_and_title)
        self.add_text(f'The bound is {study["lost_error"]:.2f} m.')
        rows = [[row["fault"], *(number(row[figure], 2) for figure in ("mean", "largest", "at_end")),
                 f'{row["recovered"]} of {study["seeds"]}',
                 *(number(100.0 * row[figure], 1) for figure in ("healthy", "wrong_when_healthy")),
                 f'`{row["finding"]}`, {row["found"]}' if row["found"] else "–"] for row in study["summary"]]
        self.add_rows(title, ["Fault", "Mean (m)", "Largest (m)", "At the end (m)", "Recovered", "Healthy (%)",
                              "Healthy, yet outside (%)", "Finding, runs"], rows, texts=(0, 7))


PAGES = ("recordings", "faults")
