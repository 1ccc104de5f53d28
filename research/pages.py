"""The pages doc/studies/recordings.html and faults.html: what data/page_NAME.yaml says, with tables from the figures in doc/data."""
from report_document import Bullets, Document, Heading, Picture, Table, Text
from report_measures import read_data

TOO_LARGE = 10000.0  # for a table: as the NEES of copies of one particle
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
    return "–" if value is None else f"{value:.{decimals}f}"


def listed(rows, name, decimals=3, factor=1.0):
    """The same figure of several rows; a dash for those that have none."""
    values = ((row.get(name) or {}).get("mean") if isinstance(row.get(name), dict) else row.get(name) for row in rows)
    return ", ".join("–" if value is None else f"> {TOO_LARGE:.0f}" if factor * value > TOO_LARGE
                     else number(factor * value, decimals) for value in values)


def row_named(rows, name):
    """The row of a list that has this name."""
    for row in rows:
        if name in (row.get("filter"), row.get("fault"), row.get("name")):
            return row
    raise KeyError(name)


# ---- recordings -----------------------------------------------------------------------------------------------------


def strategies(data):
    """Every cell: robots 1, 2, 3 and the reference world."""
    def cells(row):
        of = [row[recording] for recording in RECORDINGS]
        return [row["name"], listed(of, "online_raw"), listed(of, "online"), listed(of, "path"), listed(of, "landmarks"),
                listed(of, "poses_inside", 0, 100.0), listed(of, "poses_nees", 1), listed(of, "landmarks_inside", 0, 100.0),
                listed(of, "landmarks_nees", 1), listed(of, "ancestors", 0), listed(of, "processor_s", 1),
                f'{sum(each["diverged"] for each in of)} of {sum(each["runs"] for each in of)}']

    found = data["recordings"]
    bounds = [row_named(found["bounds"], recording) for recording in RECORDINGS]
    last = ["**least squares**", *(listed(bounds, name) for name in ("online_raw", "online", "path", "landmarks")), *[""] * 7]
    return Table("Every strategy; each cell: robots 1, 2, 3 of MRCLAM 6 and the reference world",
                 ["Strategy", "Online, raw (m)", "Online, aligned (m)", "Final path (m)", "Landmarks (m)", "Poses inside (%)",
                  "NEES, poses", "Landmarks inside (%)", "NEES, landmarks", "Ancestors", "Processor (s)", "Diverged"],
                 [*(cells(row) for row in found["strategies"]), last])


def without_ids(data):
    rows = []
    for row in data["recordings"]["without_ids"]:
        robot = row["name"].split(", ")[-1]
        bound = row_named(data["recordings"]["bounds"], robot)["path"]
        counts = ", ".join(f"{runs} × {count}" for count, runs in row.get("counts", []))
        rows.append([row["strategy"], robot.split()[-1], f'{row["diverged"]} of {row["runs"]}', with_error(row.get("online"), 3),
                     with_error(row.get("path"), 3), f'{row["path"]["mean"] / bound:.2f}', number(row.get("path_worst"), 3),
                     with_error(row.get("landmarks"), 3), counts])
    return Table("Without ids", ["Strategy", "Robot", "Diverged", "Online, aligned (m)", "Final path (m)", "Over least squares",
                                 "Worst seed (m)", "Landmarks (m)", "Landmarks (false)"], rows, texts=(0, 8))


def victoria_park(data):
    return Table("Victoria Park", ["Strategy", "Seed", "Median distance to GPS (m)", "Final path, mean (m)", "Landmarks",
                                   "Processor (s)", "Peak memory (MiB)"],
                 [[row["strategy"], str(row["seed"]), number(row["median"], 2), number(row["path"], 2), str(row["map_size"]),
                   number(row["processor_s"], 0), str(row["peak_memory_mib"])] for row in data["victoria_park"]["rows"]])


# ---- faults ---------------------------------------------------------------------------------------------------------


def fault_table(study, name):
    rows = [[row["fault"], *(number(row[figure], 2) for figure in ("mean", "largest", "at_end")),
             f'{row["recovered"]} of {study["seeds"]}', *(number(100.0 * row[figure], 1) for figure in ("healthy", "wrong_when_healthy")),
             f'`{row["finding"]}`, {row["found"]}' if row["found"] else "–"] for row in study["summary"]]
    return Table(name, ["Fault", "Mean (m)", "Largest (m)", "At the end (m)", "Recovered", "Healthy (%)", "Healthy, yet outside (%)",
                        "Finding, runs"], rows, texts=(0, 7))


# ---- pages ----------------------------------------------------------------------------------------------------------

TABLES = {"strategies": strategies, "without_ids": without_ids, "victoria_park": victoria_park}


def page(name, data):
    """The document that data/page_NAME.yaml lays out."""
    layout = read_data(f"page_{name}")
    park = data["victoria_park"]
    numbers = {"redraw": park["medians"]["redraw"], "fast": park["medians"]["resampling, 1000 particles"],
               "least_squares": park["least_squares"]}
    document = Document(layout["title"])
    for block in layout["page"]:
        (kind, value), = block.items()
        if kind == "recording":
            study = data["faults"][value[0]]
            document.add(Heading(2, value[1], value[0]), Text(f'The bound is {study["lost_error"]:.2f} m.'), fault_table(study, value[1]))
        else:
            document.add({"text": lambda text: Text(text.format(**numbers)), "bullets": Bullets,
                          "section": lambda section: Heading(2, section[1], section[0]), "table": lambda table: TABLES[table](data),
                          "picture": lambda picture: Picture(**picture)}[kind](value))
    return document


PAGES = ("recordings", "faults")
