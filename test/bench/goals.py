"""The goals of `./run bench`, as ratios within one run."""
from measures import CLOUDS, FULL, LARGE_CALLS, POINTS, READERS, SILENT, SIZES, WATCHED, WATCHED_RATE, WIRE, middle, series


def ns(value):
    """Three digits that matter."""
    for size, unit in ((1e9, "s"), (1e6, "ms"), (1e3, "µs")):
        if value >= size * 0.9995:
            return f"{value / size:.3g} {unit}" if value < size * 999.5 else f"{value / size:.0f} {unit}"
    return f"{value:.3g} ns"


def per_second(value):
    return f"{value / 1e3:,.0f} k/s" if value >= 1e4 else f"{value:,.0f} /s"


def megabytes(value):
    return f"{value:,.0f} MB/s"


def span(show, numbers):
    return f"{show(min(numbers))} – {show(max(numbers))}" if len(numbers) > 1 else ""


class Goal:
    """A row of the table: of `floor` and `ours` a number for each round. `at_most` or `at_least` bound the median of the
    rounds' ours / floor; `limit` and `least` bound the median of ours itself; without any of them the row only informs.
    What was `lost` on the way, in all rounds, has to be nothing, and more than half of the rounds have to have been
    measured. `remark` is something to know of ours."""

    def __init__(self, what, show, floor, ours, at_most=None, at_least=None, limit=None, least=None, lost=(), remark=""):
        self.what, self.show, self.floors, self.all_ours = what, show, floor or [], ours or []
        self.at_most, self.at_least, self.limit, self.least = at_most, at_least, limit, least
        self.lost = sum(number or 0 for number in lost)
        self.remark = remark

    @property
    def floor(self):
        return middle(self.floors)

    @property
    def ours(self):
        return middle(self.all_ours)

    @property
    def ratios(self):
        """Of the rounds in which both were measured."""
        return [ours / floor for floor, ours in zip(self.floors, self.all_ours) if floor and ours is not None]

    @property
    def ratio(self):
        return middle(self.ratios)

    @property
    def is_judged(self):
        return any(bound is not None for bound in (self.at_most, self.at_least, self.limit, self.least))

    @property
    def goal(self):
        if self.limit is not None:
            return f"≤ {self.show(self.limit)}"
        if self.least is not None:
            return f"≥ {self.show(self.least)}"
        if self.at_most is not None:
            return f"≤ {self.at_most} ×"
        return f"≥ {self.at_least} ×" if self.at_least is not None else ""

    @property
    def measured(self):
        """What the goal speaks of, for each round."""
        is_ratio = self.limit is None and self.least is None and (self.is_judged or self.floors)
        return self.ratios if is_ratio else [ours for ours in self.all_ours if ours is not None]

    @property
    def failed(self):
        """Rounds in which something was not measured."""
        return max(len(self.floors), len(self.all_ours)) - len(self.measured)

    def is_within(self, number):
        upper = self.limit if self.limit is not None else self.at_most
        return number <= upper if upper is not None else number >= (
            self.least if self.least is not None else self.at_least)

    @property
    def met(self):
        """Nothing when it was not measured, or there is no goal."""
        if not self.is_judged or len(self.measured) <= self.failed:
            return None
        return not self.lost and self.is_within(middle(self.measured))

    @property
    def others(self):
        """How many lie on the other side of the goal than their median."""
        if self.met is None or self.lost:
            return 0
        return sum(self.is_within(number) is not self.met for number in self.measured)

    def cells(self):
        verdict = {True: "met", False: "**missed**"}.get(self.met)
        verdict = verdict or ("not measured" if self.is_judged or not self.measured else "")
        remarks = [f"{'missed' if self.met else 'met'} {self.others} of {len(self.measured)} times"] * bool(self.others)
        remarks += [f"{self.failed} of {self.failed + len(self.measured)} rounds failed"] * bool(
            self.failed and self.measured)
        remarks += [f"{self.lost:.0f} lost"] * bool(self.lost) + [self.remark] * bool(self.remark)
        if self.ratios:
            between = span("{:.2f}".format, self.ratios)
        else:
            between = span(self.show, [ours for ours in self.all_ours if ours is not None])
        return [self.what, "" if self.floor is None else self.show(self.floor),
                "" if self.ours is None else self.show(self.ours),
                "" if self.ratio is None else f"{self.ratio:.2f}", between, self.goal,
                "; ".join([verdict] * bool(verdict) + remarks)]


def sound(values, name, *path):
    """As series(), of a floor: what has lost something on the way is slower by its waiting for that, and no floor."""
    return [None if value and value.get("lost") else number
            for value, number in zip(values.get(name, []), series(values, name, *path))]


def lost_in_words(values, **names):
    """What part of all that was sent, in all rounds, did not come: who by name of a measure."""
    found = {}
    for who, name in names.items():
        lost, came = (sum(number or 0 for number in series(values, name, key)) for key in ("lost", "received"))
        if came:
            found[who] = f"{who} {100 * lost / (lost + came):.2g} %" if lost else f"{who} nothing"
    return "lost: " + ", ".join(found.values()) if found else ""


def silent(values, name, what):
    """vsomeip is in the place of a floor, where it was measured."""
    ours, theirs = (series(values, f"{stack}silent {name}", "megabytes_per_second") for stack in ("", "vsomeip "))
    is_there = middle(theirs) is not None
    took = middle(series(values, f"silent {name}", "latency_ns", "p50"))
    lost, received = (series(values, f"silent {name}", key) for key in ("lost", "received"))
    sent = sum(number or 0 for number in lost + received)
    return [Goal(f"{what}: rate, over vsomeip's", megabytes, theirs, ours, at_least=1.3 if is_there else None,
                 remark="; ".join(["vsomeip is not installed: no goal"] * (not is_there) + (
                     [f"first to last segment {ns(took)} (p50)"] if took else []))),
            Goal(f"{what}: lost", "{:,.0f}".format, None, lost, limit=0, lost=lost, remark=f"of {sent:,} messages in all rounds")]


def communication(values):
    def at(name, *path):
        return series(values, name, *path)

    def latency(name, percentile):
        return at(name, "latency_ns", percentile)

    def floor_of(name, percentile):
        return sound(values, name, "latency_ns", percentile)

    def floor_rate(name):
        return sound(values, name, "megabytes_per_second")

    def both_ways(name):
        return [None if one_way is None else 2 * one_way for one_way in floor_of(name, "p50")]

    def rate(name):
        return at(name, "per_second")

    def lost_of(name):
        return at(name, "lost")

    # Who sends without a limit may send more than the other side can take: rates are of what came.
    lost, lost_beside_trains = (lost_in_words(values, floor=floor, ours="events 64 B")
                                for floor in ("flood floor", "trains floor"))
    rows = [
        Goal("UDP call 64 B, p50", ns, floor_of("udp floor", "p50"), latency("udp call", "p50"), at_most=1.5,
             lost=lost_of("udp call")),
        Goal("UDP call 64 B, p99", ns, floor_of("udp floor", "p99"), latency("udp call", "p99"), at_most=2,
             lost=lost_of("udp call")),
        Goal("TCP call 64 B, p50", ns, floor_of("tcp floor", "p50"), latency("tcp call", "p50"), at_most=1.5,
             lost=lost_of("tcp call")),
        Goal("calls, 32 in flight: over sendmmsg", per_second, rate("flood floor"), rate("calls 32"), at_least=0.6,
             lost=lost_of("calls 32")),
        Goal("events 64 B, received: over sendmmsg", per_second, rate("flood floor"), rate("events 64 B"),
             at_least=0.6, remark=lost),
        Goal(f"calls, 32 in flight: over trains of {WIRE} B", per_second, rate("trains floor"), rate("calls 32")),
        Goal(f"events 64 B, received: over trains of {WIRE} B", per_second, rate("trains floor"), rate("events 64 B"),
             remark=lost_beside_trains),
        Goal("32 calls in flight through Proxy: over Node::call", per_second, at("calls by both", "node", "per_second"),
             at("calls by both", "proxy", "per_second"), at_least=0.9, lost=lost_of("calls by both")),
        Goal("processor time of the client for one of them: over Node::call", ns, at("calls by both", "node", "cpu_ns"),
             at("calls by both", "proxy", "cpu_ns"), at_most=1.1, lost=lost_of("calls by both")),
    ]
    rows += [
        Goal("events 64 B, one `notify()` a handler, received: over a loop of sendto", per_second, rate("sendto floor"),
             rate("events a turn"), at_least=0.9,
             remark=lost_in_words(values, floor="sendto floor", ours="events a turn")),
        Goal("the same, no UDP_SEGMENT: over a loop of sendto", per_second, rate("sendto floor"),
             rate("events a turn unsegmented"), remark=lost_in_words(values, ours="events a turn unsegmented")),
        Goal("UDP call 64 B, p50, all on one core, both ends Trestle", ns, floor_of("core floor", "p50"),
             latency("core call", "p50"), at_most=1.25, lost=lost_of("core call")),
        Goal("UDP call 64 B, p50, all on one core, a bare client", ns, floor_of("core floor", "p50"),
             latency("core bare client", "p50"), lost=lost_of("core bare client")),
    ]
    rows += [Goal(f"{kind.upper()} call 64 B, p50, both ends polling", ns, floor_of(f"{kind} busy floor", "p50"),
                  latency(f"{kind} busy call", "p50"), lost=lost_of(f"{kind} busy call")) for kind in ("udp", "tcp")]
    for size in LARGE_CALLS:
        rows.append(Goal(f"UDP call {size}, p50, default pacing", ns, both_ways(f"transfer {size}"),
                         latency(f"udp call {size}", "p50"), lost=lost_of(f"udp call {size}")))
        rows.append(Goal(f"TCP call {size}, p50", ns, floor_of(f"tcp floor {size}", "p50"), latency(f"tcp call {size}", "p50"),
                         lost=lost_of(f"tcp call {size}")))
    for size in LARGE_CALLS:
        rows.append(Goal(f"UDP echo {size} of a program without options, one host, p50", ns, both_ways(f"echo transfer {size}"),
                         latency(f"echo {size}", "p50"), at_most=1.3 if size == "1 MB" else None, lost=lost_of(f"echo {size}")))
    for size in SILENT:
        for reader in READERS:
            rows += silent(values, f"{size} {reader}", f"events of {size} to a silent receiver that {reader}")
    rows.append(Goal(f"bare TP loop 1 MB: over trains of {FULL} B, received", megabytes,
                     at("bulk floor", "megabytes_per_second"), at("tp floor rate 1 MB", "megabytes_per_second"),
                     remark=lost_in_words(values, floor="bulk floor")))
    for kind, words in ("tp", "not paced"), ("tp paced", "default pacing"):
        for size in SIZES:
            rows.append(Goal(f"TP event {size}, p50, {words}", ns, floor_of(f"tp floor latency {size}", "p50"),
                             latency(f"{kind} latency {size}", "p50"), at_most=1.5,
                             lost=lost_of(f"{kind} latency {size}")))
        for size in SIZES:
            rows.append(Goal(f"TP sustained {size}, {words}", megabytes,
                             floor_rate(f"tp floor rate {size}"),
                             at(f"{kind} rate {size}", "megabytes_per_second"), at_least=0.7,
                             lost=lost_of(f"{kind} rate {size}")))
    rows.append(Goal("TP sustained 1 MB, default pacing, no acknowledgements", megabytes,
                     at("tp flood 1 MB floor", "megabytes_per_second"), at("tp flood 1 MB", "megabytes_per_second"),
                     at_least=0.7, lost=lost_of("tp flood 1 MB"),
                     remark=lost_in_words(values, floor="tp flood 1 MB floor")))
    for size in SIZES:
        rows.append(Goal(f"TP sustained {size}, no UDP_SEGMENT: over sendmmsg", megabytes,
                         floor_rate(f"tp floor rate {size} sendmmsg"),
                         at(f"tp rate {size} sendmmsg", "megabytes_per_second"), at_least=0.8,
                         lost=lost_of(f"tp rate {size} sendmmsg")))
    return rows


def paths(values):
    """Two bridges, and a node alone."""
    def p50(name):
        return series(values, name, "latency_ns", "p50")

    def floor_of(name):
        return sound(values, name, "latency_ns", "p50")

    def floor(size, by=""):
        """Of the two ways to write a sample by this transport the one with the smaller median, for this size."""
        found = {way: middle(floor_of(f"dds {by}{way} {size}")) for way in ("asynchronous", "synchronous")}
        way = min((way for way in found if found[way]), key=found.get, default="synchronous")
        times = [2 * hop + transfer if hop and transfer else None
                 for hop, transfer in zip(floor_of(f"dds {by}{way} {size}"), floor_of(f"path transfer {size}"))]
        return times, f"floor: {way} hops" if middle(times) else ""

    rows = []
    kinds = ("path", "not paced"), ("path paced", "default pacing")
    for kind, words in kinds:
        for size in SIZES:
            times, remark = floor(size)
            rows.append(Goal(f"DDS, SOME/IP, DDS {size}, p50, {words}", ns, times, p50(f"{kind} {size}"), at_most=1.3,
                             lost=series(values, f"{kind} {size}", "lost"), remark=remark))
    for size in SIZES:
        times, remark = floor(size, "shared ")
        rows.append(Goal(f"the same {size} by shared memory, default pacing", ns, times, p50(f"path shared {size}"),
                         remark="; ".join(part for part in (lost_in_words(values, ours=f"path shared {size}"), remark) if part)))
    for size in SIZES:
        times, remark = floor(size, "shared ")
        rows.append(Goal(f"the bridges by UDP, hops by shared memory {size}, default pacing", ns, times, p50(f"path paced {size}"),
                         remark=remark))
    rows += looked_at(values)
    for kind, words in ("idle", "alone"), ("idle beside", "with a subscription"):
        rows.append(Goal(f"idle node {words}, memory (RSS)", lambda kb: f"{kb / 1024:.1f} MB", None,
                         series(values, kind, "resident_kb"), limit=6 * 1024))
        # The last one ends the measurement; below 0: one was for more than one datagram.
        wakeups = [(idle["wakeups"] - 1 - idle["discovery_datagrams"]) / idle["seconds"]
                   for idle in values.get(kind, []) if idle]
        rows.append(Goal(f"idle node {words}, wake-ups beside SD", "{:.2f} /s".format, None, wakeups, limit=0))
    rows.append(Goal("start to first event", ns, None, series(values, "first event", "first_event_ns"), limit=30e6))
    return rows


def looked_at(values):
    """The floor is the same without a console."""
    def at(name, *path):
        return series(values, name, *path)

    def lost(*names):
        return [number for name in names for number in at(name, "lost")]

    more = [None if None in pair else pair[1] - pair[0]
            for pair in zip(at("path unseen", "resident_kb"), at("path seen", "resident_kb"))]
    recorded = middle([seen and seen["recorded"] for seen in at("path watched", "viewer")])
    return [
        Goal(f"two bridges {WATCHED}, with a console and nobody looking: CPU time a message", ns, at("path unseen", "cpu_ns"),
             at("path seen", "cpu_ns"), at_most=1.01, lost=lost("path unseen", "path seen")),
        Goal("a bridge with a console and nobody looking: more memory (RSS)", lambda kb: f"{kb / 1024:.1f} MB", None, more,
             limit=2 * 1024),
        Goal(f"two bridges {WATCHED} at {WATCHED_RATE} /s, with a viewer and a record of 32 MB/s: p50", ns,
             at("path unwatched", "latency_ns", "p50"), at("path watched", "latency_ns", "p50"), at_most=1.05,
             lost=lost("path unwatched", "path watched"), remark=f"{recorded * SIZES[WATCHED] / 1e6:,.0f} MB recorded" if recorded else ""),
        Goal("`trestle record` of clouds of 4 MB to a tmpfs: over what is published", megabytes, at("record", "published"),
             at("record", "megabytes_per_second"), at_least=1, lost=lost("record"))]


NESTED = {"transforms": "TFMessage of 1000", "path": "Path of 1000 poses",
          "markers/points:100": "MarkerArray of 100, of 100 points each",
          "markers/points:0": "MarkerArray of 100, without points",
          "markers_of_many_namespaces": "MarkerArray of 100, without points, of a namespace each",
          "diagnostics": "DiagnosticArray of 100, of 10 values each",
          "objects": "PredictedObjects of 100, of 5 paths of 10 poses each"}


def words(way):
    return {"to_someip": "to SOME/IP", "to_cdr": "to CDR"}[way]


def slowest(each):
    """Of lists of numbers the one whose median is the largest."""
    return max((numbers for numbers in each if middle(numbers) is not None), key=middle, default=[])


def percentile(samples, part):
    """The smallest that so many percent do not exceed."""
    ordered = sorted(samples)
    return ordered[max(0, -(-len(ordered) * part // 100) - 1)]


def conversion(values):
    def at(name, *path):
        return series(values, "conversion " + name, *path)

    def beside_memcpy(what, name, at_most):
        return Goal(what, ns, at(name, "floor", "ns"), at(name, "ns"), at_most=at_most)

    def swapped(what, name):
        """Of few numbers what does not depend on their number is a good part of it."""
        row = beside_memcpy(what, name, 1.5)
        if row.met is False:
            row.remark = f"by {row.ours - 1.5 * row.floor:.0f} ns"
        return row

    rows = []
    for way in "to_someip", "to_cdr":
        rows.append(Goal(f"PointCloud2 {words(way)} by reference, alone, slowest size", ns, None,
                         slowest(at(f"point_cloud_{way}/points:{points}", "ns") for points in POINTS), limit=3000))
    for way in "to_someip", "to_cdr":
        rows.append(Goal(f"the same {words(way)} with another `frame_id` each time, slowest size", ns, None,
                         slowest(at(f"point_cloud_of_changing_frame_{way}/points:{points}", "ns") for points in POINTS),
                         limit=3000))
    for way in "to_someip", "to_cdr":
        rows.append(Goal(f"Image of 1920 x 1080 {words(way)} by reference, alone", ns, None, at(f"image_{way}", "ns"), limit=3000))
    for way in "to_someip", "to_cdr":
        for part, percent in ("p50", 50), ("p99", 99):
            # A number for each size, not each round: what counts is the largest.
            found = [percentile([one[way + "_ns"] for one in samples], percent)
                     for size in CLOUDS.values() if (samples := values.get(f"checkpoints {size}"))]
            rows.append(Goal(f"PointCloud2 {words(way)} in a running bridge, {part}, slowest size", ns, None,
                             [max(found)] if found else None, limit=3000))
    for way, name in ("to SOME/IP, copied", "to_someip_copying"), ("to CDR, copied", "to_cdr_and_copied_once"):
        rows += [beside_memcpy(f"PointCloud2 of {points:,} points {way}", f"point_cloud_{name}/points:{points}", 1.15)
                 for points in POINTS]
    for way in "to_someip", "to_cdr":
        rows += [swapped(f"{floats:,} floats swapped {words(way)}", f"float_array_swapped_{way}/floats:{floats}")
                 for floats in (1000, 4000, 100_000, 2_000_000)]
        rows.append(swapped(f"LaserScan of 1,081 ranges and intensities {words(way)}", f"laser_scan_{way}"))
    for kind, what in NESTED.items():
        for way in "to_someip", "to_cdr":
            name, _, argument = kind.partition("/")
            name = f"{name}_{way}" + (f"/{argument}" if argument else "")
            rows.append(Goal(f"{what}, {words(way)}", megabytes, at(name, "floor", "megabytes_per_second"),
                             at(name, "megabytes_per_second"), least=1000))
    return rows
