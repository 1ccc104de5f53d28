"""The pages doc/studies/recordings.html and faults.html: text, and tables from the figures in doc/data."""
from report_document import Bullets, Document, Heading, Picture, Table, Text

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


def recordings(data):
    """What every strategy of FastSLAM reaches on recordings."""
    park = data["victoria_park"]
    redraw, fast = (park["medians"][name] for name in ("redraw", "resampling, 1000 particles"))
    document = Document("FastSLAM on recordings")
    document.add(
        Text("""What each strategy reaches on recordings whose sensor errors nobody knows. All parameters have their defaults but for
             what the first column names. Figures are means over seeds; ± is the standard error. Made by
             `research/make_data recordings victoria_park` and `research/make_tables`."""),
        Heading(2, "All strategies, known ids", "strategies"),
        Text("""MRCLAM 6 is data set 6 of the UTIAS multi-robot collection (Leung et al. 2011): about 900 s for each robot, 15
             landmarks seen by a camera, ground truth by Vicon. The reference world is `config/worlds/indoor_two_loops.yaml`;
             the filter is not told how noisy its odometry is, and every seed is another drive. 10 seeds each."""),
        Bullets([
            """**redraw** is the default, with 100 particles; **noise as stated** is the same without `learn_noise`. **Resampling, 1000
            particles** is the preset `fast`. All others are `fast` with 100 particles: the resampling schemes by name, compensation,
            and no renewal at all.""",
            """**Online**: the poses as published, each from the data up to then. **Raw**: the map frame is that of the robot at the
            start, so a raw error is mostly a rotation of that frame. **Aligned**: after the best rigid fit. **Final path**: the
            trajectory as the filter believes it at the end, aligned; **landmarks** likewise.""",
            """**Inside**: share of the time, or of the landmarks, that the truth is in the 95 % ellipse of the filter. **NEES**:
            normalized estimation error squared; 2 is consistent. **Ancestors**: how many of the first particles have descendants
            at the end, or since the last redraw.""",
            """**Least squares** on the same odometry and observations (`evaluate_bag --batch --batch-online`). Online, it is solved
            at every observation with all data up to then. The filter learns the noise and estimates drift, yaw-rate bias and delay
            of the odometry besides, so it can be better. In the reference world least squares is given the true noise of the
            odometry (mean of three drives).""",
            """A run on MRCLAM has **diverged** if its aligned error is more than half that of dead reckoning. It does not count in
            the means. In the reference world the first pose is known exactly, so the NEES of the poses has no mean."""]),
        strategies(data),
        Text("""Only redraw states its uncertainty correctly on recordings; no choice among particles changes that. After some
             minutes a resampled population has one ancestor, and one that is never renewed has few particles that carry weight.
             `systematic`, `residual_systematic` and `residual_then_systematic` select the same particles from the same random
             number, so their rows are equal."""),
        Heading(2, "Without ids", "without-ids"),
        Text("""The same recordings with the ids withheld (`association/method: mutual_exclusion`). The barrels stand in groups of
             two or three, 20 cm apart. **Over least squares**: the error of the path over that of least squares with known ids.
             **Landmarks (false)**: how many runs ended with how many landmarks on the map; in brackets, how many of these are
             spurious or duplicates."""),
        without_ids(data),
        Heading(2, "Victoria Park", "victoria-park"),
        Text("""The data set of Sydney (Nebot, Guivant): a car drives for 26 minutes and 4 km among trees, which a laser sees
             without ids. The only ground truth is GPS, which has gaps and errors of metres; distances are after the best rigid fit
             to it. Times and memory are those of `run_bag fastslam --no-clouds`, bags included, on two busy cores."""),
        victoria_park(data),
        Text(f"""Over the seeds, the median distance is {redraw["mean_of_seeds"]:.2f} ± {redraw["deviation"]:.2f} m (standard
             deviation) with redraw, and {fast["mean_of_seeds"]:.2f} ± {fast["deviation"]:.2f} m with resampling: some seeds close a
             loop at the wrong place. Batch least squares with the associations of the filter (redraw, seed 1;
             `evaluate_bag --batch`) has a median of {park["least_squares"]["median"]:.2f} m; the final path of the filter is
             {park["least_squares"]["path_ratio"]:.2f} times as far off on average, since it learns the noise and estimates more
             errors of the odometry."""),
        Picture("victoria_park", "../images/victoria_park.png", "Path and map over GPS."))
    return document


# ---- faults ---------------------------------------------------------------------------------------------------------

FAULTS = {"plaza2": "Plaza 2", "labyrinth": "Labyrinth", "mrclam_robot2": "MRCLAM 6, robot 2", "indoor_two_loops": "Reference world"}


def fault_table(study, name):
    rows = [[row["fault"], *(number(row[figure], 2) for figure in ("mean", "largest", "at_end")),
             f'{row["recovered"]} of {study["seeds"]}', *(number(100.0 * row[figure], 1) for figure in ("healthy", "wrong_when_healthy")),
             f'`{row["finding"]}`, {row["found"]}' if row["found"] else "–"] for row in study["summary"]]
    return Table(name, ["Fault", "Mean (m)", "Largest (m)", "At the end (m)", "Recovered", "Healthy (%)", "Healthy, yet outside (%)",
                        "Finding, runs"], rows, texts=(0, 7))


def faults(data):
    """What the filters do and find under each fault."""
    document = Document("Faults: what the filters do, and what they find")
    document.add(
        Text("""Each fault is put into a recording by itself, at 40 % of the drive; the filters run as shipped.
             `rosrun pf_resampling study faults BAG` does the same to a recording of yours: it writes a bag with the fault, and gives it
             to `run_bag` and `evaluate_bag`. Figures are of what follows the fault, over 5 seeds: medians of errors, means of shares.
             Made by `research/make_data faults` and `research/make_tables`."""),
        Bullets([
            """**At the end**: in the last tenth of the drive. **Recovered**: in how many runs the mean error is below the bound there.""",
            """**Healthy, yet outside**: share of the time at which the filter says healthy and the truth is outside its 3-sigma region;
            one part in ninety would be if the belief were Gaussian.""",
            """**Finding**: what most runs list in [findings](../faults.md#what-has-changed), and how many do."""]))
    for key, name in FAULTS.items():
        study = data["faults"][key]
        document.add(Heading(2, name, key), Text(f'The bound is {study["lost_error"]:.2f} m.'), fault_table(study, name))
    return document


PAGES = {"recordings": recordings, "faults": faults}
