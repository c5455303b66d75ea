"""What became of honest messages: of those that were sent in some time, how many came, how late, and what nobody sent."""
import collections


class Record:
    """The lines of a flow of hostile_flow: see flow.cpp."""

    def __init__(self):
        self.sent, self.calls, self.asked, self.there, self.forged = [], [], [], [], []
        self.came = collections.defaultdict(list)
        self.received = []  # (sent, came)


def read(path):
    """Flows of a program by their names, and when it was up."""
    flows = collections.defaultdict(Record)
    up = None
    with open(path, encoding="ascii") as file:
        for line in file:
            if not line.endswith("\n"):
                break  # still being written
            kind, flow, *numbers = line.split()
            numbers = [int(number) for number in numbers]
            if kind == "U":
                up = numbers[0]
            elif kind == "S":
                flows[flow].sent.append(numbers[0])
            elif kind == "R":
                flows[flow].received.append(tuple(numbers))
                flows[flow].came[numbers[0]].append(numbers[1])
            elif kind == "C":
                flows[flow].calls.append(tuple(numbers))
            elif kind == "F":
                flows[flow].forged.append(numbers[0])
            elif kind == "Q":
                flows[flow].asked.append(numbers[0])
            elif kind == "V":
                flows[flow].there.append(tuple(numbers))
    return flows, up


class Seen:
    """Of the messages of some time: `sent`, `kept` of them, `late` their p99 in ms, `forged` and `extra` ones."""

    def __init__(self, times, forged=0, extra=0):
        self.sent = len(times)
        came = sorted(time for time in times if time is not None)
        self.kept = len(came)
        self.percent = 100 * self.kept / self.sent if self.sent else 0.0
        self.late = came[min(len(came) - 1, int(0.99 * len(came)))] / 1e6 if came else float("inf")
        self.forged = forged
        self.extra = extra


def events(sender, receiver, begin, end):
    """Of what `sender` sent from `begin` to `end`. Forged is what came in that time and it never sent: later than that, one of
    two records may have been read before the other."""
    sent = [stamp for stamp in sender.sent if begin <= stamp < end]
    known = set(sender.sent)
    times = [receiver.came[stamp][0] - stamp if stamp in receiver.came else None for stamp in sent]
    forged = sum(1 for stamp, came in receiver.received if stamp not in known and begin <= came < end)
    extra = sum(len(receiver.came[stamp]) - 1 for stamp in sent if stamp in receiver.came)
    return Seen(times, forged, extra)


def calls(client, begin, end):
    return Seen([answered - called if answered else None for called, answered in client.calls if begin <= called < end])
