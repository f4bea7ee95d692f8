"""Starts hypermap-ros2 for a map of a server, and rviz2 if it is asked for.

    ros2 launch hypermap_bringup hypermap.launch.py server:=10.0.0.5:50051 map:=office rviz:=true
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument("server", default_value="127.0.0.1:50051"),
        DeclareLaunchArgument("map"),
        DeclareLaunchArgument("keep_out", default_value="tag:keep out"),
        DeclareLaunchArgument("rviz", default_value="false"),
        ExecuteProcess(
            cmd=["hypermap-ros2",
                 "--server", LaunchConfiguration("server"),
                 "--map", LaunchConfiguration("map"),
                 "--keep_out", LaunchConfiguration("keep_out")],
            output="screen", respawn=True, respawn_delay=2.0),
        Node(
            package="rviz2", executable="rviz2", output="screen",
            arguments=["-d", PathJoinSubstitution(
                [FindPackageShare("hypermap_bringup"), "config", "hypermap.rviz"])],
            condition=IfCondition(LaunchConfiguration("rviz"))),
    ])
