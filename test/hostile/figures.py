"""Figures, what they are to be, and the table that `./run test hostile` makes of them."""
import dataclasses
import json


@dataclasses.dataclass
class Figure:
    """One number of a scenario."""

    what: str
    value: float
    unit: str = ""
    goal: str = ""  # in words; none: it is only told
    met: bool = True
    alone: object = None  # the same without the attack
    timed: bool = False  # depends on how fast the machine is: not judged in the short form

    def text(self, number):
        if number is None:
            return ""
        if isinstance(number, float):
            number = f"{number:.0f}" if abs(number) >= 100 else f"{number:.2g}" if abs(number) < 1 else f"{number:.1f}"
        return f"{number} {self.unit}".strip()

    def verdict(self, short):
        if not self.goal:
            return ""
        if short and self.timed:
            return "not judged"
        return "met" if self.met else "MISSED"


def at_least(what, value, goal, unit="", **more):
    return Figure(what, value, unit, f">= {goal} {unit}".strip(), value >= goal, **more)


def at_most(what, value, goal, unit="", **more):
    return Figure(what, value, unit, f"<= {goal} {unit}".strip(), value <= goal, **more)


def holds(what, value, **more):
    """Something that has to be so."""
    return Figure(what, "yes" if value else "no", "", "yes", bool(value), **more)


def table(results, short):
    """All figures of all scenarios, aligned."""
    rows = [("scenario", "figure", "without attack", "with attack", "goal", "")]
    for result in results:
        if result["failed"]:
            rows.append((result["name"], result["failed"].splitlines()[0], "", "", "", "FAILED"))
        for figure in result["figures"]:
            rows.append((result["name"], figure.what, figure.text(figure.alone), figure.text(figure.value), figure.goal,
                         figure.verdict(short)))
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = []
    last = ""
    for row in rows:
        cells = [cell.ljust(width) if i in (0, 1, 4, 5) else cell.rjust(width)
                 for i, (cell, width) in enumerate(zip((row[0] if row[0] != last else "", *row[1:]), widths))]
        lines.append("  ".join(cells).rstrip())
        last = row[0]
    return "\n".join(lines)


def markdown(results):
    """A line a scenario, for docs/hostile.md: the worst of its flows, and what else was judged."""
    lines = ["| scenario | point | what happens | kept, at least | p99, the worst: without, with | new peer | memory | also |",
             "| --- | ---: | --- | ---: | ---: | ---: | ---: | --- |"]
    for result in results:
        kept = [one for one in result["figures"] if one.what.endswith(" kept")]
        late = [one for one in result["figures"] if one.what.endswith(" p99")]
        cells = {"kept": "", "late": "", "new": "", "memory": ""}
        if kept:
            worst = min(kept, key=lambda one: one.value)
            cells["kept"] = worst.text(worst.value)
        if late:
            worst = max(late, key=lambda one: one.value / max(one.alone or 1.0, 1.0))
            cells["late"] = f"{worst.text(worst.alone)}, {worst.text(worst.value)}"
        also = []
        for one in result["figures"]:
            if one.what == "a new honest peer is served after":
                cells["new"] = one.text(one.value)
            elif one.what == "memory afterwards":
                cells["memory"] = f"{one.text(one.alone)}, {one.text(one.value)}"
            elif one.goal and one not in kept and one not in late and one.what not in ("the bridge goes on", "log") \
                    and not one.what.endswith(" without the attack"):
                also.append(f"{one.what}: {one.text(one.value)}")
        goals = [one.what for one in result["figures"] if one.goal and not one.met]
        if goals or result["failed"]:
            also.append("**missed: " + (", ".join(goals) or result["failed"].splitlines()[0]) + "**")
        lines.append(f"| `{result['name']}` | {result['point']} | {result['what']} | {cells['kept']} | {cells['late']} | "
                     f"{cells['new']} | {cells['memory']} | {'; '.join(also)} |")
    return "\n".join(lines)


def missed(results, short):
    return sorted({result["name"] for result in results if result["failed"]
                   or any(figure.verdict(short) == "MISSED" for figure in result["figures"])})


def write_json(path, results, short):
    rows = [{**{key: result[key] for key in ("name", "point", "what", "failed", "counters")},
             "figures": [{**dataclasses.asdict(figure), "verdict": figure.verdict(short)} for figure in result["figures"]]}
            for result in results]
    path.write_text(json.dumps({"short": short, "scenarios": rows}, indent=1) + "\n", encoding="utf-8")
