"""How much of a strategy's honesty is tempering: each beside controls that temper the weights and do nothing else."""
import report_pictures as pictures
from report_document import Cell, Heading, Picture, Row, Table, Text
from report_measures import difference_text, with_error
from report_parts import differences_to
from report_statistics import LEVEL, share_explained

HIGH = 0.1  # gain in landmarks inside from which a strategy is looked at
NAMED = ("NR", "RSR", "RBR", "PR", "compensation", "compensation 10 %", "compensation 20 %", "compensation 50 %", "reset",
         "redraw", "EKF-SLAM", "RSR M=500", "compensation pair_mean 10 %")


def controls_of(study, problem):
    """The filters that temper and do nothing else, by kind: (reset or None, the best of RSR's, the best of NR's)."""
    def best(begin):
        names = [name for name in study.names(problem) if name.startswith(begin)]
        inside = {name: study.estimate(problem, name, "map_inside") for name in names}
        names = [name for name in names if inside[name] is not None]
        return max(names, key=lambda name: inside[name].mean) if names else None

    return ("reset" if study.has(problem, "reset") else None), best("RSR tempered"), best("NR tempered")


def share_text(study, problem, name, control):
    """Gain of the control in landmarks inside over RSR, as a share of the filter's gain."""
    if control is None or name == control:
        return "–"
    lists = [study.values(problem, each, "map_inside") for each in (control, name, "RSR")]
    seeds = sorted(set(lists[0]) & set(lists[1]) & set(lists[2]))
    if len(seeds) < 2:
        return "–"
    of_control, of_filter = ([values[seed] - lists[2][seed] for seed in seeds] for values in lists[:2])
    share = share_explained(of_control, of_filter)
    return "–" if share is None else f"{100.0 * share[0]:.0f} ± {100.0 * share[1]:.0f} %"


def add_tempering(document, study, problem):
    document.add(Heading(2, "How much of it is tempering", "tempering"))
    document.add(Text("""Weights that are made equal without the particles being chosen by them forget what the observations
        said: the likelihood is tempered. A tempered filter believes its observations less, and so its ellipses are larger,
        whatever is done to the particles. Resetting the weights after partial or rank-based resampling, and after a
        compensation of few particles, is of this kind. The controls temper and do nothing else: `reset` sets all weights to
        1/M when the effective sample size falls below the threshold and leaves the particles as they are; `RSR tempered x` and
        `NR tempered x` raise each likelihood to the power x, with and without resampling."""))
    if not study.has(problem, "RSR"):
        document.add(Text("RSR is not in this study, so there is nothing to compare with."))
        return
    controls = controls_of(study, problem)
    if not any(controls):
        document.add(Text("No control is in this study."))
        return
    inside = differences_to(study, problem, study.names(problem), "RSR", "map_inside")
    gains = [name for name, (difference, p) in inside.items() if difference.mean >= HIGH and p < LEVEL]
    of_control = [name for name in gains if name == "reset" or "tempered" in name]
    others = [name for name in gains if name not in of_control]
    by_inside = {name: study.estimate(problem, name, "map_inside").mean for name in gains}
    titles = [f"`{name}`" if name else f"{kind}: not in this study"
              for name, kind in zip(controls, ("reset", "RSR tempered", "NR tempered"))]
    rows = []
    for names, kinds in ((sorted(of_control, key=by_inside.get, reverse=True), ("more",)),
                         (sorted(others, key=by_inside.get, reverse=True), ())):
        for name in names:
            map_difference = study.difference(problem, "map_error", [(1.0, name), (-1.0, "RSR")])
            rows.append(Row([f"`{name}`", with_error(study.estimate(problem, name, "map_inside"), "map_inside"),
                             difference_text(inside[name][0], "map_inside"),
                             with_error(study.estimate(problem, name, "map_error"), "map_error"),
                             difference_text(map_difference, "map_error"),
                             *(share_text(study, problem, name, control) for control in controls)], *kinds))
    rows.append(Row(["`RSR`", with_error(study.estimate(problem, "RSR", "map_inside"), "map_inside"), Cell("–"),
                     with_error(study.estimate(problem, "RSR", "map_error"), "map_error"), *["–"] * 4], "rule"))
    document.add(Text(f"""The table has every filter that has at least {HIGH:g} more of the landmarks inside their ellipses
        than RSR (corrected p below {LEVEL:g}). The last columns say which share of its gain the control alone has: 100 % is
        all of it, more than 100 % means that the control alone gains more, less than 0 that it has fewer inside than RSR. Of
        the tempered filters the one with the most landmarks inside is taken. Controls are on grey."""))
    document.add(Table("Landmarks inside, and what tempering alone has of it", [
        "Filter", "Landmarks inside", "minus RSR's", "Map (m)", "minus RSR's (m)", *titles], rows,
        [("", 1), ("Honesty", 2), ("Error", 2), ("Share of the gain in honesty that the control alone has", 3)]))
    add_picture(document, study, problem)


def add_picture(document, study, problem):
    """Error against honesty of all filters."""
    points = []
    for name in study.names(problem):
        inside = study.estimate(problem, name, "map_inside")
        difference = study.difference(problem, "map_error", [(1.0, name), (-1.0, "RSR")])
        if inside is None or difference is None or abs(difference.mean) > 0.2:
            continue
        is_control = name == "reset" or "tempered" in name
        colour = pictures.ORANGE if is_control else pictures.RED if name.startswith("compensation") else pictures.INK
        points.append((inside.mean, inside.standard_error, difference.mean, difference.standard_error,
                       name if is_control or name in NAMED else None, colour, "D" if is_control else "o"))
    if points:
        document.add(Picture("kwak_tempering", pictures.draw_points(
            points, ("share of the landmarks inside their 95 % ellipse", "error of the weighted-mean map minus RSR's (m)"),
            (0.95, "honest")), """**Error against honesty.** To the right is more honest, down is more accurate. Diamonds:
            controls, which temper and do nothing else. Red: compensation. Pale: all other filters. Crosses: standard errors,
            those of the error paired by drive. Filters whose map is more than 0.2 m worse or better are left out."""))
