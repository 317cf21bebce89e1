"""What is to be known about a log: facts with their numbers, and the one place where these become sentences.

A `Finding` is of a kind, about a channel and file, with numbers. The kinds are data: `kinds.toml` has the severity, the
numbers and the sentence of each. Code compares kinds and numbers, never sentences. A format of a plug-in writes
`remark("...", column, severity)`.
"""

from cdtool.base.findings.finding import Finding, lines_of, remark, worst_first
from cdtool.base.findings.kinds import Severity

__all__ = ["Finding", "Severity", "lines_of", "remark", "worst_first"]
