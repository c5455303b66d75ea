"""The goals of `./run bench`, as ratios of medians of one run."""
from measures import SIZES, median


def ns(value):
    """Three digits that matter."""
    for size, unit in ((1e9, "s"), (1e6, "ms"), (1e3, "µs")):
        if value >= size * 0.9995:
            return f"{value / size:.3g} {unit}" if value < size * 999.5 else f"{value / size:.0f} {unit}"
    return f"{value:.3g} ns"


def rate(value):
    return f"{value / 1e3:,.0f} k/s" if value >= 1e4 else f"{value:,.0f} /s"


def megabytes(value):
    return f"{value:,.0f} MB/s"


class Goal:
    """A row of the table. `at_most` or `at_least` bound ours / floor; `limit` and `least` bound
    ours itself."""

    def __init__(self, what, show, floor, ours, at_most=None, at_least=None, limit=None, least=None):
        self.what, self.show, self.floor, self.ours = what, show, floor, ours
        self.at_most, self.at_least, self.limit, self.least = at_most, at_least, limit, least

    @property
    def ratio(self):
        return self.ours / self.floor if self.floor and self.ours is not None else None

    @property
    def goal(self):
        if self.limit is not None:
            return f"≤ {self.show(self.limit)}"
        if self.least is not None:
            return f"≥ {self.show(self.least)}"
        return f"≤ {self.at_most} ×" if self.at_most is not None else f"≥ {self.at_least} ×"

    @property
    def met(self):
        """Nothing when it was not measured."""
        if self.limit is not None:
            return None if self.ours is None else self.ours <= self.limit
        if self.least is not None:
            return None if self.ours is None else self.ours >= self.least
        if self.ratio is None:
            return None
        return self.ratio <= self.at_most if self.at_most is not None else self.ratio >= self.at_least

    def cells(self):
        verdict = {None: "not measured", True: "met", False: "**missed**"}[self.met]
        return [self.what, "" if self.floor is None else self.show(self.floor),
                "" if self.ours is None else self.show(self.ours),
                "" if self.ratio is None else f"{self.ratio:.2f}", self.goal, verdict]


def communication(values):
    def at(name, *path):
        return median(values, name, *path)

    def latency(name, percentile):
        return at(name, "latency_ns", percentile)

    rows = [
        Goal("UDP call 64 B, p50", ns, latency("udp floor", "p50"), latency("udp call", "p50"), at_most=1.5),
        Goal("UDP call 64 B, p99", ns, latency("udp floor", "p99"), latency("udp call", "p99"), at_most=2),
        Goal("TCP call 64 B, p50", ns, latency("tcp floor", "p50"), latency("tcp call", "p50"), at_most=1.5),
        Goal("calls, 32 in flight", rate, at("flood floor", "per_second"), at("calls 32", "per_second"), at_least=0.6),
        Goal("events 64 B, received", rate, at("flood floor", "per_second"), at("events 64 B", "per_second"),
             at_least=0.6),
    ]
    for kind, words in ("tp", "not paced"), ("tp paced", "default pacing"):
        for size in SIZES:
            rows.append(Goal(f"TP event {size}, p50, {words}", ns, latency(f"tp floor latency {size}", "p50"),
                             latency(f"{kind} latency {size}", "p50"), at_most=1.5))
        for size in SIZES:
            rows.append(Goal(f"TP sustained {size}, {words}", megabytes,
                             at(f"tp floor rate {size}", "megabytes_per_second"),
                             at(f"{kind} rate {size}", "megabytes_per_second"), at_least=0.7))
    for size in SIZES:
        rows.append(Goal(f"TP sustained {size}, no UDP_SEGMENT: over sendmmsg", megabytes,
                         at(f"tp floor rate {size} sendmmsg", "megabytes_per_second"),
                         at(f"tp rate {size} sendmmsg", "megabytes_per_second"), at_least=0.8))
    return rows


def paths(values):
    """Two bridges, and a node alone."""
    def p50(name):
        return median(values, name, "latency_ns", "p50")

    rows = []
    for kind, words in ("path", "not paced"), ("path paced", "default pacing"):
        for size in SIZES:
            hop, transfer = p50(f"dds floor {size}"), p50(f"tp floor latency {size}")
            floor = 2 * hop + transfer if hop and transfer else None
            rows.append(Goal(f"DDS, SOME/IP, DDS {size}, p50, {words}", ns, floor, p50(f"{kind} {size}"), at_most=1.3))
    resident = median(values, "idle", "resident_kb")
    rows.append(Goal("idle node, memory (RSS)", lambda kb: f"{kb / 1024:.1f} MB", None, resident, limit=6 * 1024))
    wakeups = [max(0, idle["wakeups"] - 1 - idle["discovery_datagrams"]) / idle["seconds"]
               for idle in values.get("idle", [])]
    rows.append(Goal("idle node, wake-ups beside SD", "{:.1f} /s".format, None, wakeups[0] if wakeups else None,
                     limit=0))
    rows.append(Goal("start to first event", ns, None, median(values, "first event", "first_event_ns"), limit=30e6))
    return rows


NESTED = {"transforms": "TFMessage of 1000", "path": "Path of 1000 poses", "markers": "MarkerArray of 100"}
POINTS = (1_000, 5_000, 10_000, 50_000, 100_000, 200_000, 500_000)


def words(way):
    return {"to_someip": "to SOME/IP", "to_cdr": "to CDR"}[way]


def conversion(values):
    def at(name):
        return median(values, "conversion " + name, "ns")

    rows = []
    for way in "to_someip", "to_cdr":
        slowest = [at(f"point_cloud_{way}/points:{points}") for points in POINTS]
        rows.append(Goal(f"PointCloud2 {words(way)} by reference, the slowest size", ns, None,
                         max((time for time in slowest if time), default=None), limit=3000))
    for way, name in ("to SOME/IP, copied", "to_someip_copying"), ("to CDR, copied", "to_cdr_and_copied_once"):
        for points in POINTS:
            rows.append(Goal(f"PointCloud2 of {points:,} points {way}", ns, at(f"point_cloud_memcpy/points:{points}"),
                             at(f"point_cloud_{name}/points:{points}"), at_most=1.15))
    for way in "to_someip", "to_cdr":
        for floats in 4000, 100_000, 2_000_000:
            rows.append(Goal(f"{floats:,} floats swapped {words(way)}", ns,
                             at(f"float_array_memcpy/floats:{floats}"),
                             at(f"float_array_swapped_{way}/floats:{floats}"), at_most=1.5))
    for kind in "transforms", "path", "markers":
        for way in "to_someip", "to_cdr":
            rows.append(Goal(f"{NESTED[kind]} {words(way)}", megabytes,
                             median(values, f"conversion {kind}_memcpy", "megabytes_per_second"),
                             median(values, f"conversion {kind}_{way}", "megabytes_per_second"), least=1000))
    return rows
