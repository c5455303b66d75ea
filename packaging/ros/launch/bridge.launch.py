"""Runs a bridge: ros2 launch trestle bridge.launch.py config:=FILE

docs/ros.md explains the arguments, and how other launch files include this one.
"""
import pathlib

from ament_index_python.packages import get_package_prefix
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, LogInfo, OpaqueFunction, TimerAction
from launch.substitutions import LaunchConfiguration

# `trestle bridge` ends with 0 when it was asked to, with 2 for a wrong configuration, which no second try makes right.
NO_SECOND_TRY = (0, 2)


def truth(context, name):
    value = LaunchConfiguration(name).perform(context).strip().lower()
    if value not in ("true", "false"):
        raise ValueError(f"{name}:={value}: it is true or false")
    return value == "true"


def bridge(context):
    """The process of the bridge, which follows itself after a failure."""
    def value(name):
        return LaunchConfiguration(name).perform(context).strip()

    command = [str(pathlib.Path(get_package_prefix("trestle"), "lib/trestle/trestle")), "bridge"]
    for option in ("console", "user"):
        if value(option):
            command += [f"--{option}", value(option)]
    if truth(context, "quiet"):
        command.append("--quiet")
    command.append(value("config"))
    respawn, delay = truth(context, "respawn"), float(value("respawn_delay"))

    def start():
        return ExecuteProcess(cmd=command, name=value("name"), output=value("output"), on_exit=ended)

    def ended(event, launch_context):
        if launch_context.is_shutdown or not respawn or event.returncode in NO_SECOND_TRY:
            return None
        return [LogInfo(msg=f"the bridge ended with {event.returncode}; it is started again in {delay} s"),
                TimerAction(period=delay, actions=[start()])]

    return [start()]


def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument("config", description="Configuration of the bridge (YAML), see 'trestle check'"),
        DeclareLaunchArgument("console", default_value="",
                              description="Serve metrics at this address of this host, as in 127.0.0.1:9464"),
        DeclareLaunchArgument("user", default_value="",
                              description="Started by root: give up its rights for those of this user"),
        DeclareLaunchArgument("quiet", default_value="false", description="Log only problems"),
        DeclareLaunchArgument("respawn", default_value="true", description="Start the bridge again after a failure"),
        DeclareLaunchArgument("respawn_delay", default_value="1.0", description="How long to wait before that, in seconds"),
        DeclareLaunchArgument("name", default_value="trestle", description="What its lines begin with"),
        DeclareLaunchArgument("output", default_value="screen", description="Where its lines go: screen, log or both"),
        OpaqueFunction(function=bridge),
    ])
