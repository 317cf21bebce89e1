"""The public ROS 2 message definitions that cdtool writes, with the fields that a stream may fill."""

from __future__ import annotations

from dataclasses import dataclass

_RULE = "=" * 80

_HEADER = f"""{_RULE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_RULE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""

_VECTOR = f"""{_RULE}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""

_JOINT_STATE = f"""std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
{_HEADER}"""

_IMU = f"""std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
{_HEADER}{_VECTOR}{_RULE}
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
"""

_WRENCH_STAMPED = f"""std_msgs/Header header
geometry_msgs/Wrench wrench
{_HEADER}{_VECTOR}{_RULE}
MSG: geometry_msgs/Wrench
geometry_msgs/Vector3 force
geometry_msgs/Vector3 torque
"""

_FLOAT64_MULTI_ARRAY = f"""std_msgs/MultiArrayLayout layout
float64[] data
{_RULE}
MSG: std_msgs/MultiArrayLayout
std_msgs/MultiArrayDimension[] dim
uint32 data_offset
{_RULE}
MSG: std_msgs/MultiArrayDimension
string label
uint32 size
uint32 stride
"""


def _vector(name: str) -> tuple[str, ...]:
    return tuple(f"{name}.{axis}" for axis in "xyz")


@dataclass(frozen=True)
class Definition:
    """A message type: its definition text, its numeric fields, its numeric arrays, and whether it has a header."""

    text: str
    numbers: tuple[str, ...] = ()
    arrays: tuple[str, ...] = ()
    header: bool = True


DEFINITIONS = {
    "sensor_msgs/msg/JointState": Definition(_JOINT_STATE, arrays=("position", "velocity", "effort")),
    "sensor_msgs/msg/Imu": Definition(
        _IMU,
        (*_vector("orientation"), "orientation.w", *_vector("angular_velocity"), *_vector("linear_acceleration")),
    ),
    "geometry_msgs/msg/WrenchStamped": Definition(
        _WRENCH_STAMPED, (*_vector("wrench.force"), *_vector("wrench.torque"))
    ),
    "std_msgs/msg/Float64": Definition("float64 data\n", ("data",), header=False),
    "std_msgs/msg/Float64MultiArray": Definition(_FLOAT64_MULTI_ARRAY, arrays=("data",), header=False),
}
