"""The world of a fault: honest flows through a bridge, the fault in the middle of them, and what holds afterwards."""
import os
import pathlib
import re
import signal
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "hostile"))
# pylint: disable=wrong-import-position
import flows
from faulty_calls import FaultyCalls
from figures import Figure, at_least, at_most, holds
from lab import FOLDER, PATIENCE, Failed
from world import FLOWS, Scale, World

FULL = Scale(False, 2, 10, 200_000, 20, 100, 50)
SHORT = Scale(True, 1, 2, 50_000, 10, 20, 10)
AGAIN_S = 2.0  # offers come every second (cyclic_offer_delay), and a Subscribe answers each of them
SETTLED_S = 0.5  # from the first message of a flow on
ALL_FLOWS = "events_out", "clouds_out", "clouds_out_tcp", "events_in", "clouds_in", "calls_udp", "calls_tcp"


class FaultWorld(World):
    """Beside what World has: programs that end and begin again, and a bridge whose system calls can be made to fail."""

    def __init__(self, lab, programs, scale, progress):
        trestle, flow, self.library = programs
        super().__init__(lab, (trestle, flow), scale, progress)
        self.calls = None
        self.prefix = []  # before the command of a bridge
        self.after_s = 2 if scale.short else 8

    def preload(self):
        """To be called first: calls of bridges can be made to fail, see FaultyCalls."""
        self.calls = FaultyCalls(self.library, FOLDER / self.lab.name / "faults")

    def bridge(self, host, name, body, **options):
        """As World has it, with what stands before its command."""
        start, prefix = self.lab.start, [*self.prefix, *(self.calls.prefix if self.calls else [])]
        self.lab.start = lambda host, name, *command: start(host, name, *prefix, *command)
        try:
            return super().bridge(host, name, body, **options)
        finally:
            self.lab.start = start

    def two_bridges(self, *names):
        """Topics of the car that a second bridge writes in another domain, on the second host. Gives that bridge."""
        self.flows = [FLOWS[name] for name in names]
        routes = "".join(flow.route for flow in self.flows)
        self.car = self.bridge("car", "bridge", "routes:\n" + routes)
        other = self.bridge("second", "second-bridge", "routes:\n" + re.sub(r", port: \d+", "", routes).replace(
            "dds_to_someip", "someip_to_dds"), domain=81)
        self.car_end = self.end("car", "car-end", "dds", 80, *[flow.ends(self.scale)[0] for flow in self.flows])
        self.honest_end = self.end("second", "honest-end", "dds", 81, *[f"{name}=read:/{name}:cloud" for name in names])
        self.wait_for_flows()
        return other

    # --- Programs that end and begin again ------------------------------------------------------------------

    def kill(self, program):
        program.process.kill()
        program.process.wait()
        self.lab.programs.remove(program)

    def again(self, program):
        """Starts a program that was killed once more, with the same command. Its log and output go on."""
        command = program.process.args[2:]  # behind nsenter and its network
        host = program.process.args[1].rpartition("/")[2]
        return self.lab.start(host, program.name, *command)

    def stop_and_go(self, program, seconds):
        program.send_signal(signal.SIGSTOP)
        self.pass_time(seconds, "stopped")
        program.send_signal(signal.SIGCONT)

    # --- What the bridge tells ------------------------------------------------------------------------------

    def counters_of(self, program):
        """What a bridge prints on SIGUSR1: {line: {counter: number}}."""
        printed = program.out.stat().st_size
        program.send_signal(signal.SIGUSR1)
        end = time.monotonic() + PATIENCE
        while True:
            text = program.out.read_text(encoding="utf-8")[printed:]
            if re.search(r"^SOME/IP-SD: .*\n", text, re.MULTILINE):
                break
            if time.monotonic() > end:
                raise Failed(f"{program.name} prints no counters")
            time.sleep(0.05)
        return {line.partition(": ")[0]: {name: int(number) for name, number in re.findall(r"(\w+) (\d+)", line.partition(": ")[2])}
                for line in text.splitlines()}

    def all_flows(self):
        """What the receiver of each flow has written, and `sent_by_other`, what its sender has sent."""
        found = {}
        for flow in self.flows:
            sender, receiver = self._ways(flow)
            found[flow.name] = receiver or sender
            found[flow.name].sent_by_other = sender.sent
        return found

    @staticmethod
    def flows_of(program):
        """What an end of flows has written."""
        return flows.read(program.out)[0]

    @staticmethod
    def descriptors(program):
        return len(os.listdir(f"/proc/{program.pid}/fd"))

    # --- A fault, and what holds afterwards -----------------------------------------------------------------

    def hold_after(self, fault, *, again_s=AGAIN_S, again_tcp_s=None, lossless=True, grows=None, same_bridge=True,
                   undisturbed=False):
        """Does it, and judges each flow, the memory, the descriptors and the log from its end on.

        fault: a function; what it does is over when it returns. again_s, again_tcp_s: within which each flow over UDP and
        over TCP flows again. lossless: from then on nothing is lost. grows: bytes that memory may grow by.
        undisturbed: nothing is lost meanwhile, either."""
        self.pass_time(self.scale.quiet_s, "before the fault")
        memory, descriptors, log = self.car.rss(), self.descriptors(self.car), self.car.log_bytes()
        began = time.monotonic_ns()
        fault()
        healed = time.monotonic_ns()
        self.progress("waits for all flows")
        firsts = self._await_flows(healed)
        self.pass_time(self.after_s, "after the fault")
        ended = time.monotonic_ns()
        self.pass_time(1, "what comes late")
        self.check()
        self._judge_again({name: (first - healed) / 1e9 for name, first in firsts.items()}, again_s, again_tcp_s or again_s)
        if undisturbed:
            seen = {flow.name: self._seen(flow, began, healed) for flow in self.flows}
            worst = min(seen, key=lambda name: seen[name].percent)
            self.figures.append(at_least(f"kept meanwhile ({worst})", seen[worst].percent, 99, "%"))
        if lossless:
            seen = {flow.name: self._seen(flow, firsts[flow.name] + int(SETTLED_S * 1e9), ended) for flow in self.flows}
            worst = min(seen, key=lambda name: seen[name].percent)
            self.figures.append(at_least(f"kept from then on ({worst})", seen[worst].percent, 99, "%"))
            self.figures.append(at_most("doubled or made up", sum(one.extra + one.forged for one in seen.values()), 0))
        self.figures.append(holds("the bridge goes on", self.car.running()))
        if same_bridge:
            after, more = self._settled_memory(memory, grows)
            self.figures.append(Figure("memory afterwards", after / 1e6, "MB", f"+ {more / 1e6:.1f} MB", after <= memory + more,
                                       alone=memory / 1e6))
            self.figures.append(at_most("descriptors afterwards", self._settled_descriptors(descriptors), descriptors))
        self.figures.append(at_most("log", (self.car.log_bytes() - log) / 1e3, 64, "kB"))

    def _judge_again(self, times, again_s, again_tcp_s):
        for names, limit in ([name for name in times if not name.endswith("tcp")], again_s), (
                [name for name in times if name.endswith("tcp")], again_tcp_s):
            if names:
                worst = max(names, key=times.get)
                self.figures.append(at_most(f"flows again after ({worst})", times[worst], limit, "s", timed=True))

    def _settled_memory(self, before, grows):
        more = int(before * 0.1) + (grows or 4_000_000)
        end = time.monotonic() + 15
        while (after := self.car.rss()) > before + more and time.monotonic() < end:
            self.pass_time(0.5, "memory goes back")
        return after, more

    def _settled_descriptors(self, before):
        end = time.monotonic() + 15
        while (after := self.descriptors(self.car)) > before and time.monotonic() < end:
            self.pass_time(0.5, "descriptors are closed")
        return after

    def _ways(self, flow):
        car, honest = self._ends()
        one, other = car[flow.name], honest[flow.name]
        return (other, None) if flow.kind == "calls" else (one, other) if one.sent else (other, one)

    def _await_flows(self, since):
        """When the first message came of each flow that was sent since then."""
        firsts = {}

        def all_flow():
            for flow in self.flows:
                sender, receiver = self._ways(flow)
                times = [came for sent, came in (sender.calls if receiver is None else receiver.received)
                         if sent >= since and came]
                if times:
                    firsts[flow.name] = min(times)
            return len(firsts) == len(self.flows)
        try:
            self.wait(all_flow, "")
        except Failed as error:
            silent = ", ".join(flow.name for flow in self.flows if flow.name not in firsts)
            raise Failed(str(error) or f"flows never again: {silent}") from error
        return firsts

    def _seen(self, flow, begin, end):
        sender, receiver = self._ways(flow)
        return flows.calls(sender, begin, end) if receiver is None else flows.events(sender, receiver, begin, end)


__all__ = ["ALL_FLOWS", "FLOWS", "FULL", "SHORT", "Failed", "FaultWorld", "Figure", "at_least", "at_most", "holds"]
