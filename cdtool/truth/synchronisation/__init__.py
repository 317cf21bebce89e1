"""How late the channels of a log are against each other, from the physics that connects them, and drift of clocks.

`smoothing` computes a signal or its derivative on any times with one kernel, `delay` the delay of one event or section,
`combination` the offset and drift of many, `channel_delay` contains the results.
"""
