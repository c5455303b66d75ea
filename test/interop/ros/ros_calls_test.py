#!/usr/bin/env python3
"""ros_calls_test.py TRESTLE: services and actions between real ROS 2 nodes that don't know of each other; between them
are two bridges, and a SOME/IP service with methods and events:

  ROS domain 1 -- (cable) -- bridge A, who offers -- (cable, SOME/IP) -- bridge B, who serves -- ROS domain 2
"""
import contextlib
import sys
import tempfile
import threading
import time
import unittest

from ros_test import A, B, PATIENCE, Bridge, Ros

import rclpy
from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci
from test_msgs.srv import Arrays


def configuration(end):
    offers = end == "a"
    server, port = ("ros", "port: 40001, ") if offers else ("someip", "")
    common = f"server: {server}, service: 0x4000, instance: 1, {port}"
    return f"""\
someip: {{address: {A if offers else B}, sd: {{initial_delay_max: 20 ms, cyclic_offer_delay: 200 ms}}}}
dds: {{domain: {1 if offers else 2}, node: /trestle_{end}}}
types: {{paths: [{sys.prefix}]}}
methods:
  - {{ros_service: /switch, type: std_srvs/srv/SetBool, method: 1, {common}}}
  - {{ros_service: /arrays, type: test_msgs/srv/Arrays, method: 2, {common}}}
actions:
  - {{action: /fibonacci, type: test_msgs/action/Fibonacci, eventgroup: 1, {common}
     methods: {{send_goal: 0x11, cancel_goal: 0x12, get_result: 0x13}}, events: {{feedback: 0x8011, status: 0x8012}}}}
"""


class Calls(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        for end in "ab":
            self.addCleanup(Bridge(folder.name, end, configuration(end)).stop)
        self.client = Ros(2, "client")
        self.addCleanup(self.client.close)
        self.ending = threading.Event()
        self.start_server()

    def start_server(self):
        """A node with both services and the action, on a thread of its own."""
        context = rclpy.Context()
        rclpy.init(context=context, domain_id=1)
        node = rclpy.create_node("server", context=context)
        group = ReentrantCallbackGroup()
        executor = MultiThreadedExecutor(4, context=context)
        executor.add_node(node)
        services = [node.create_service(SetBool, "/switch", self.switch, callback_group=group),
                    node.create_service(Arrays, "/arrays", self.arrays, callback_group=group)]
        # No negative orders; and those of up to 20 numbers cannot be cancelled.
        action = ActionServer(
            node, Fibonacci, "/fibonacci", self.count, callback_group=group,
            goal_callback=lambda goal: GoalResponse.REJECT if goal.order < 0 else GoalResponse.ACCEPT,
            cancel_callback=lambda goal: CancelResponse.REJECT if goal.request.order <= 20 else CancelResponse.ACCEPT)
        thread = threading.Thread(target=executor.spin)
        thread.start()

        def stop():
            executor.shutdown()
            thread.join(PATIENCE)
            action.destroy()
            for service in services:
                node.destroy_service(service)
            node.destroy_node()
            rclpy.shutdown(context=context)
        self.stop_server = self.enterContext(contextlib.ExitStack())
        self.stop_server.callback(stop)

    @staticmethod
    def switch(request, response):
        response.success, response.message = request.data, "on" if request.data else "off \u00e4\u20ac"
        return response

    @staticmethod
    def arrays(request, response):
        response.int32_values = request.int32_values
        response.string_values = request.string_values[::-1]
        response.float64_values = request.float64_values
        return response

    def count(self, goal):
        """Fibonacci numbers, one in 20 ms, until it is enough, the client has enough, or the node is to end."""
        feedback = Fibonacci.Feedback(sequence=[0, 1])
        while len(feedback.sequence) <= goal.request.order:
            if goal.is_cancel_requested:
                goal.canceled()
                return Fibonacci.Result(sequence=feedback.sequence)
            if self.ending.is_set():
                goal.abort()
                return Fibonacci.Result()
            feedback.sequence.append(feedback.sequence[-1] + feedback.sequence[-2])
            goal.publish_feedback(feedback)
            time.sleep(0.02)
        goal.succeed()
        return Fibonacci.Result(sequence=feedback.sequence)

    def result(self, call):
        return self.client.ask(call)

    def there(self, ready):
        self.assertTrue(self.client.wait(ready), "the server does not come")

    def test_services_answer(self):
        client = self.client.node.create_client(SetBool, "/switch")
        self.there(client.service_is_ready)
        self.result(lambda: client.call_async(SetBool.Request()))
        for _ in range(10):
            # As many at once as a service of ROS 2 keeps (its history is 10 deep).
            answers = [(data, client.call_async(SetBool.Request(data=data))) for data in [True, False] * 5]
            for data, future in answers:
                self.assertTrue(self.client.wait(future.done), "no answer")
                answer = future.result()
                self.assertEqual((answer.success, answer.message), (data, "on" if data else "off \u00e4\u20ac"))
        client = self.client.node.create_client(Arrays, "/arrays")
        self.there(client.service_is_ready)
        request = Arrays.Request(int32_values=[1, -2, 2**31 - 1], string_values=["a", "", "\u20ac"], float64_values=[0.5, -1e300, 0.0])
        answer = self.result(lambda: client.call_async(request))
        self.assertEqual(list(answer.int32_values), [1, -2, 2**31 - 1])
        self.assertEqual(answer.string_values, ["\u20ac", "", "a"])
        self.assertEqual(list(answer.float64_values), [0.5, -1e300, 0.0])

    def test_actions_run_to_their_end_or_are_cancelled(self):
        client = ActionClient(self.client.node, Fibonacci, "/fibonacci")
        self.addCleanup(client.destroy)
        self.there(client.server_is_ready)
        heard = []
        numbers = [0, 1, 1, 2, 3, 5, 8, 13, 21, 34, 55]
        end = time.monotonic() + PATIENCE
        while not heard and time.monotonic() < end:  # the first goal may have ended before its client's reader is found
            goal = self.result(lambda: client.send_goal_async(Fibonacci.Goal(order=10),
                                                              lambda m: heard.append(list(m.feedback.sequence))))
            self.assertTrue(goal.accepted)
            done = self.result(goal.get_result_async)
            self.assertEqual((done.status, list(done.result.sequence)), (GoalStatus.STATUS_SUCCEEDED, numbers))
        self.assertTrue(heard)
        for sequence in heard:
            self.assertEqual(sequence, numbers[:len(sequence)])
        # The client learns of the goal's state by the status topic, too.
        self.there(lambda: goal.status == GoalStatus.STATUS_SUCCEEDED)

        goal = self.result(lambda: client.send_goal_async(Fibonacci.Goal(order=10_000)))
        answer = self.result(goal.cancel_goal_async)
        self.assertEqual([bytes(one.goal_id.uuid) for one in answer.goals_canceling], [bytes(goal.goal_id.uuid)])
        done = self.result(goal.get_result_async)
        self.assertEqual(done.status, GoalStatus.STATUS_CANCELED)
        self.assertLess(len(done.result.sequence), 10_000)

    def test_what_the_action_server_refuses_its_clients_are_told(self):
        client = ActionClient(self.client.node, Fibonacci, "/fibonacci")
        self.addCleanup(client.destroy)
        self.there(client.server_is_ready)
        self.assertFalse(self.result(lambda: client.send_goal_async(Fibonacci.Goal(order=-1))).accepted)
        goal = self.result(lambda: client.send_goal_async(Fibonacci.Goal(order=20)))
        answer = self.result(goal.cancel_goal_async)
        self.assertEqual(answer.goals_canceling, [])  # rclpy says so by that alone: it leaves the code at ERROR_NONE
        done = self.result(goal.get_result_async)
        self.assertEqual((done.status, len(done.result.sequence)), (GoalStatus.STATUS_SUCCEEDED, 21))
        # A goal that there never was.
        cancel = self.client.node.create_client(CancelGoal, "/fibonacci/_action/cancel_goal")
        get = self.client.node.create_client(Fibonacci.Impl.GetResultService, "/fibonacci/_action/get_result")
        self.there(lambda: cancel.service_is_ready() and get.service_is_ready())
        request = CancelGoal.Request()
        request.goal_info.goal_id.uuid = [7] * 16
        self.assertEqual(self.result(lambda: cancel.call_async(request)).return_code, CancelGoal.Response.ERROR_UNKNOWN_GOAL_ID)
        request = Fibonacci.Impl.GetResultService.Request()
        request.goal_id.uuid = [7] * 16
        self.assertEqual(self.result(lambda: get.call_async(request)).status, GoalStatus.STATUS_UNKNOWN)

    def test_an_actions_services_have_the_hashes_that_ros_gives_them(self):
        ros = Ros(1, "looker")
        self.addCleanup(ros.close)
        for name in "send_goal", "cancel_goal", "get_result":
            for topic in f"rq/fibonacci/_action/{name}Request", f"rr/fibonacci/_action/{name}Reply":
                self.assertTrue(ros.wait(lambda: {"server", "trestle_a"} <= ros.hashes(topic).keys()), (topic, ros.hashes(topic)))
                hashes = ros.hashes(topic)
                self.assertTrue(hashes["server"].startswith("RIHS01_"), hashes)
                self.assertEqual(hashes["trestle_a"], hashes["server"], topic)

    def test_an_action_server_that_goes_takes_its_goals_with_it(self):
        client = ActionClient(self.client.node, Fibonacci, "/fibonacci")
        self.addCleanup(client.destroy)
        self.there(client.server_is_ready)
        goal = self.result(lambda: client.send_goal_async(Fibonacci.Goal(order=1_000_000)))
        self.assertTrue(goal.accepted)
        result = goal.get_result_async()
        self.ending.set()
        self.stop_server.close()
        self.assertTrue(self.client.wait(lambda: not client.server_is_ready()), "the server is still there")
        self.assertFalse(result.done() and result.result().status == GoalStatus.STATUS_SUCCEEDED)
        self.ending.clear()
        self.start_server()
        self.there(client.server_is_ready)
        goal = self.result(lambda: client.send_goal_async(Fibonacci.Goal(order=5)))
        self.assertEqual(self.result(goal.get_result_async).status, GoalStatus.STATUS_SUCCEEDED)


if __name__ == "__main__":
    unittest.main(buffer=True)
