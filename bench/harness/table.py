"""Medians of the runs, as Markdown tables, and the ratios that they come to."""

from statistics import median

BEGIN, END = "<!-- table: written by run.py --update -->", "<!-- end of table -->"

MESH_COLUMNS = ["program", "threads", "points", "cells", "cells / CPU s", "cells / wall s", "q mean", "q p1",
                "least angle", "mean edge", "peak MB", "CPU s", "wall s"]
ENERGY_COLUMNS = ["program", "threads", "atoms", "atom-evaluations / CPU s", "CPU s / evaluation", "peak MB"]


def summary(runs, shape):
    """Medians of a job's runs and the shape of its mesh; {"error": why} if any run failed."""
    failed = [run["error"] for run in runs if "error" in run]
    if failed:
        return {"error": failed[0]}
    keys = [key for key, value in runs[0].items() if isinstance(value, (int, float))]
    return {**runs[0], **{key: median(run[key] for run in runs) for key in keys}, **shape}


def section(rows):
    """The Markdown of one section: a table for each work. A row: work, program, threads, and figures."""
    lines = []
    for work in dict.fromkeys(row["work"] for row in rows):
        of = [row for row in rows if row["work"] == work]
        evaluations = any("evaluations" in row for row in of)
        columns = ENERGY_COLUMNS if evaluations else MESH_COLUMNS
        lines += [f"**{work}**", "", line(columns), line(["---"] * len(columns))]
        for row in of:
            if "error" in row:
                lines.append(line([row["program"], row["threads"], row["error"]]))
            else:
                lines.append(line((energy_cells if evaluations else mesh_cells)(row)))
        lines.append("")
    return lines


def line(cells):
    return "| " + " | ".join(str(cell).replace("|", "/") for cell in cells) + " |"


def energy_cells(row):
    each = row["cpu"] / row["evaluations"]
    return [named(row), row["threads"], f"{row['atoms']:,.0f}", count(row["atoms"] / each), f"{each:.4f}", megabytes(row)]


def mesh_cells(row):
    q = [f"{row[key]:.3f}" for key in ("q_mean", "q_p1")]
    return [named(row), row["threads"], f"{row['points']:,.0f}", f"{row['cells']:,.0f}", count(row["cells"] / row["cpu"]),
            count(row["cells"] / row["wall"]), *q, f"{row['angle_min']:.2g}°", f"{row['edge_mean']:.3g}",
            megabytes(row), f"{row['cpu']:.3g}", f"{row['wall']:.3g}"]


def named(row):
    return f"{row['program']} ({row['version']})" if "version" in row else row["program"]


def megabytes(row):
    return f"{row['peak'] / 1e6:,.0f}"


def count(x):
    """Three digits."""
    digits = max(0, len(str(int(x))) - 3)
    return f"{round(x, -digits):,.0f}"


def ratios(sections):
    """What the tables come to, one row a comparison; each within one section, so within one run."""
    found = []

    def rows(name, work):
        return [row for row in sections.get(name, {}).get("rows", []) if work in row["work"] and "error" not in row]

    def rate(row, per):
        """Atoms evaluated, points or cells in a second."""
        done = row["atoms"] * row["evaluations"] if "evaluations" in row else row[per[0]]
        return done / row[per[1]]

    def compare(name, work, ours, theirs, per, words):
        of = rows(name, work)
        us = [row for row in of if ours(row)]
        them = [row for row in of if theirs(row)]
        if us and them:
            best = max(them, key=lambda row: rate(row, per))
            ratio = rate(us[0], per) / rate(best, per)
            found.append([words, who(us[0]), who(best), f"{ratio:.2f}"])

    def who(row):
        quality = f", q mean {row['q_mean']:.3f}" if "q_mean" in row else ""
        return f"{row['program']}, {row['threads']} thread{'s' if row['threads'] > 1 else ''}{quality}"

    def is_ours(threads, lists="atomesh"):
        return lambda row: row["program"].startswith(lists) and row["threads"] == threads

    cpu, wall = ("cells", "cpu"), ("cells", "wall")
    peers = lambda row: not row["program"].startswith("atomesh")
    for lists in ("atomesh, lists in hand", "atomesh, lists rebuilt"):
        compare("energy", "energy", is_ours(1, lists), peers, cpu, "energy and gradient, atom-evaluations / CPU s")
    for lists in ("lists in hand", "lists rebuilt"):
        compare("lammps", lists, is_ours(1), peers, cpu, f"pairs, {lists}, atom-evaluations / CPU s, best LAMMPS")
    for dimension in (3, 2):
        for kind in ("random", "jittered", "perfect"):
            work = f"Delaunay {dimension}-D, 10⁶ points, {kind}"
            name = f"delaunay{dimension}"
            compare(name, work, is_ours(1), peers, cpu, f"{work}, CPU time, fastest peer")
            compare(name, work, is_ours(2), is_ours(1), wall, f"{work}, wall time")
    good = lambda row: peers(row) and row["q_mean"] >= 0.98
    for threads in (1, 2):
        compare("graded", "graded", is_ours(threads), good, ("points", "wall"),
                "graded triangles, vertices / wall s, fastest peer of q mean ≥ 0.98")
    for threads in (1, 2):
        compare("graded", "BP 2004", is_ours(threads), good, ("cells", "cpu" if threads == 1 else "wall"),
                f"BP 2004, cells / {'CPU' if threads == 1 else 'wall'} s, fastest peer of q mean ≥ 0.98")
    for per, words, threads in ((cpu, "cells / CPU s", 1), (wall, "cells / wall s", 2)):
        compare("image", " at d = 6", is_ours(threads), peers, per, f"image to mesh, {words}, fastest peer")
    return found


def document(sections):
    """All tables."""
    lines = []
    comparisons = ratios(sections)
    if comparisons:
        columns = ["work", "atomesh", "against", "times as fast"]
        lines += [line(columns), line(["---"] * len(columns)), *map(line, comparisons), ""]
    for name, part in sections.items():
        lines += [f"### {name}", "", part["conditions"], "", *section(part["rows"])]
    return "\n".join(lines)


def update(readme, text):
    """Puts the tables between their marks in a file."""
    before, rest = readme.read_text().split(BEGIN)
    after = rest.split(END)[1]
    readme.write_text(f"{before}{BEGIN}\n\n{text}\n{END}{after}")
