#!/usr/bin/python3
"""Draws the plots of lambert-bench, as SVG and PNG, from the tables that its suites have written.

    plots.py DIR SUITE...

lambert-bench runs this script after each suite. It may be run again over a folder of results at any time.
"""

import csv
import itertools
import json
import pathlib
import sys

try:
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.ticker import LogFormatter
except ImportError:
    print(json.dumps({"log": f"no plots: python3-matplotlib is missing; later: {' '.join(sys.argv)}"}))
    sys.exit(0)

# Okabe and Ito (2008): colours that people who confuse red and green can distinguish, then darker ones of them.
COLOURS = ["#000000", "#e69f00", "#56b4e9", "#009e73", "#0072b2", "#d55e00", "#cc79a7", "#737373", "#8c591a", "#99b300",
           "#663399", "#e6334d"]
MARKERS = list("osD^vP*Xh<>p")
plt.rcParams.update({
    "figure.figsize": (9.6, 6), "figure.dpi": 100, "font.size": 11, "axes.titlesize": 12, "axes.grid": True,
    "axes.prop_cycle": matplotlib.cycler(color=COLOURS, marker=MARKERS), "grid.alpha": .3,
    "legend.frameon": False, "lines.linewidth": 1.5, "lines.markersize": 6, "svg.hashsalt": "lambert", "axes.spines.top":
    False, "axes.spines.right": False})


class PlainNumbers(LogFormatter):
    """0.2 in place of 2e-01 beside a logarithmic axis."""

    def _num_to_string(self, x, vmin, vmax):
        return f"{x:g}"


def number(text):
    try:
        return float(text)
    except ValueError:
        return text


class Results:
    """The tables of one suite, and its plots, in one folder."""

    def __init__(self, folder, suite):
        self.folder, self.suite = pathlib.Path(folder), suite

    def rows(self, table):
        """One dictionary per row, with an empty text for a figure that was not measured; no rows without the table."""
        path = self.folder / f"{self.suite}-{table}.csv"
        if not path.exists():
            return []
        with open(path, newline="", encoding="utf-8") as stream:
            return [{name: number(value) for name, value in row.items()} for row in csv.DictReader(stream)]

    def draw(self, name, title, x, y, series, log="", notes=None):
        """series: label -> list of (x, y), of (x, y, low, high) with the ends of error bars, or a dictionary of such
        points and of arguments of plot(). log names the logarithmic axes: "x", "y" or "xy". notes(axes) adds the rest. Points without a number, or not above 0 on such an axis, are left out; without any point there
        is no plot."""
        figure, axes = plt.subplots(layout="constrained")
        drawn = 0
        for label, points in series.items():
            style = {}
            if isinstance(points, dict):
                style = dict(points)
                points = style.pop("points")
            points = [p for p in points if all(isinstance(v, float) for v in p)
                      and ("x" not in log or p[0] > 0) and ("y" not in log or p[1] > 0)]
            if not points:
                continue
            drawn += 1
            columns = list(zip(*points))
            if len(columns) == 4:
                away = [[b - a for a, b in zip(columns[2], columns[1])], [b - a for a, b in zip(columns[1], columns[3])]]
                axes.errorbar(*columns[:2], yerr=away, capsize=3, label=label, **style)
            else:
                axes.plot(*columns, label=label, **style)
        if drawn > 0:
            for name_of_axis in log:
                getattr(axes, f"set_{name_of_axis}scale")("log")
                axis = getattr(axes, f"{name_of_axis}axis")
                axis.set_major_formatter(PlainNumbers())
                axis.set_minor_formatter(PlainNumbers(labelOnlyBase=False, minor_thresholds=(2, .7)))
            axes.set(title=title, xlabel=x, ylabel=y)
            if notes is not None:
                notes(axes)
            if axes.get_legend_handles_labels()[1]:
                axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1), borderaxespad=0)
            for extension in "svg", "png":
                path = self.folder / f"{self.suite}-{name}.{extension}"
                beside = path.with_name(f".{path.name}")
                figure.savefig(beside, format=extension, metadata={"Date": None} if extension == "svg" else None)
                beside.rename(path)
        plt.close(figure)


def groups(rows, *names):
    """The values of these columns, in the order of their first row, with the rows that have them."""
    found = {}
    for row in rows:
        found.setdefault(tuple(row[name] for name in names), []).append(row)
    return found.items()


def points(rows, *names):
    return [tuple(row[name] for name in names) for row in rows]


def limit(value, label):
    return lambda axes: axes.axhline(value, color="#737373", linestyle="--", linewidth=1, marker="", label=label)


LINE = {"marker": ""}


def formfactors(results):
    open_cases = [row for row in results.rows("closed-forms") if row["occluded"] == 0 and row["truth"] > 0]
    results.draw("closed-forms", "Form factors of pairs with nothing between, against their closed forms", "form factor",
                 "relative error", {method: {"points": points(rows, "truth", "relative_error"), "linestyle": ""}
                                    for (method,), rows in groups(open_cases, "method")}, "xy")
    rows = sizes = results.rows("resolution")
    ours = {f"{scene}, {n:.0f} elements": points(of, "resolution", "error")
            for (scene, n), of in groups(rows, "scene", "elements")}
    theirs = {f"thesis, city {city}": points(rows, "resolution", f"error_{city}") for city in (1, 2, 3)}
    results.draw("resolution", "Hemicubes against the finest one (thesis: table 4.6)", "pixels along a hemicube",
                 "relative error of F (ours: Frobenius norm)", ours | theirs, "xy",
                 lambda axes: axes.set_xticks(sorted({row["resolution"] for row in sizes}), minor=False))
    kinds = {"rays": "rays", "hemicube": "hemicubes", "pair": "pair by pair"}
    for (n,), rows in groups(results.rows("error"), "elements"):
        reference = rows[0]["reference"]
        results.draw(
            f"error-{n:.0f}", f"Cornell box of {n:.0f} elements: error of B against the time of its form factors",
            "time of the form factors (s)", "indirect error of B, one bright element (mean, 5 % to 95 %)",
            {label: points([row for row in rows if kind in row["method"] and row["reference"] == reference], "seconds",
                           "single_mean", "single_q05", "single_q95") for kind, label in kinds.items()},
            "xy", limit(.01, "1 %"))


def lowrank(results):
    for (n,), rows in groups(results.rows("levels"), "elements"):
        results.draw(f"levels-{n:.0f}", f"Open room of {n:.0f} elements: time by levels (thesis: figures 3.3 and 3.4)",
                     "levels of the tree", "time of the factorization (s)",
                     {f"epsilon {epsilon:g}" + (", without Z-order" if order == "mesh" else ""):
                      points(of, "levels", "seconds") for (epsilon, order), of in groups(rows, "epsilon", "order")}, "y",
                     lambda axes: axes.xaxis.get_major_locator().set_params(integer=True))
    results.draw("rank", "Open room: rank by elements (thesis: figure 3.5)", "elements", "rank k of HF",
                 {f"epsilon {epsilon:g}": points(rows, "elements", "rank")
                  for (epsilon,), rows in groups(results.rows("rank"), "epsilon")}, "xy")
    for (n,), rows in groups(results.rows("methods"), "elements"):
        for name, column, label in (("build-time", "build_s", "factorization and inverse (s)"),
                                    ("memory", "mb", "memory that an answer reads (MB)"),
                                    ("answer-time", "answer_ms", "one answer, one thread (ms)")):
            results.draw(f"error-by-{name}-{n:.0f}", f"Cornell box of {n:.0f} elements: error by {name.replace('-', ' ')}",
                         label, "total indirect error, one bright element",
                         {method: points(of, column, "single") for (method,), of in groups(rows, "method")}, "xy")


def cities(results):
    for (city, n), rows in groups(results.rows("bounces-curves"), "city", "elements"):
        curves = {}
        # The converged curves come last and dashed, so that the others show beneath them.
        for (threshold,), of in sorted(groups(rows, "threshold"), key=lambda item: item[0][0] == ""):
            converged = threshold == ""
            name = "converged" if converged else f"threshold {threshold:g}"
            style = {"color": "#737373", "linestyle": "--"} if converged else {}
            for quantity in "BS":
                curves[f"{quantity}, {name}"] = {"points": points(of, "place", quantity), **LINE, **style}
        results.draw(f"bounces-{city:.0f}",
                     f"City {city:.0f}, {n:.0f} elements: radiosity B, and S of its third and later bounces (figure 4.5)",
                     "elements, each curve sorted by value (%)",
                     "mean over sky tiles of 1 W/(m² sr), each alone (W/m²)", curves)
    for (city, n, threshold), rows in groups(results.rows("tiles"), "city", "elements", "threshold"):
        power = f"{threshold:.0e}".replace("e-0", "e-")
        results.draw(f"tiles-{power}",
                     f"City {city:.0f}, {n:.0f} elements, threshold {power}: error of each sky (figure 4.10)",
                     "sky tile, from the horizon up", "relative error |B~ − B| / |B|",
                     {f"correction {name}": {"points": points(rows, "tile", name), **LINE}
                      for name in ("none", "delta", "discarded")})
    rows = results.rows("map")

    def name_points(axes):
        for row in rows:
            axes.annotate(row["scene"], (row["density"], row["rank_.1"] / row["elements"]), (6, 4),
                          textcoords="offset points")

    results.draw("map", "Sparse scenes are on the left, scenes of low rank below (thesis: figure 5.1)",
                 "density of F (%)", "rank at epsilon .1 over n",
                 {None: {"points": [(row["density"], row["rank_.1"] / row["elements"]) for row in rows],
                         "linestyle": ""}}, "x", name_points)
    results.draw("singular-values", "Singular values of F (thesis: figure 4.1)", "index / n", "singular value",
                 {f"{scene}, {n:.0f} elements": {"points": points(of, "share", "value"), **LINE} for (scene, n), of in
                  groups(results.rows("singular-values-curves"), "scene", "elements")}, "xy", limit(.1, "0.1"))
    styles = itertools.cycle(["-", "--"])
    curves = {}
    for (city, _), rows in groups(results.rows("distribution-curves"), "city", "elements"):
        style = next(styles)
        for colour, ((reflectance,), of) in zip(COLOURS, groups(rows, "reflectance")):
            curves[f"city {city:.0f}, R = {reflectance:g}"] = {
                "points": points(of, "x", "above"), **LINE, "color": colour, "linestyle": style}
    results.draw("distribution", "Elements of M = (I − RF)⁻¹ by size (thesis: figure 4.4)", "x",
                 "elements of M greater than x (%)", curves, "x")


def hierarchical(results):
    for (scene, n), rows in groups(results.rows("hierarchical"), "scene", "elements"):
        rows = [row for row in rows if row["kind"] != "emitters"]  # which answer for their own lights alone
        for name, column, label in (("memory", "stored_mb", "operator in a store (MB)"),
                                    ("build-time", "build_s", "build, without form factors (s)"),
                                    ("query-time", "query_ms", "one answer, one thread (ms)")):
            results.draw(f"{scene}-by-{name}".replace(" ", "-"),
                         f"{scene.capitalize()} of {n:.0f} elements: error by {name.replace('-', ' ')}", label,
                         "total indirect error, one bright element",
                         {kind: points(of, column, "single") for (kind,), of in groups(rows, "kind")}, "xy")


def reuse(results):
    letters = {"A": "A, own paths", "B": "B, rays", "C": "C, maps", "D": "D, hemicubes"}
    for (experiment,), rows in groups(results.rows("positions"), "experiment"):
        for frame in 1, 15, 20:
            results.draw(f"experiment-{experiment:.0f}-frame-{frame}",
                         f"Experiment {experiment:.0f}, frame {frame}: error by time ([3], figure 9)",
                         "processor time of all positions (s)", "mean square error without bias",
                         {name: points(of, "seconds", f"variance_{frame}")
                          for (name,), of in groups(rows, "approach")}, "xy")
        maps = {letters[name[0]]: [(row["paths"], row["maps_s"] + row["reuse_s"]) for row in of]
                for (name,), of in groups(rows, "approach") if name[0] in "CD"}
        walks = [(row["paths"], row["trace_s"]) for row in rows if row["approach"].startswith("D")]
        results.draw(f"experiment-{experiment:.0f}-weights",
                     f"Experiment {experiment:.0f}: maps and weights by paths ([3], figure 10)",
                     "paths of each position", "processor time (s)",
                     maps | {"walks, beside them": {"points": walks, "linestyle": "--"}}, "xy")
    by_lamp = groups(results.rows("maps"), "lamp", "approach")
    results.draw("maps", "Bias of visibility maps by resolution", "cells along the side of a map",
                 "bias over the standard error of B",
                 {f"{name[0]}, lamp of {lamp:g}": sorted(points(of, "resolution", "bias_of_error"))
                  for (lamp, name), of in by_lamp}, "xy")


def service(results):
    rows = [row for row in results.rows("load") if row["format"] == "npy" and row["server"] in ("lambertd", "sleeping")]
    results.draw("throughput", "Answers a second in NPY, beside a server that sleeps instead of solving",
                 "clients", "answers (1/s)",
                 {f"{server}, {n:.0f} elements": points(of, "clients", "per_second")
                  for (n, server), of in groups(rows, "n", "server")}, "xy", lambda axes: axes.set_xticks(
                      [1, 4, 16], labels=["1", "4", "16"], minor=False))


def main():
    suites = {draw.__name__: draw for draw in (formfactors, lowrank, cities, hierarchical, reuse, service)}
    folder, *names = sys.argv[1:]
    for name in names:
        if name in suites:
            suites[name](Results(folder, name))


main()
