#!/usr/bin/env python3
"""parameter_ids_test.py TRESTLE ID...: the parameters in which requests and replies of ROS services tell what they belong to,
as tshark reads them on the cable. The bridge's have the IDs; a node's have the standard's and eProsima's, since Fast DDS 2.14.

  ROS node, domain 1 -- (cable, recorded) -- bridge A -- (cable, SOME/IP) -- bridge B -- ROS node, domain 2
"""
import os
import subprocess
import sys
import tempfile
import unittest

from ros_test import A, B, PATIENCE, Bridge, Ros, peer  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402

STANDARD, EPROSIMA = 0x0083, 0x800f
IDS = {int(id, 16) for id in sys.argv[1:]}
del sys.argv[1:]


def configuration(end):
    def method(name, id, server):
        return (f"  - {{ros_service: {name}, type: std_srvs/srv/SetBool, service: {id}, instance: 1, method: 1, server: {server}"
                f"{', port: 40001' if server == 'ros' else ''}}}\n")
    there, back = ("ros", "someip") if end == "a" else ("someip", "ros")
    return (f"someip: {{address: {A if end == 'a' else B}, sd: {{initial_delay_max: 20 ms, cyclic_offer_delay: 200 ms}}}}\n"
            f"dds: {{domain: {1 if end == 'a' else 2}, node: /trestle_{end}}}\nmethods:\n"
            + method("/there", 0x1000, there) + method("/back", 0x1001, back))


class ParameterIds(unittest.TestCase):
    def test_of_requests_and_replies(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        recorder = peer.Recorder(os.path.join(folder.name, "recorded.pcapng"))
        self.addCleanup(recorder.stop)
        for end in "ab":
            self.addCleanup(Bridge(folder.name, end, configuration(end)).stop)
        one, two = Ros(1, "one"), Ros(2, "two")
        self.addCleanup(one.close)
        self.addCleanup(two.close)

        def both(condition, patience=PATIENCE):
            return one.wait(lambda: (two.executor.spin_once(timeout_sec=0.005), condition())[1], patience)
        for server, caller, name in (one, two, "/there"), (two, one, "/back"):
            server.node.create_service(SetBool, name, lambda request, response: SetBool.Response(success=request.data))
            client = caller.node.create_client(SetBool, name)
            self.assertTrue(both(client.service_is_ready), name)
            self.assertTrue(both(lambda: caller.ask(lambda: client.call_async(SetBool.Request(data=True)), both).success), name)
        recorder.stop()
        wanted = f"rtps.param.id == {STANDARD:#x} || rtps.param.id == {EPROSIMA:#x}"
        # The port of a sender is of the system's choice, and may be that of another protocol.
        command = ["tshark", "-o", "udp.try_heuristic_first:TRUE", "-r", recorder.path, "-Y", wanted, "-T", "fields"]
        for field in "ip.src", "rtps.sm.wrEntityId", "rtps.param.id":
            command += ["-e", field]
        lines = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True, text=True).stdout
        sent = {}  # the ids, by sender and writer
        for line in lines.splitlines():
            source, writers, ids = line.split("\t")
            of_writer = sent.setdefault((source, frozenset(writers.split(","))), set())
            of_writer.update({int(id, 16) for id in ids.split(",")} & {STANDARD, EPROSIMA})
        of_bridge = [ids for (source, _), ids in sent.items() if source == A]
        of_node = [ids for (source, _), ids in sent.items() if source != A]
        self.assertEqual(of_bridge, [IDS, IDS], sent)  # of requests, and of replies
        self.assertEqual(of_node, [{STANDARD, EPROSIMA}] * 2, sent)


if __name__ == "__main__":
    unittest.main(buffer=True)
