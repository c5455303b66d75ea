#!/usr/bin/env python3
"""ros_service_test.py TRESTLE: what ROS 2 nodes see of services that are methods at the other side of two bridges, and
messages without fields; ros_calls_test.py has the calls.

  ROS client, domain 2 -- bridge B (server: someip) -- SOME/IP -- bridge A (server: ros) -- ROS server, domain 1
"""
import signal
import sys
import tempfile
import unittest

from ros_test import A, B, PATIENCE, Bridge, Ros

from std_srvs.srv import Empty, SetBool, Trigger  # noqa: E402  rclpy is there, or ros_test had ended
from test_msgs.srv import BasicTypes  # noqa: E402

SERVICES = [("/set", "std_srvs/srv/SetBool"), ("/go", "std_srvs/srv/Trigger"), ("/clear", "std_srvs/srv/Empty"),
            ("/basic", "test_msgs/srv/BasicTypes")]


def configuration(end):
    text = (f"someip: {{address: {A if end == 'a' else B}, sd: {{initial_delay_max: 20 ms, cyclic_offer_delay: 200 ms}}}}\n"
            f"dds: {{domain: {1 if end == 'a' else 2}, node: /trestle_{end}}}\n"
            f"types: {{paths: [{sys.prefix}]}}\nmethods:\n")
    for i, (name, kind) in enumerate(SERVICES):
        text += (f"  - {{ros_service: {name}, type: {kind}, service: 0x1000, instance: 1, method: {i + 1}, "
                 f"{'server: ros, port: 40001, offer: always' if end == 'a' else 'server: someip'}, timeout: 10 s}}\n")
    return text


class RealRosServices(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.bridges = {}
        for end in "ab":
            self.bridges[end] = Bridge(folder.name, end, configuration(end))
            self.addCleanup(self.bridges[end].stop)
        self.one = Ros(1, "one")
        self.addCleanup(self.one.close)
        self.two = Ros(2, "two")
        self.addCleanup(self.two.close)

    def call(self, client, request):
        return self.two.ask(lambda: client.call_async(request), self.both)

    def both(self, condition, patience=PATIENCE):
        """Waits, working both nodes."""
        return self.two.wait(lambda: (self.one.executor.spin_once(timeout_sec=0.005), condition())[1], patience)

    def test_messages_without_fields_and_all_basic_types_arrive(self):
        def on_go(_, response):
            response.success = True
            response.message = "gone \u00e4\u20ac"
            return response

        def on_basic(request, response):
            for field in request.get_fields_and_field_types():
                setattr(response, field, getattr(request, field))
            return response

        one, two = self.one.node, self.two.node
        cleared = []
        one.create_service(Trigger, "/go", on_go)
        one.create_service(Empty, "/clear", lambda _, response: (cleared.append(1), response)[1])
        one.create_service(BasicTypes, "/basic", on_basic)
        clients = {name: two.create_client(kind, name) for name, kind in
                   (("/go", Trigger), ("/clear", Empty), ("/basic", BasicTypes))}
        for client in clients.values():
            self.assertTrue(self.both(client.service_is_ready), client.srv_name)
        # The method is offered in any case, and its server may be found later.
        self.assertTrue(self.both(lambda: self.call(clients["/go"], Trigger.Request()) ==
                                  Trigger.Response(success=True, message="gone \u00e4\u20ac")))
        self.assertEqual(self.call(clients["/clear"], Empty.Request()), Empty.Response())
        self.assertEqual(set(cleared), {1})
        basic = BasicTypes.Request(bool_value=True, byte_value=b"\x07", char_value=200, float32_value=1.5,
                                   float64_value=-2.25, int8_value=-8, uint8_value=8, int16_value=-16, uint16_value=16,
                                   int32_value=-32, uint32_value=32, int64_value=-(1 << 40), uint64_value=1 << 63,
                                   string_value="text")
        answer = self.call(clients["/basic"], basic)
        for field in basic.get_fields_and_field_types():
            self.assertEqual(getattr(answer, field), getattr(basic, field), field)

    def test_the_service_is_ready_only_while_the_method_is_offered(self):
        client = self.two.node.create_client(SetBool, "/set")
        self.assertTrue(self.both(client.service_is_ready))
        self.bridges["a"].process.send_signal(signal.SIGTERM)
        self.assertTrue(self.both(lambda: not client.service_is_ready()))

    def test_the_graph_tells_who_serves_and_calls(self):
        wanted = sorted((name, [kind]) for name, kind in SERVICES)

        def known(node, name, of):
            return name in node.get_node_names() and wanted == sorted(of(name, "/"))
        one, two = self.one.node, self.two.node
        self.assertTrue(self.both(lambda: known(one, "trestle_a", one.get_client_names_and_types_by_node)))
        self.assertTrue(self.both(lambda: known(two, "trestle_b", two.get_service_names_and_types_by_node)))

    def test_requests_and_replies_have_the_hashes_that_ros_gives_them(self):
        kinds = {"/set": SetBool, "/go": Trigger, "/clear": Empty, "/basic": BasicTypes}
        ends = [self.one.node.create_service(kind, name, lambda _, response: response) for name, kind in kinds.items()]
        ends += [self.two.node.create_client(kind, name) for name, kind in kinds.items()]
        for name in kinds:
            for ros, own, bridge in (self.one, "one", "trestle_a"), (self.two, "two", "trestle_b"):
                for topic in f"rq{name}Request", f"rr{name}Reply":
                    self.assertTrue(self.both(lambda: {own, bridge} <= ros.hashes(topic).keys()), (topic, ros.hashes(topic)))
                    hashes = ros.hashes(topic)
                    self.assertTrue(hashes[own].startswith("RIHS01_"), hashes)
                    self.assertEqual(hashes[bridge], hashes[own], topic)
        del ends


if __name__ == "__main__":
    unittest.main(buffer=True)
