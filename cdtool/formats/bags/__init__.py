"""ROS bags, and MCAP as a target: logs of topics."""
