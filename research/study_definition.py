"""What is studied: problems, filters with their settings, seeds; from a YAML file, as studies/kwak.yaml explains it."""
import os
from pathlib import Path

import yaml
from command_line import Error

HERE = Path(os.path.realpath(__file__)).parent


def builtin_studies():
    """{name: path} of the studies that come with the package; installed, they are beside this file."""
    return {path.stem: path for folder in (HERE / "studies", HERE) for path in sorted(folder.glob("*.yaml"))}


FILTERS = "fastslam", "beacon_mcl"


def read_yaml(path, name=None, loader=yaml.BaseLoader):
    """What a file says; unless with another loader, texts as they are written: 0.10 stays 0.10, and off is a word. Raises Error with
    the file's name."""
    try:
        return yaml.load(Path(path).read_text(encoding="utf-8"), Loader=loader)
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise Error(f"{name or path}: cannot be read: {' '.join(str(error).split())}") from None


def require_one_of_each_name(listed, where):
    names = [each["name"] for each in listed]
    for name in names:
        if names.count(name) > 1:
            raise Error(f"{where}: there are two of the name {name}")


def take(value, form, where):
    """What YAML has there, with texts as they are written, as `form` is: of the type of a default; a list of [form]; a map of
    {key: form}, {} of any texts; or what a function makes of it. Raises Error that says where what makes no sense is."""
    if callable(form):
        return form(value, where)
    if isinstance(form, list):
        if not isinstance(value, list):
            raise Error(f"{where} has to be a list")
        return [take(each, form[0], where) for each in value]
    if isinstance(form, dict):
        if not isinstance(value, dict):
            raise Error(f"{where} has to be a map of keys and values")
        unknown = next((key for key in value if form and key not in form), None)
        if unknown is not None:
            raise Error(f"{where}: {unknown} is unknown; known: {', '.join(form)}")
        absent = {key: None if callable(of) else type(of)() if isinstance(of, (list, dict)) else of for key, of in form.items()}
        return {**absent, **{key: take(each, form.get(key, ""), f"{where}: {key}") for key, each in value.items()}}
    if not isinstance(value, str):
        raise Error(f"{where} has to be a word, a number or a text")
    try:
        return {"true": True, "false": False}[value] if isinstance(form, bool) else type(form)(value)
    except (KeyError, ValueError):
        needed = {bool: "true or false", int: "a whole number", float: "a number"}[type(form)]
        raise Error(f'{where} is "{value}", needed: {needed}') from None


PROBLEM = {"name": "", "world": "", "bag": "", "duration": 0.0, "clip": 0.2, "config": "", "calibrated": False}
FILTER = {"name": "", "settings": {}, "calibrated": True, "estimator": "filter"}
STUDY = {"study": "", "title": "", "filter": "", "preset": "", "settings": {}, "trials": 30, "block": 1, "reference": "",
         "times_schemes": False, "problems": [PROBLEM], "groups": [{"name": "", "filters": [FILTER]}], "particles": [0]}


def whole_path(path, folder):
    """Of a file, from wherever the study goes on; a name without slash and point is that of a world."""
    return os.path.normpath(os.path.join(os.getcwd(), folder, path)) if "/" in path or "." in path else path


def problem_of(read, folder, where):
    if bool(read["world"]) == bool(read["bag"]):
        raise Error(f'{where}: {read["name"]} needs either a world or a bag')
    return {"name": read["name"], "kind": "world" if read["world"] else "bag",
            "source": whole_path(read["world"] or read["bag"], folder), "duration_given": read["duration"],
            "clip": read["clip"], "config": whole_path(read["config"], folder), "calibrated": read["calibrated"]}


def load_study(name, trials=None, bag="", config=""):
    """A study as study.json has it: one that comes with the package, by name, or that of a YAML file, by path; with another number of
    trials, and a recording beside its problems. Raises Error that names the key of what is unknown, missing or makes no sense; what
    settings mean is checked by the filters."""
    path = Path(name)
    if "/" not in name and "." not in name:
        known = builtin_studies()
        if name not in known:
            raise Error(f'study "{name}" is unknown; known: {", ".join(known)}, or the path of a study\'s YAML file')
        path = known[name]
    study = {**take(read_yaml(path, name), STUDY, name), "format": 1}
    filters = [dict(each, group=group["name"]) for group in study.pop("groups") for each in group["filters"]]
    particles = study.pop("particles")
    if particles:  # every filter with each number of particles
        filters = [dict(each, name=f'{each["name"]} M={size}', of=each["name"], particles=size,
                        settings=dict(each["settings"], particles=str(size)))
                   for each in filters for size in particles]
    study["filters"], study["title"] = filters, study["title"] or study["study"]
    study["problems"] = [problem_of(each, path.parent, name) for each in study["problems"]]
    study["reference"] = study["reference"] or (filters[0].get("of", filters[0]["name"]) if filters else "")
    study["trials"] = study["trials"] if trials is None else trials
    if bag:
        study["problems"].append(problem_of({**PROBLEM, "name": Path(bag).stem, "bag": os.path.abspath(bag),
                                             "config": config and os.path.abspath(config)}, "", name))
    check(study, name)
    return study


def check(study, where):
    def require(is_so, what):
        if not is_so:
            raise Error(f"{where}: {what}")

    require(study["study"] and study["filter"] in FILTERS,
            f"study is '{study['study']}' and filter '{study['filter']}': a study needs a name, and one of {', '.join(FILTERS)}")
    for key in ("problems", "filters"):
        require(study[key], f"a study needs {key}, and there are none")
        require_one_of_each_name(study[key], where)
        for name in (each["name"] for each in study[key]):
            require(name and not set(name) & set(',"\n/'),
                    f"the name '{name}' is empty or has a comma, a quote, a slash or a line's end: take another")
    require(any(study["reference"] in (each["name"], each.get("of")) for each in study["filters"]),
            f"reference is '{study['reference']}', which is none of the filters")
    for key in ("trials", "block"):
        require(study[key] >= 1, f"{key} is {study[key]}: it has to be at least 1")
    for problem in study["problems"]:
        require(not problem["calibrated"] or (study["filter"] == "beacon_mcl" and problem["kind"] == "world"),
                f"problem {problem['name']}: only beacon_mcl in a world can be calibrated; for a recording give a calibration by config")
    for each in study["filters"]:
        require(each["estimator"] == "filter" or (each["estimator"], study["filter"]) == ("ekf_slam", "fastslam"),
                f"filter {each['name']}: estimator is '{each['estimator']}': it has to be filter or, in studies of fastslam, ekf_slam")
