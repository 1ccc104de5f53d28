"""Scenarios, each a drive, perhaps a fault, a filter, and what must hold; and a table of their figures, which tells what a
change of the package has moved."""
import csv
import hashlib
import io
import re
from pathlib import Path
from xml.etree import ElementTree

from command_line import Error
from study_definition import FILTERS, read_yaml, require_one_of_each_name, take, whole_path
from study_faults import Drive, evaluated, faults, write

# {name: of what evaluate_bag says}, in m, rad and shares. None: there is no such thing in this drive.
FIGURES = {
    "position_error": lambda said: said["estimate"]["cartesian"]["mean"],
    "largest_position_error": lambda said: said["estimate"]["cartesian"]["max"],
    "heading_error": lambda said: said["estimate"].get("heading", {}).get("mean"),
    "map_error": lambda said: said.get("map", {}).get("rms_aligned"),
    "inside_95": lambda said: said.get("coverage95"),
    "healthy": lambda said: said.get("health", {}).get("shares", {}).get("healthy", 0.0),
    "lost": lambda said: said.get("health", {}).get("shares", {}).get("lost", 0.0),
    "healthy_beyond_3_sigma": lambda said: said.get("health", {}).get("wrong_when_healthy"),
}
SETTLED = 0.2  # share of a drive after which criteria hold and figures are taken, unless `after` says otherwise


def number(value, where):
    return take(value, 0.0, where)


def bound(value, where):
    match = re.fullmatch(r"(below|above) (\S+)", str(value))
    if not match:
        raise Error(f'{where} is "{value}", needed: below or above a number, for instance below 0.1')
    return match[1], number(match[2], where)


SCENARIO = {"name": "", "filter": "", "world": "", "bag": "", "recording": "", "duration": 0.0, "ids": True, "fault": "", "seed": 1,
            "config": "", "options": "", "settings": {}, "truth": "/ground_truth",
            "criteria": [{"after": number, "finding": "", **{name: bound for name in FIGURES}}]}


def read_scenarios(file):
    """The scenarios of a YAML file; test/scenarios.yaml explains the keys. Raises Error that names what makes no sense."""
    scenarios = take(read_yaml(file), [SCENARIO], str(file))
    for each in scenarios:
        if not each["name"] or each["filter"] not in FILTERS:
            raise Error(f'{file}: scenario "{each["name"]}" of "{each["filter"]}" needs a name, and one of {", ".join(FILTERS)}')
        if sum(map(bool, (each["world"], each["bag"], each["recording"]))) != 1:
            raise Error(f'{file}: {each["name"]} needs one of world, bag and recording')
        for key in ("world", "bag", "config"):
            each[key] = whole_path(each[key], Path(file).parent) if each[key] else ""
    require_one_of_each_name(scenarios, file)
    return scenarios


def drive_of(scenario, datasets, work, run):
    """Its bag, with its fault."""
    bag = work / "drive.bag"
    if scenario["world"]:
        run(["simulate_bag", scenario["world"], bag, "--seed", scenario["seed"], *["--unknown-ids"] * (not scenario["ids"]),
             *(["--duration", scenario["duration"], "--repeat"] if scenario["duration"] else [])])
    elif scenario["recording"]:
        kind, source, *options = scenario["recording"].split()
        run(["dataset_to_bag", kind, Path(datasets) / source, bag, *options])
    else:
        bag = Path(scenario["bag"])
    if scenario["fault"]:
        there = dict(faults(Drive(bag)))
        chosen = [messages for name, messages in there.items() if scenario["fault"] in name]
        if len(chosen) != 1:
            raise Error(f'{scenario["name"]}: fault is "{scenario["fault"]}", has to be part of one of: {"; ".join(there)}')
        bag = work / "fault.bag"
        write(chosen[0], bag)
    return bag


def digest_of(path):
    """Of all messages of a bag, and when they came."""
    import rosbag
    digest = hashlib.sha256()
    with rosbag.Bag(str(path)) as bag:
        for topic, message, time in bag.read_messages(raw=True):
            digest.update(f"{topic} {time} ".encode() + message[1])
    return digest.hexdigest()[:16]


def findings_of(said):
    """Each as its kind and the id of what it is about."""
    return sorted(each["kind"] + (f' {each["id"]}' if each["id"] >= 0 else "") for each in said.get("findings", []))


def failures(criterion, said):
    """What of a criterion does not hold."""
    when = "" if criterion["after"] is None else f' after {criterion["after"]:g} s'
    for name, figure in FIGURES.items():
        if criterion[name]:
            side, limit = criterion[name]
            value = figure(said)
            if value is None or not (value < limit if side == "below" else value > limit):
                yield f'{name}{when} is {"unknown" if value is None else f"{value:.4g}"}, has to be {side} {limit:g}'
    wanted, there = criterion["finding"], findings_of(said) or ["none"]
    if wanted and wanted not in there and wanted not in (each.split()[0] for each in there):
        yield f'findings are {", ".join(there)}; needed: {wanted}'


def run_scenario(scenario, datasets, work, run):
    """What of it does not hold, and its row of figures."""
    bag, out = drive_of(scenario, datasets, work, run), work / "out.bag"
    run(["run_bag", scenario["filter"], bag, out, "--no-clouds", "--seed", scenario["seed"],
         *(["--config", scenario["config"]] if scenario["config"] else []),
         *(["--duration", scenario["duration"]] if scenario["duration"] else []),
         *(word for setting in scenario["settings"].items() for word in ("--set", "=".join(setting))), *scenario["options"].split()])

    def said(share):
        return evaluated(run, out, share, work, "--truth", scenario["truth"])

    settled = said(SETTLED)
    wrong = [failure for each in scenario["criteria"] for failure in failures(
        each, settled if each["after"] is None else said(each["after"] / settled["duration"]))]
    figures = {name: "" if figure(settled) is None else f"{figure(settled):.5g}" for name, figure in FIGURES.items()}
    return wrong, {"scenario": scenario["name"], **figures, "findings": "; ".join(findings_of(settled)), "drive": digest_of(bag), "digest": digest_of(out)}


def moved(row, before):
    """What is not as in the table: of figures and findings, and of the digest if nothing else has moved."""
    # Where another processor or mathematical library simulates other bytes, the filter's say nothing.
    silent = {"drive", "digest"} if row["drive"] != before.get("drive") else set()
    if not before:
        yield "is not in the table"
        return
    names = [name for name in row if name not in silent and row[name] != before[name]]
    for name in names if names == ["digest"] else [name for name in names if name != "digest"]:
        by = ""
        if name in FIGURES and row[name] and float(before[name] or 0.0):
            by = f" ({100.0 * (float(row[name]) / float(before[name]) - 1.0):+.2g} %)"
        yield f"{name} was {before[name] or 'nothing'}, is {row[name] or 'nothing'}{by}"


def read_table(file):
    try:
        return {row["scenario"]: row for row in csv.DictReader(io.StringIO(Path(file).read_text()))}
    except (OSError, KeyError, ValueError) as error:
        raise Error(f"{file}: cannot be read: {error}") from None


def text_of_table(rows):
    out = io.StringIO()
    writer = csv.DictWriter(out, ["scenario", *FIGURES, "findings", "drive", "digest"], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return out.getvalue()


def junit_of(results):
    """As rostest reads it. `results`: {name: what is wrong}; None: it was skipped."""
    suite = ElementTree.Element("testsuite", name="scenarios", tests=str(len(results)), errors="0",
                                failures=str(sum(bool(wrong) for wrong in results.values())))
    for name, wrong in results.items():
        case = ElementTree.SubElement(suite, "testcase", classname="scenarios", name=name, time="0")
        if wrong is None:
            ElementTree.SubElement(case, "skipped", message="needs --datasets")
        elif wrong:
            ElementTree.SubElement(case, "failure", type="criterion").text = "\n".join(wrong)
    return ElementTree.tostring(suite, encoding="unicode")
