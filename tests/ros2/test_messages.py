"""The bytes of all messages equal those of rosbags, an independent implementation of CDR, which
reads the definitions of client_libs/ros2/packages/hypermap_msgs; and the definitions of ROS's own messages,
which exported files carry, equal those that rosbags knows."""

import os
import subprocess
import unittest

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from processes import ROOT

PACKAGES = ROOT / "client_libs" / "ros2" / "packages"
DEFINITIONS = ROOT / "client_libs" / "ros2" / "messages" / "definitions"
UPDATE = "map_msgs/msg/OccupancyGridUpdate"
# Of packages that rosbags does not know.
OTHERS = {
    UPDATE: (DEFINITIONS / f"{UPDATE}.msg").read_text(),
    "nav2_msgs/msg/CostmapFilterInfo":
        "std_msgs/Header header\nuint8 type\nstring filter_mask_topic\nfloat32 base\n"
        "float32 multiplier",
    # The version of Humble and later.
    "vision_msgs/msg/Point2D": "float64 x\nfloat64 y",
    "vision_msgs/msg/Pose2D": "vision_msgs/Point2D position\nfloat64 theta",
    "vision_msgs/msg/BoundingBox2D":
        "vision_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y",
    "vision_msgs/msg/ObjectHypothesis": "string class_id\nfloat64 score",
    "vision_msgs/msg/ObjectHypothesisWithPose":
        "vision_msgs/ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose",
    "vision_msgs/msg/Detection2D":
        "std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\n"
        "vision_msgs/BoundingBox2D bbox\nstring id",
    "vision_msgs/msg/Detection2DArray":
        "std_msgs/Header header\nvision_msgs/Detection2D[] detections",
    "nav2_msgs/srv/LoadMap_Request": "string map_url",
    "nav2_msgs/srv/LoadMap_Response": "nav_msgs/OccupancyGrid map\nuint8 result",
    # A message without fields has one that nobody uses.
    "nav_msgs/srv/GetMap_Request": "uint8 structure_needs_at_least_one_member",
    "nav_msgs/srv/GetMap_Response": "nav_msgs/OccupancyGrid map",
}


def definitions():
    yield from OTHERS.items()
    package = PACKAGES / "hypermap_msgs"
    for path in sorted(package.glob("msg/*.msg")):
        yield f"hypermap_msgs/msg/{path.stem}", path.read_text()
    for path in sorted(package.glob("srv/*.srv")):
        request, response = path.read_text().split("---\n")
        yield f"hypermap_msgs/srv/{path.stem}_Request", request
        yield f"hypermap_msgs/srv/{path.stem}_Response", response


def as_message(name):
    """rosbags knows no services, only their messages."""
    return name.replace("/srv/", "/msg/")


class MessagesTest(unittest.TestCase):
    def test_bytes_equal_those_of_rosbags(self):
        # The distribution since which a Gid has 16 bytes, as in the samples.
        store = get_typestore(Stores.ROS2_JAZZY)
        for name, text in definitions():
            types = get_types_from_msg(text, as_message(name))
            store.register({k: v for k, v in types.items() if k not in store.fielddefs})
        samples = subprocess.run([os.environ["ROS2_MESSAGE_SAMPLES"]], check=True,
                                 capture_output=True, text=True).stdout.splitlines()
        self.assertEqual(len(samples), 31)
        for line in samples:
            name, sample = line.split()
            with self.subTest(name):
                kind = as_message(name)
                message = store.deserialize_cdr(bytes.fromhex(sample), kind)
                self.assertEqual(bytes(store.serialize_cdr(message, kind)).hex(), sample)

    def test_definitions_equal_those_of_rosbags(self):
        store = get_typestore(Stores.ROS2_JAZZY)
        paths = sorted(DEFINITIONS.glob("*/msg/*.msg"))
        self.assertGreater(len(paths), 20)
        for path in paths:
            name = str(path.relative_to(DEFINITIONS).with_suffix(""))
            with self.subTest(name):
                (_, fields), = get_types_from_msg(path.read_text(), name).values()
                if name != UPDATE:
                    self.assertEqual(fields, store.fielddefs[name][1])


if __name__ == "__main__":
    unittest.main()
