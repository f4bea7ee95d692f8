"""The packages for ROS workspaces build with ament_cmake and rosidl as Debian has them. Debian has
no messages of ROS 2, so those that hypermap_msgs uses are made here, from rosbags' definitions."""

import os
import pathlib
import subprocess
import tempfile
import unittest

from rosbags.typesys import Stores, get_typestore

from processes import ROOT

PACKAGES = ROOT / "client_libs" / "ros2" / "packages"
# The packages of messages that are used, in the order of building, each with those that it uses.
USED = {"builtin_interfaces": [], "std_msgs": ["builtin_interfaces"], "geometry_msgs": ["std_msgs"]}
TYPES = ["builtin_interfaces/msg/Time", "std_msgs/msg/Header", "geometry_msgs/msg/Point",
         "geometry_msgs/msg/Point32", "geometry_msgs/msg/Polygon", "geometry_msgs/msg/PointStamped",
         "geometry_msgs/msg/PolygonStamped"]

# Packages of ROS 2 that only bring others: the generators of the languages, and what they need to run.
BRINGS = {"rosidl_default_generators": "rosidl_cmake rosidl_generator_c rosidl_generator_cpp",
          "rosidl_default_runtime": "rosidl_runtime_c rosidl_runtime_cpp"}
BRINGING = """cmake_minimum_required(VERSION 3.8)
project({name} NONE)
find_package(ament_cmake_core REQUIRED)
find_package(ament_cmake_export_dependencies REQUIRED)
ament_export_dependencies({brought})
ament_package()
"""
INTERFACES = """cmake_minimum_required(VERSION 3.8)
project({name})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
{finds}
rosidl_generate_interfaces(${{PROJECT_NAME}} {files} DEPENDENCIES {needs})
ament_package()
"""
MANIFEST = """<?xml version="1.0"?>
<package format="3">
  <name>{name}</name><version>0.0.0</version><description>For tests.</description>
  <maintainer email="hypermap@example.com">Hypermap maintainers</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
"""
USER = """cmake_minimum_required(VERSION 3.8)
project(user)
find_package(hypermap_msgs REQUIRED)
add_executable(user user.cc)
target_link_libraries(user ${hypermap_msgs_TARGETS})
install(TARGETS user)
"""
USER_SOURCE = """#include <hypermap_msgs/msg/semantic_map.hpp>
#include <hypermap_msgs/srv/get_int_at_point.hpp>
#include <iostream>

int main() {
  hypermap_msgs::msg::SemanticMap map;
  map.objects.resize(1);
  map.objects[0].shape.points.resize(3);
  hypermap_msgs::srv::GetIntAtPoint::Request request;
  request.location.header.frame_id = "map";
  std::cout << to_yaml(map) << to_yaml(request);
}
"""


@unittest.skipUnless(pathlib.Path("/usr/share/rosidl_generator_cpp").exists(),
                     "Debian's ament-cmake and rosidl are missing")
class PackagesTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.prefix = self.folder / "install"
        self.environment = {**os.environ, "AMENT_PREFIX_PATH": f"{self.prefix}:/usr",
                            "CMAKE_PREFIX_PATH": str(self.prefix)}

    def build(self, source):
        """Builds and installs a package, as colcon does."""
        out = self.folder / "build" / source.name
        for command in (["cmake", "-S", source, "-B", out, f"-DCMAKE_INSTALL_PREFIX={self.prefix}",
                         "-DPython3_EXECUTABLE=/usr/bin/python3", "-Wno-dev"],
                        ["cmake", "--build", out], ["cmake", "--install", out]):
            done = subprocess.run(command, env=self.environment, capture_output=True, text=True,
                                  check=False)
            self.assertEqual(done.returncode, 0,
                             f"{source.name}: {done.stdout[-3000:]}\n{done.stderr[-3000:]}")
        return out

    def make_package(self, name, lists, **files):
        folder = self.folder / "src" / name
        (folder / "msg").mkdir(parents=True)
        (folder / "CMakeLists.txt").write_text(lists)
        (folder / "package.xml").write_text(MANIFEST.format(name=name))
        for path, text in files.items():
            (folder / path).write_text(text)
        return folder

    def make_messages(self, name, needs):
        """A package of the messages of TYPES that begin with its name."""
        store = get_typestore(Stores.ROS2_JAZZY)
        files = {}
        for kind in TYPES:
            package, _, message = kind.split("/")
            if package == name:
                own = store.generate_msgdef(kind, ros_version=2)[0].split("\n===")[0]
                files[f"msg/{message}.msg"] = own + "\n"
        return self.make_package(name, INTERFACES.format(
            name=name, files=" ".join(files), needs=" ".join(needs),
            finds="\n".join(f"find_package({need} REQUIRED)" for need in needs)), **files)

    def test_they_build_and_a_program_uses_them(self):
        for name, brought in BRINGS.items():
            self.build(self.make_package(name, BRINGING.format(name=name, brought=brought)))
        for name, needs in USED.items():
            self.build(self.make_messages(name, needs))
        for package in ("hypermap_msgs", "hypermap_bringup"):
            self.build(PACKAGES / package)
        user = self.build(self.make_package("user", USER, **{"user.cc": USER_SOURCE})) / "user"
        printed = subprocess.run([user], check=True, capture_output=True, text=True).stdout
        self.assertIn('frame_id: "map"', printed)
        launch = self.prefix / "share" / "hypermap_bringup" / "launch" / "hypermap.launch.py"
        compile(launch.read_text(), launch, "exec")


if __name__ == "__main__":
    unittest.main()
