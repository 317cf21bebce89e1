"""What is to be known about a log: facts with their numbers, and the one place where these become sentences.

A `Finding` says of which channel and file a `Fact` holds, and how severe it is. Each kind of fact is a frozen dataclass
in a module of this package: its fields are the numbers, its `sentence` is written where it is shown. Code compares
kinds and numbers, never sentences. A format of a plug-in writes `Finding(Remark("..."))` or a kind of its own.
"""

from cdtool.findings.finding import Fact, Finding, Remark, Severity, worst_first

__all__ = ["Fact", "Finding", "Remark", "Severity", "worst_first"]
