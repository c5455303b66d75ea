"""The types of Autoware that examples/autoware carries, as far as they matter on the wire: names and types of fields.

Autoware's own packages have more, as constants and comments; where AMENT_PREFIX_PATH has them, these are used.
"""
import os
import pathlib

STAMP = "builtin_interfaces/Time stamp\n"
HEADER = "std_msgs/Header header\n"
TYPES = {
    "autoware_vehicle_msgs": {
        "msg/VelocityReport.msg": HEADER + "float32 longitudinal_velocity\nfloat32 lateral_velocity\nfloat32 heading_rate\n",
        "msg/SteeringReport.msg": STAMP + "float32 steering_tire_angle\n",
        "msg/ControlModeReport.msg": STAMP + "uint8 mode\n",
        **{f"msg/{name}Report.msg": STAMP + "uint8 report\n" for name in ("Gear", "TurnIndicators", "HazardLights")},
        **{f"msg/{name}Command.msg": STAMP + "uint8 command\n" for name in ("Gear", "TurnIndicators", "HazardLights")},
        "srv/ControlModeCommand.srv": STAMP + "uint8 mode\n---\nbool success\n",
    },
    "autoware_control_msgs": {
        "msg/Control.msg": STAMP + "builtin_interfaces/Time control_time\nLateral lateral\nLongitudinal longitudinal\n",
        "msg/Lateral.msg": STAMP + "builtin_interfaces/Time control_time\nfloat32 steering_tire_angle\n"
                           "float32 steering_tire_rotation_rate\nbool is_defined_steering_tire_rotation_rate\n",
        "msg/Longitudinal.msg": STAMP + "builtin_interfaces/Time control_time\nfloat32 velocity\nfloat32 acceleration\n"
                                "float32 jerk\nbool is_defined_acceleration\nbool is_defined_jerk\n",
    },
    "autoware_sensing_msgs": {
        "msg/GnssInsOrientation.msg": "geometry_msgs/Quaternion orientation\n" + "".join(
            f"float32 rmse_rotation_{axis}\n" for axis in "xyz"),
        "msg/GnssInsOrientationStamped.msg": HEADER + "GnssInsOrientation orientation\n",
    },
}


def found_in(folder):
    """An AMENT_PREFIX_PATH that has all of these: Autoware's, else what is written to the folder."""
    path = os.environ.get("AMENT_PREFIX_PATH", "")
    for package, files in TYPES.items():
        if any(pathlib.Path(prefix, "share", package).is_dir() for prefix in path.split(":") if prefix):
            continue
        for name, text in files.items():
            file = pathlib.Path(folder, "share", package, name)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
    return f"{path}:{folder}" if path else str(folder)
