#!/usr/bin/env python3
"""ros_e2e_test.py TRESTLE: end-to-end protection between two bridges, as real ROS 2 nodes see it: topics and services that
know nothing of it, and its state as DiagnosticArray.

  ROS node, domain 1 -- bridge A (protects events, answers) -- SOME/IP -- bridge B (checks) -- ROS node, domain 2
"""
import tempfile
import unittest

from ros_test import A, B, PATIENCE, Bridge, Ros

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus  # noqa: E402  rclpy is there, or ros_test had ended
from std_msgs.msg import String
from std_srvs.srv import SetBool

SPEED, SWITCH = "trestle: E2E of /speed", "trestle: E2E of answers to /switch"


def configuration(end):
    here = "port: 40001, " if end == "a" else ""
    return f"""\
someip: {{address: {A if end == 'a' else B}, sd: {{initial_delay_max: 20 ms, cyclic_offer_delay: 200 ms}}}}
dds: {{domain: {1 if end == 'a' else 2}, node: /trestle_{end}}}
diagnostics: {{period: 200 ms}}
routes:
  - {{topic: /speed, type: std_msgs/msg/String, direction: {'dds_to_someip' if end == 'a' else 'someip_to_dds'}, {here}
     service: 0x1000, instance: 1, eventgroup: 1, event: 0x8001, e2e: {{profile: 4, data_id: 7}}}}
methods:
  - {{ros_service: /switch, type: std_srvs/srv/SetBool, server: {'ros, offer: always' if end == 'a' else 'someip'}, {here}
     service: 0x1000, instance: 1, method: 1, e2e: {{profile: 4m, data_id: 8}}}}
"""


class RealRosE2e(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        for end in "ab":
            self.addCleanup(Bridge(folder.name, end, configuration(end)).stop)
        self.one = Ros(1, "one")
        self.addCleanup(self.one.close)
        self.two = Ros(2, "two")
        self.addCleanup(self.two.close)

    def both(self, condition, patience=PATIENCE):
        """Waits, working both nodes."""
        return self.two.wait(lambda: (self.one.executor.spin_once(timeout_sec=0.005), condition())[1], patience)

    def switch(self, client):
        return self.two.ask(lambda: client.call_async(SetBool.Request(data=True)), self.both)

    def test_state_is_published_as_diagnostics(self):
        node = self.two.node
        told = {}

        def on_diagnostics(message):
            told.update((status.name, status) for status in message.status)
            told["stamp"] = message.header.stamp
        diagnostics = node.create_subscription(DiagnosticArray, "/diagnostics", on_diagnostics, 10)
        self.assertTrue(self.both(lambda: {SPEED, SWITCH} <= told.keys()), told)
        self.assertEqual([told[name].level for name in (SPEED, SWITCH)], [DiagnosticStatus.STALE] * 2)

        seen = []
        speed = node.create_subscription(String, "/speed", seen.append, 10)
        publisher = self.one.node.create_publisher(String, "/speed", 10)
        switch = self.one.node.create_service(
            SetBool, "/switch", lambda request, response: (setattr(response, "success", request.data), response)[1])
        client = node.create_client(SetBool, "/switch")
        self.assertTrue(self.both(client.service_is_ready))

        def works():
            publisher.publish(String(data="fast"))
            answer = self.switch(client)
            return len(seen) > 2 and told[SPEED].level == told[SWITCH].level == DiagnosticStatus.OK and answer.success
        self.assertTrue(self.both(works), told)
        self.assertEqual(set(message.data for message in seen), {"fast"})
        values = {pair.key: pair.value for pair in told[SPEED].values}
        self.assertEqual((told[SPEED].message, values["state"], values["last check"]), ("valid", "valid", "ok"))
        self.assertEqual(told[SPEED].hardware_id, "SOME/IP 0x1000.0x0001 event 0x8001")
        self.assertEqual(told[SWITCH].hardware_id, "SOME/IP 0x1000.0x0001 method 0x0001")
        self.assertGreater(told["stamp"].sec, 1_700_000_000)

        # A call that goes wrong is one without success, and says why.
        self.one.node.destroy_service(switch)

        def refused():
            answer = self.switch(client)
            return not answer.success and "the answer is E_NOT_RE" in answer.message and answer.message
        self.assertTrue(self.both(refused))
        self.assertIn("of SOME/IP service 0x1000.0x0001 method 0x0001", refused())
        node.destroy_subscription(speed)
        node.destroy_subscription(diagnostics)

    def test_the_publisher_of_diagnostics_has_the_hash_of_its_type(self):
        node = self.two.node
        probe = node.create_publisher(DiagnosticArray, "/probe", 1)

        def hash_of(name, topic):
            found = []

            def look():
                found[:] = [info for info in node.get_publishers_info_by_topic(topic) if info.node_name == name]
                return found
            self.assertTrue(self.both(look), topic)
            return found[0].topic_type, str(found[0].topic_type_hash)
        self.assertEqual(hash_of("trestle_b", "/diagnostics"), hash_of("two", probe.topic_name))


if __name__ == "__main__":
    unittest.main(buffer=True)
