"""Parameters of a machine's model from impact-free recordings, each with a standard error that covers.

axis_run.py prepares a joint's channels; every other file is one method. All of them work offline, on whole recordings.
"""
