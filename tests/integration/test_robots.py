"""Where the robots of a map are: reports, lists and watches."""

import time

import grpc

import rpc
import sites
from processes import DEADLINE_S, SiteTest

ACCEPTED, OUTDATED = 1, 2


def report(robot, x, y, yaw=0.0, stamp_s=None, **members):
    """Returns a RobotReport of a robot at (x, y), measured now or at `stamp_s`."""
    stamp_s = time.time() if stamp_s is None else stamp_s
    stamp = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(stamp_s)) + f".{int(stamp_s % 1 * 1e9):09}Z"
    return {"robot": robot, "stamp": stamp, "pose": {"x": x, "y": y, "yaw": yaw}, **members}


class Robots(SiteTest):

    def setUp(self):
        super().setUp()
        self.site = self.server("--robot_online_seconds=1", "--robot_memory_seconds=3",
                                "--watch_progress=200ms")
        self.client = self.enterContext(rpc.Client(self.site.address))
        sites.make(self.client)
        self.client.SetTransform(map="site", transform={
            "parent_frame_id": "map", "child_frame_id": "dock",
            "parent_from_child": {"x": 10, "y": 0, "yaw": 0}})

    def report(self, *arguments, **members):
        return self.client.Report(map="site", report=report(*arguments, **members))

    def watch(self):
        """Returns an iterator of the messages that tell of a change."""
        stream = self.client.WatchRobots(map="site")
        self.addCleanup(stream.cancel)
        return (message for message in stream
                if message.reset or message.robots or message.forgotten)

    def test_reports_are_listed_with_what_they_say(self):
        answer = self.report("r1", 1, 2, 0.5, frame_id="dock", battery=0.75, state="driving",
                             fields={"task": "12"}, map_revision=3,
                             covariance=[0.04, 0, 0, 0, 0.04, 0, 0, 0, 0.001])
        self.assertEqual(answer.outcome, ACCEPTED)
        self.report("r0", 5, 6, frame_id="nowhere")
        listed = self.client.ListRobots(map="site")
        self.assertEqual((listed.frame_id, listed.revision), ("map", answer.revision))
        lost, found = listed.robots
        self.assertEqual((lost.report.robot, lost.in_map_frame, lost.report.frame_id),
                         ("r0", False, "nowhere"))
        self.assertEqual((found.report.robot, found.in_map_frame, found.report.frame_id),
                         ("r1", True, "map"))
        pose = found.report.pose
        self.assertEqual((pose.x, pose.y, pose.yaw), (11, 2, 0.5))
        self.assertEqual((found.report.battery, found.report.state, found.report.map_revision,
                          dict(found.report.fields), found.online),
                         (0.75, "driving", 3, {"task": "12"}, True))
        self.assertEqual(len(found.report.covariance), 9)

    def test_the_newest_report_wins(self):
        now = time.time()
        self.assertEqual(self.report("r1", 1, 0, stamp_s=now).outcome, ACCEPTED)
        self.assertEqual(self.report("r1", 2, 0, stamp_s=now - 5).outcome, OUTDATED)
        (robot,) = self.client.ListRobots(map="site").robots
        self.assertEqual(robot.report.pose.x, 1)

    def test_a_watch_follows_a_robot_until_it_is_forgotten(self):
        watch = self.watch()
        first = next(watch)
        self.assertTrue(first.reset)
        self.assertEqual(list(first.robots), [])
        for x in (1, 2):
            self.report("r1", x, 0)
            message = next(watch)
            self.assertFalse(message.reset)
            (robot,) = message.robots
            self.assertEqual((robot.report.pose.x, robot.online), (x, True))
        (robot,) = next(watch).robots
        self.assertFalse(robot.online)
        self.assertEqual(list(next(watch).forgotten), ["r1"])
        self.assertEqual(list(self.client.ListRobots(map="site").robots), [])

    def test_a_reader_gets_the_newest_state_of_each_robot(self):
        watch = self.watch()
        next(watch)
        for i in range(500):
            self.report(f"r{i % 5}", i, 0)
        seen, messages = {}, 0
        while any(seen.get(f"r{i}") != 495 + i for i in range(5)):
            messages += 1
            seen.update((robot.report.robot, robot.report.pose.x) for robot in next(watch).robots)
        self.assertLess(messages, 500)

    def test_deleting_the_map_ends_its_watches_and_forgets_its_robots(self):
        self.report("r1", 1, 2)
        watch = self.watch()
        next(watch)
        self.client.DeleteMap(map="site")
        with self.assertRaises(grpc.RpcError) as caught:
            next(watch)
        self.assertEqual(caught.exception.code(), grpc.StatusCode.UNAVAILABLE)
        self.client.CreateMap(map="site")
        self.assertEqual(list(self.client.ListRobots(map="site").robots), [])

    def test_the_server_stops_while_robots_are_watched(self):
        watch = self.watch()
        next(watch)
        self.assertEqual(self.site.stop(), 0)

    def test_a_restart_forgets_the_robots(self):
        self.report("r1", 1, 2)
        self.site.stop()
        with rpc.Client(self.server().address) as client:
            self.assertEqual(list(client.ListRobots(map="site").robots), [])

    def test_the_time_of_an_answer_tells_how_long_ago_robots_were_seen(self):
        self.report("r1", 1, 2)
        deadline = time.monotonic() + DEADLINE_S
        while True:
            listed = self.client.ListRobots(map="site")
            age_ns = listed.time.ToNanoseconds() - listed.robots[0].seen_time.ToNanoseconds()
            self.assertGreaterEqual(age_ns, 0)
            if not listed.robots[0].online:
                break
            self.assertLess(time.monotonic(), deadline)
        self.assertGreaterEqual(age_ns, 1e9)
