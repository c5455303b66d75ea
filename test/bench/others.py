"""vsomeip, measured as ours is, where it is installed."""
import json
import os
import tempfile
import time

from measures import SIZES, window

SERVICE, INSTANCE, EVENT = "0x7e57", "0x0001", "0x8001"
TRIES = 4  # of each measure: a client does not always find the service


def configuration(side, address, server):
    """Tuned: nothing waits for others to share its datagram, and segments do not wait for one another."""
    at_once = {f"{what}-time-{kind}": "0" for what in ("debounce", "max-retention") for kind in ("request", "response")}
    one = {"debounce-time": "0", "maximum-retention-time": "0"}
    service = {"service": SERVICE, "instance": INSTANCE, "unreliable": "30509",
               "reliable": {"port": "30510", "enable-magic-cookies": "false"},
               "events": [{"event": EVENT, "is_reliable": "false"}],
               "eventgroups": [{"eventgroup": "0x0001", "events": [EVENT]}],
               "debounce-times": {"requests": {"0x0001": one, "0x0003": one, "0x0004": one},
                                  "responses": {"0x0001": one, EVENT: one}},
               "someip-tp": {"service-to-client": [{"method": EVENT, "max-segment-length": "1392",
                                                    "separation-time": "0"}]}}
    if side == "b":
        service["unicast"] = server
    return {"unicast": address, "network": f"trestle-bench-{os.getpid()}-{side}",
            "logging": {"level": "error", "console": "false"},
            "applications": [{"name": "bench", "id": "0x1277" if side == "a" else "0x1288"}], "services": [service],
            "routing": "bench", "npdu-default-timings": at_once, "max-payload-size-unreliable": "8000000",
            "max-payload-size-reliable": "8000000", "udp-receive-buffer-size": "8388608",
            "service-discovery": {"enable": "true", "multicast": "224.244.224.245", "port": "30490", "protocol": "udp",
                                  "initial_delay_min": "0", "initial_delay_max": "1", "repetitions_base_delay": "30",
                                  "repetitions_max": "3", "ttl": "3", "cyclic_offer_delay": "500",
                                  "request_response_delay": "1"}}


class Vsomeip:
    def __init__(self, measures):
        self.measures = measures
        self.program = measures.programs["vsomeip"]
        self.folder = tempfile.TemporaryDirectory(prefix="trestle-bench-")
        self.there = self.program.exists()

    def environment(self, side):
        address = self.measures.lab.address
        file = os.path.join(self.folder.name, side + ".json")
        with open(file, "w", encoding="utf-8") as out:
            json.dump(configuration(side, address[side + "4"], address["a4"]), out)
        return {"VSOMEIP_CONFIGURATION": file, "VSOMEIP_APPLICATION_NAME": "bench"}

    def start(self):
        if self.there:
            self.measures.lab.start("a", self.program, "server", environment=self.environment("a"))
            time.sleep(1)

    def round(self):
        if not self.there:
            return

        def client(*arguments, seconds=self.measures.seconds):
            return lambda: self.measures.lab.run("b", self.program, *arguments, seconds, environment=environment)

        def take(name, measure):
            self.measures.take(f"vsomeip {name}", measure, tries=TRIES)

        environment, rate = self.environment("b"), self.measures.rate_seconds
        take("udp call", client("calls", "udp", 64, 1))
        take("tcp call", client("calls", "tcp", 64, 1))
        take("calls 32", client("calls", "udp", 64, 32, seconds=rate))
        for name, size in SIZES.items():
            take(f"latency {name}", client("events", size, 1))
            take(f"rate {name}", client("events", size, window(size), seconds=rate))
        # With no limit its queue would grow, and be there still when the next thing is measured.
        take("events 64 B", client("events", 64, 256, seconds=rate))
        self.measures.silent("vsomeip silent", "a4", "vsomeip=1")
