"""The sentence of every kind of fact, word for word; other tests compare kinds and numbers."""

from __future__ import annotations

import importlib
import inspect
import json
import math
import pkgutil
from collections.abc import Iterator
from dataclasses import fields

import pytest

import cdtool.findings
from cdtool.findings import (
    Fact,
    Finding,
    Remark,
    channels,
    clocks,
    containers,
    injection,
    messages,
    motion,
    parts,
    placeholders,
    plausibility,
    runs,
    scoring,
    synchronisation,
    tables,
    truth,
    worst_first,
)
from cdtool.findings.plausibility import ChannelCheck

READINGS = clocks.TwoReadings(1.7e12, "s", 53870.5, "ms", "2023-11-14")
SENTENCES: list[tuple[Fact, str]] = [
    (Remark("the recorder lost its clock"), "the recorder lost its clock"),
    # clocks
    (clocks.RepeatedStamps(1, 1000, (17,), "line"), "1 time stamp repeats (line 17), dropped (0.1 % of the rows)"),
    (
        clocks.UnknownStamps(2, 10, (0, 3), "sample"),
        "2 time stamps are no number (sample 0, 3), dropped (20 % of the rows)",
    ),
    (
        clocks.StrayStamps(4, 1000, (3, 4, 5), "line"),
        "4 time stamps lie far off those around them (line 3, 4, 5, ...), dropped (0.4 % of the rows)",
    ),
    (
        clocks.StuckStamps(1, 20, (7,), "sample"),
        (
            "1 time stamp stands still beyond a coarse clock's step (sample 7), dropped (5 % of the rows); "
            "the clock was stuck"
        ),
    ),
    (clocks.BackwardStamps(1, 1000, (3,), "line"), "1 time stamp runs backward (line 3), dropped (0.1 % of the rows)"),
    (
        clocks.BackwardStamps(3, 20, (3, 4, 5), "line", clocks.ClockRestart()),
        (
            "3 time stamps run backward (line 3, 4, 5), dropped (15 % of the rows); the clock starts again "
            "there, or has jumped ahead before: cut the log there (operations "
            '= "clock-reset" in the benchmark file, or detect --operations clock-reset), or correct its stamps'
        ),
    ),
    (
        clocks.BackwardStamps(1, 20, (3,), "line", clocks.ClockRestart(wrapped_bits=16)),
        (
            "1 time stamp runs backward (line 3), dropped (5 % of the rows); the counter of 16 bits wraps "
            "there: log a wider one, or add 65536 to the stamps from each wrap on"
        ),
    ),
    (
        clocks.CoarseClock(0.9, 10.0),
        ("90 % of the time stamps repeat: a coarse clock of steps of 10 ms, replaced by a causal straight line"),
    ),
    (clocks.SampleGaps(1, (clocks.Gap(0.5, 0.04),)), "1 gap after 0.500 s (40 ms)"),
    (
        clocks.SampleGaps(5, (clocks.Gap(0.5, 0.04), clocks.Gap(1.0, 0.02), clocks.Gap(2.0, 3.0))),
        "5 gaps after 0.500 s (40 ms), 1.000 s (20 ms), 2.000 s (3000 ms) and 2 more",
    ),
    (clocks.Jitter(0.25, 0.01), "the sample period varies by 25 % (std) about 10 ms"),
    (clocks.OutOfOrder(1, 400, 0.009), "1 of 400 messages out of order, by up to 9 ms: sorted by time"),
    (
        clocks.OutOfOrder(50, 400, 3.5, set_back=True, worst=350),
        (
            "message 350 is stamped 3.5 s before one ahead of it; 50 of 400 messages out of order, by up to "
            "3500 ms: sorted by time. Was the clock set or restarted?"
        ),
    ),
    (
        clocks.FileUnitImplausible(READINGS),
        (
            "the file says s, but its first stamp 1700000000000 is 53,870 years in s, and 2023-11-14 in ms "
            "since 1970: taken to be ms; if that is wrong, name another clock in [channels] time"
        ),
    ),
    (
        clocks.HeaderUnitImplausible(READINGS),
        (
            "the header says s, but its first stamp 1700000000000 is 53,870 years in s, and 2023-11-14 in "
            "ms since 1970: taken to be ms; a machine file says it for sure"
        ),
    ),
    (
        clocks.DaysOfMatlab("2024-05-06T12:00:00.250"),
        "counts days, as MATLAB's datenum does: read in s since 2024-05-06T12:00:00.250",
    ),
    (
        clocks.AssumedClock("ms", "name", 0.0, 10.0),
        "taken to be the clock, in ms (its name says so); a machine file says it for sure",
    ),
    (
        clocks.AssumedClock("ms", "header", 0.0, 10.0),
        "taken to be the clock, in ms (its header says so); a machine file says it for sure",
    ),
    (
        clocks.AssumedClock("s", "epoch", 1.7e9, 0.01),
        ("taken to be the clock, in s (from its start, 1700000000 after 1970); a machine file says it for sure"),
    ),
    (
        clocks.AssumedClock("days", "excel", 45231.5, 1.2e-7),
        (
            "taken to be the clock, in days (as Excel counts them, from its start 45231.5 and its steps of "
            "1.2e-07); a machine file says it for sure"
        ),
    ),
    (
        clocks.AssumedClock("ms", "steps", 0.0, 10.0),
        "taken to be the clock, in ms (from its steps of 10); a machine file says it for sure",
    ),
    (
        clocks.StepsImplausible(100.0, "s", "", "us", 10000.0),
        'steps of 100 s in s; in us they are 1e+04 Hz: write unit = "us" if that is the rate',
    ),
    (
        clocks.StepsImplausible(100.0, "s", "t [s]", "us", 10000.0),
        (
            "steps of 100 s in s, as its header says 't [s]'; in us they are 1e+04 Hz: write unit = \"us\" if "
            "that is the rate"
        ),
    ),
    (
        clocks.ClockUnitContradicted("t [ms]", "ms", "s", ratio=1000.0),
        ("the header says 't [ms]', the machine file s (a factor of 1000): write unit = \"ms\" if the header is right"),
    ),
    (
        clocks.ClockUnitContradicted("t [rpm]", "rpm", "s", rate=100.0),
        "the header says 't [rpm]', the machine file counts samples at 100 Hz: is it another column?",
    ),
    (
        clocks.NoClock(),
        (
            "no column looks like a clock: rates, gaps and times are unknown; name it, or the sample rate, "
            "in [channels] time of a machine file"
        ),
    ),
    (
        clocks.StandingClock(400, named=True),
        "named as a clock, but all of its 400 stamps are the same: the clock stands still",
    ),
    (clocks.CoarseStamps(0.501, named=True), "named as a clock, but 50.1 % of its stamps repeat: a coarse clock"),
    (
        clocks.CoarseStamps(0.501, named=False),
        (
            "50.1 % of its stamps repeat: a coarse clock; choose other stamps in a machine file: "
            "[channels.mcap] time = { clock = ... }"
        ),
    ),
    (clocks.EmptyClock(), "named as a clock, but it contains no time stamp"),
    (clocks.BackwardClock(12), "named as a clock, but it runs backward at 12 of its steps"),
    (
        clocks.OtherClock("time1", clocks.ClockDifference("steps", 0.01, 0.02), ("a", "b", "c", "d")),
        (
            "another clock than 'time1' (their steps are 0.02 and 0.01), next to a, b, c and 1 more; time = "
            '{ column = "time", unit = "s" } in a machine file gives each channel the clock beside it'
        ),
    ),
    (
        clocks.OtherClock("time1", clocks.ClockDifference("start", 0.0, 5.0), ("a",)),
        (
            "another clock than 'time1' (it starts at 5, not 0), next to a; time = { column = \"time\", unit "
            '= "s" } in a machine file gives each channel the clock beside it'
        ),
    ),
    (
        clocks.OtherClock("time1", clocks.ClockDifference("drift", 0.0, 0.25), ("a",)),
        (
            "another clock than 'time1' (they drift apart by 0.25), next to a; time = { column = \"time\", "
            'unit = "s" } in a machine file gives each channel the clock beside it'
        ),
    ),
    (clocks.OwnClocks(("time1", "time2")), "each channel is on the clock beside it: 'time1', 'time2'"),
    (
        clocks.ClockUnitAssumed(("t1", "t2"), 0.0005),
        "no unit in the header of t1, t2: read in s, at 2000 Hz; "
        "write the unit in the header if that is wrong, e.g. 't1 [ms]'",
    ),
    (
        clocks.LowerRate(250.0, 0.25),
        "has a value in 25 % of the rows: a rate of its own, 250 Hz, and its empty cells are no samples",
    ),
    (
        clocks.RepeatedRows(2),
        "2 rows with the time and the values of the one before: filled with the previous value, left out",
    ),
    (
        clocks.StatedPeriodDiffers(0.002, 0.004),
        "its clock has steps of 4 ms, but the file states a sample time of 2 ms: is the clock right?",
    ),
    (
        clocks.StartAssumed(("a",)),
        "no date and time of a: taken to begin with the first of the others",
    ),
    (
        clocks.DerivedTimes(("a", "b")),
        "X_Value is not the time of a, b: taken from Delta_X, in each packet of samples",
    ),
    (clocks.ValuesWithoutTime(1), "1 value in rows in which its clock is empty: left out"),
    (
        clocks.WrittenTimes("%H:%M:%S.%f", "midnight", wraps="midnight", wrapped=3),
        "passes midnight 3 times; written as %H:%M:%S.%f; in s since midnight",
    ),
    (
        clocks.WrittenTimes("%H:%M:%S", "2025-03-04T00:00:00", days_column="date"),
        "joined with the days of column 'date'; written as %H:%M:%S; in s since 2025-03-04T00:00:00",
    ),
    (clocks.StampsAsSeconds("2025-03-04T05:06:07"), "time stamps: taken as seconds from 2025-03-04T05:06:07"),
    (
        clocks.UnusableClock("the date of 'days since ever' is not understood"),
        "the date of 'days since ever' is not understood: it is not a clock",
    ),
    (
        clocks.ClocksWithoutUnit(("a/time", "b/time")),
        (
            "a/time, b/time look like the clocks of their groups, but have no unit of time: the attribute "
            "unit makes each the clock of its group"
        ),
    ),
    (clocks.NoStartTime(("a", "b")), "no start time (wf_start_time) in a, b: taken to begin with the first of them"),
    (
        clocks.HeaderDelay(1.5, 0.25, 4.0),
        "logged 1.500 ms (median; 5 to 95 %: 0.250 to 4.000 ms) after the header's stamp",
    ),
    (
        clocks.SteadyHeader(),
        'the header\'s stamps are regular: write time = { clock = "header" } in [channels.mcap] of the machine file',
    ),
    (clocks.HeaderUnset(), "the header's stamps are never set: use the log clock"),
    (
        clocks.ClocksApart(12.5, "speed"),
        (
            "begins 12.5 s after speed ends: their clocks have no time in common; choose another clock in "
            "the machine file, or a time_offset"
        ),
    ),
    # tables
    (
        tables.NamesOfSymbols(2),
        "the names of 2 channels cannot be told apart between blanks: those of their symbols are used",
    ),
    (tables.PinnedLinesSkipped((1, 2, 3)), "lines 1 to 3 skipped, as [csv] says"),
    (tables.OtherEncoding("Latin-1"), "not valid UTF-8, read as Latin-1"),
    (tables.NamedSeparator(1, "sep=;"), "line 1 (sep=;) names the separator"),
    (
        tables.NumbersAboveRows((3,)),
        ("line 3 above the rows skipped although it contains numbers; skip_lines in [csv] says that they are no rows"),
    ),
    (
        tables.NumbersAboveRows((3, 4)),
        (
            "lines 3 to 4 above the rows skipped although they contain numbers; skip_lines in [csv] says that "
            "they are no rows"
        ),
    ),
    (tables.WordsAboveRows((1, 2)), "lines 1 to 2 above the rows skipped: no names, no numbers"),
    (tables.NamesFromComment(4), "the names are those of the comment in line 4"),
    (tables.FooterSkipped((20, 21), "Sum,190,210"), "lines 20 to 21 skipped: a footer ('Sum,190,210'), no sample"),
    (
        tables.DoubtfulPoint("1.234", 7),
        ("'1.234' (line 7) is read as 1.234, not as 1234: pin decimal and thousands in [csv] if that is wrong"),
    ),
    (tables.NotNumeric("note", 2, "up"), "column 'note' is not numeric (line 2 is 'up'): left out"),
    (
        tables.NotNumeric("note", 2, "1-2-2025", tables.CellAdvice("time")),
        (
            "column 'note' is not numeric (line 2 is '1-2-2025'): left out; repair it, or pin "
            'time_format in [csv], e.g. "%d.%m.%Y %H:%M:%S.%f"'
        ),
    ),
    (
        tables.AmbiguousTimes("date", "1/2/2025 is day or month first"),
        "column 'date': 1/2/2025 is day or month first: left out; pin time_format in [csv]",
    ),
    (
        tables.UnreadCells((3, 9, 12, 20), "1,5", tables.CellAdvice("number", "point")),
        (
            "4 lines (3, 9, 12, ...): '1,5' cannot be read, taken as missing; decimal mark: point; empty "
            "and nan are missing values"
        ),
    ),
    (
        tables.UnreadCells((3,), "off", tables.CellAdvice("word", '"off"')),
        (
            "line 3: 'off' cannot be read, taken as missing; if it stands for a missing value, missing = "
            '["off"] in [csv] of the machine file says so'
        ),
    ),
    (tables.BlankRows((5,)), "line 5 blank: taken as missing samples"),
    (tables.BlankLines((5, 6)), "lines 5 to 6 skipped: blank"),
    (tables.BlankSamples((5, 9)), "2 lines (5, 9) skipped: blank, perhaps missing samples"),
    (tables.CommentLines((5, 6)), "lines 5 to 6 skipped: comments"),
    (tables.HeaderLines((11,)), "line 11 skipped: the header again"),
    (tables.DrawnLines((2,)), "line 2 skipped: drawn lines"),
    (tables.WordsBelowRows((30,)), "line 30 skipped: words below the rows"),
    (tables.NulLines((31,)), "line 31 skipped: damaged, with NUL bytes"),
    (tables.LastLineCut(99), "the last line (99) is cut off, dropped"),
    (tables.NulBytesAtEnd(512), "the file ends in 512 NUL bytes: was the power lost?"),
    (
        tables.TotalRow(12),
        "the last row (line 12) has the sums of the rows above: if it is a total and no sample, remove it",
    ),
    (tables.LastLineKept(99, "0.5"), "the last line (99) has no line end: its last cell '0.5' is taken to be whole"),
    (tables.LastLineDropped(99, "0."), "the last line (99) has no line end, and '0.' may be cut off, dropped"),
    # containers
    (
        containers.SegmentCutOff(24, 100, 40),
        "the segment from line 24 on has 40 of the 100 rows that its head states",
    ),
    (containers.ColumnLeftOut("note", "of texts"), "column 'note' is of texts: left out"),
    (containers.VariableLeftOut("note", "a cell"), "variable 'note' is a cell: left out"),
    (containers.VariableLeftOut("d", "a duration", "seconds(d)"), "variable 'd' is a duration: left out; seconds(d)"),
    (
        containers.WithoutClock("log.gains", 7),
        "variable 'log.gains' has 7 values, and no clock of its struct is as long: left out",
    ),
    (
        containers.RunsOfStructs("trial", 3, 120),
        (
            "'trial' is an array of structs with clocks of their own: 3 runs one after the other, 120 rows; "
            "column 'trial(:)' is the number of the run, 'trial(2).NAME' a field of one run"
        ),
    ),
    (containers.RunsWithoutRows("trial", (4, 7)), "trial(4), trial(7) of 'trial': no rows, left out"),
    (
        containers.CutWithinMessage(7),
        "the last 7 bytes are not a complete message: cut off or damaged, and lost",
    ),
    (containers.MessagesDamaged(), "the file is damaged: messages that cannot be read are lost"),
    (
        containers.LoggerDropouts(2, 0.32, 0.3),
        "2 dropouts of the logger, 0.32 s in all, at most 0.3 s: messages are lost",
    ),
    (containers.SheetLeftOut("Notes", "no numbers"), "sheet 'Notes' is left out: no numbers"),
    (containers.ErrorCells(2, "#N/A", 6), "2 cells with an error (first #N/A in row 6): taken as missing"),
    (
        containers.NumbersAmongTexts(2, "1,5", 4, 3),
        (
            "2 numbers as text with a comma ('1,5' in row 4) and 3 of 1000 and more without decimals: "
            "was 1,234 read as 1234 when a table was opened?"
        ),
    ),
    (
        containers.FormulasWithoutValue(1, 4),
        "1 formula without a value (first in row 4): taken as missing; open and save it in Excel",
    ),
    (containers.RowsAsColumns("variable", "q", 3, 500), "variable 'q' is 3 x 500: its rows are taken as columns"),
    (containers.PackedValues(0.01, 20.0), "packed (CF): times 0.01, plus 20"),
    (
        containers.RoundedIntegers(200),
        "200 values beyond 2^53: of integers that large the last digits are rounded to float64",
    ),
    (containers.RoundedColumn(), "integers beyond 2^53 are rounded to float64"),
    (containers.ValuesCutOff(50, 950), "50 values from number 950 on are missing"),
    (containers.NeverFinalised(), "the recording was never finalised: its end may be missing"),
    (containers.LastSegmentIncomplete(), "the last segment is not complete: the rest of it is lost"),
    (containers.CutBehindRow(50000), "the file is cut off or damaged behind row 50000: what came after is lost"),
    (containers.LibraryMessage("npTDMS", "Last segment is incomplete"), "npTDMS says: Last segment is incomplete"),
    (containers.BagDamaged("ReaderError: no index"), "the bag is damaged: ReaderError: no index"),
    (containers.MessagesUnreadable(4, 10), "4 of 10 messages cannot be read"),
    (
        containers.MessagesUnreadable(4, 10, "ReaderError: no index"),
        "4 of 10 messages cannot be read: ReaderError: no index",
    ),
    (
        containers.DamagedAt(345, "the checksum of a chunk does not match", containers.LostBytes(24)),
        "damaged at byte 345 (the checksum of a chunk does not match): 24 bytes lost",
    ),
    (
        containers.DamagedAt(345, "zstd", containers.LostBytes(999, is_chunk=True, messages=20, time=(1.5, 2.25))),
        "damaged at byte 345 (zstd): a chunk of 999 bytes lost, 20 messages, 0.750 s from 1.500 s on",
    ),
    (
        containers.DamagedAt(345, "the file ends within a record", containers.LostBytes(0), read_before=30),
        ("damaged at byte 345 (the file ends within a record): only the part before it was read (30 messages)"),
    ),
    (
        containers.DamagedAt(345, "the file ends within a record", containers.LostBytes(24), read_before=1),
        (
            "damaged at byte 345 (the file ends within a record): only the part before it was read (1 "
            "message); 24 bytes lost"
        ),
    ),
    (
        containers.MoreDamage(3, 999, 2, 40),
        "damaged at 3 more places: 999 bytes and 2 chunks lost, 40 messages named by indexes",
    ),
    (
        containers.MessagesLost("a message names channel 7, which is not defined", 2),
        "a message names channel 7, which is not defined: 2 messages lost",
    ),
    (
        containers.ChunksRefused(1),
        (
            "1 chunk is not damaged but refused: they would grow as only a bomb or images of nothing do. If "
            "the log is yours, `mcap decompress LOG -o PLAIN` (mcap.dev) makes one that is read whole"
        ),
    ),
    (
        containers.SummaryDamaged("the checksum of the summary does not match", 20),
        "the summary is damaged (the checksum of the summary does not match): 20 messages read without it",
    ),
    (containers.MessageCountDiffers(20, 18), "the file's summary says 20 messages, 18 were read"),
    (containers.Unverified(24, 24), "24 of 24 messages without a checksum: unverified"),
    (containers.SeveralWriters(2), "2 channels write to it: their messages are one column, sorted by time"),
    (containers.NoMessage(), "contains no message"),
    (containers.IndexDisagrees(1, "not indexed"), "the summary disagrees with the data: 1 chunk is not in its index"),
    (
        containers.IndexDisagrees(2, "only indexed"),
        "the summary disagrees with the data: 2 chunks are in its index alone",
    ),
    (
        containers.IndexDisagrees(2, "other values"),
        "the summary disagrees with the data: 2 chunks have other sizes or times than its index says",
    ),
    (containers.ChunkTimesDiffer(1), "1 chunk states other times than those of the messages"),
    (containers.ChannelCountsDiffer(), "the summary disagrees with the data: other message counts by channel"),
    (containers.DefinedOtherwise(), "the summary defines it otherwise than the data"),
    # messages
    (
        messages.MissingMessages(1, 5, 2.5, of_topic=True),
        "the numbers of its messages jump in one place, the first after 2.500 s: 5 did not reach the log",
    ),
    (
        messages.MissingMessages(3, 5, 2.5, of_topic=False),
        "the numbers of the messages jump in 3 places, the first after 2.500 s: 5 did not reach the log",
    ),
    (messages.OtherJointsOnly(3), "3 messages name other joints only: left out"),
    (messages.EmptyArrays(1), "1 message holds an empty array: NaN"),
    (messages.ArrayLengthsDiffer((2, 3)), "arrays of 2 and 3 elements: left out"),
    (messages.UndecodableMessages(4, 6, "JSONDecodeError"), "4 of 6 messages cannot be decoded: JSONDecodeError"),
    # parts
    (parts.PartMissing("bag_2.db3", "metadata.yaml"), "part bag_2.db3 of metadata.yaml is not in the folder"),
    (
        parts.PartCompressed("bag_2.mcap.zstd", "metadata.yaml"),
        "part bag_2.mcap.zstd of metadata.yaml is compressed as a whole: decompress it, e.g. with zstd -d",
    ),
    (
        parts.PartOfOtherKind("bag_2.db3", "metadata.yaml"),
        "part bag_2.db3 of metadata.yaml is left out: the folder also contains parts of another kind",
    ),
    (
        parts.PartUnreadable("bag_2.mcap", "damaged at byte 8"),
        "part bag_2.mcap is left out, it cannot be read: damaged at byte 8",
    ),
    (
        parts.PartsOverlap("bag_2.mcap", "/speed data"),
        "bag_2.mcap begins before the part before it ends (/speed data): put in the order of the times",
    ),
    (parts.PartGap(2.5), "begins 2.5 s after the part before it ends: nothing is logged between"),
    (
        parts.PartGap(2.5, ("speed", "torque")),
        "begins 2.5 s after the part before it ends (speed, torque): nothing is logged between",
    ),
    # channels
    (channels.AbsentTruth("column", "F"), "is not in this log: no column 'F'"),
    (
        channels.AbsentTruth("topic", "/force data", "/forces data"),
        "is not in this log: no topic '/force data'; did you mean '/forces data'?",
    ),
    (
        channels.SpeedWithoutValue(),
        "no sample has a value: delete the line speed in [channels] of the machine file, and it is derived from the "
        "position; with this line, detectors that need the speed cannot assess anything",
    ),
    (channels.MissingValues(1, 100), "1 of 100 values is missing (NaN)"),
    (channels.MissingValues(2, 100), "2 of 100 values are missing (NaN)"),
    (channels.InfiniteValues(1, ""), "1 value is infinite, masked"),
    (channels.SaturatedValues(2, "elbow"), "2 values of joint elbow are at the sensor's limit, masked"),
    (channels.ImpossibleValues(1, "elbow"), "1 value of joint elbow is outside the possible range, masked"),
    (
        channels.ImplausibleValues(1, "", 1e6, 2.5, 0.5, 3.0, "N m"),
        "1 value is implausible (first 1e+06 N m at 2.500 s; usual: 0.5 +- 3 N m), masked",
    ),
    (
        channels.LeapingValues(40, "elbow", (channels.Leap(2.5, 0.1, 9.1),), "rad"),
        (
            "40 values of joint elbow behind 1 leap faster than the machine moves (first from 0.1 to 9.1 "
            "rad at 2.500 s), masked"
        ),
    ),
    (
        channels.LeapingValues(40, "", (channels.Leap(2.5, 0.1, 9.1, 3.0), channels.Leap(4.0, 9.1, 0.1, 4.5)), "m"),
        (
            "40 values behind 2 leaps faster than the machine moves (first from 0.1 to 9.1 m at 2.500 s), "
            "masked; read from a new zero from 3.000 s on, and at 1 more time"
        ),
    ),
    (
        channels.LearnedInOtherUnit("rad/s", "m/s"),
        "logged in rad/s, learned in m/s: not checked for implausible values",
    ),
    (channels.StuckChannel("elbow"), "the value of joint elbow never changes while the machine moves: stuck?"),
    (
        channels.UnitContradicted("v [mm/s]", "mm/s", 0, "m/s", 1000.0, "unit"),
        (
            "the header says 'v [mm/s]', the machine file m/s (a factor of 1000), not assessable: write "
            'unit = "mm/s" if the header is right, else unit_confirmed = true'
        ),
    ),
    (
        channels.UnitContradicted("i [A]", "A", 2, "N m", 0.0, "unit and scale", "N m per A"),
        (
            "the header says 'i [A]' and 2 more so, the machine file N m, not assessable: write unit = \"A\" "
            "with a scale in N m per A if the header is right, else unit_confirmed = true"
        ),
    ),
    (
        channels.UnitContradicted("M [N m]", "N m", 0, "A", 0.0, "unit without scale"),
        (
            "the header says 'M [N m]', the machine file A, not assessable: write unit = \"N m\" without that "
            "scale if the header is right, else unit_confirmed = true"
        ),
    ),
    (
        channels.UnitContradicted("T [kN]", "kN", 0, "N m", 0.0, "other column"),
        (
            "the header says 'T [kN]', the machine file N m, not assessable: map another column, or write "
            "unit_confirmed = true if it is this one"
        ),
    ),
    (
        channels.UnitContradicted("F (raw)", "raw", 0, "N", 0.0, "no unit"),
        (
            "the header says 'F (raw)', the machine file N, which the header does not confirm: write "
            "the unit and scale of its values, and unit_confirmed = true"
        ),
    ),
    (
        channels.UnitContradicted("", "", 0, "N", 0.0, "confirm"),
        "the log does not say that it is in N: write unit_confirmed = true if it is",
    ),
    (
        channels.DerivedSpeed(50.0),
        "not in the log: derived causally from position (two first-order low-passes at 50 Hz)",
    ),
    (channels.IntegratedPosition(), "not in the log: the speed, integrated from 0"),
    (channels.IntegratedReference(), "not in the log: the reference speed, integrated from the first position"),
    (channels.LinkAccelerations(), "specific forces [m/s2] became link accelerations [rad/s2], gravity taken off"),
    # motion
    (motion.NoMotionMapped(), "neither speed nor position is mapped: no operation can be cut or classed"),
    (motion.NoMotion(), "the axis does not move"),
    (motion.Motion(1, 0.2, "m/s", "forward"), "1 stroke by motion; nominal speed 0.2 m/s, mainly forward"),
    (
        motion.Motion(3, 0.13, "rad/s", "backward", "elbow"),
        "3 strokes by motion; nominal speed of elbow 0.13 rad/s, mainly backward",
    ),
    # plausibility
    (plausibility.Confirmed(), "confirmed in the machine file: not checked against the other channels"),
    (
        ChannelCheck("friction", "agrees", "friction", "elbow", "torque", 4.2, "N m", share=63.0),
        "of elbow: friction takes power: 4.2 N m at steady speed, 63 standard errors",
    ),
    (
        ChannelCheck("friction", "contradicts", "friction", "", "torque", 152.0, "N"),
        (
            "gives power to the machine where friction takes it: at steady speed 152 N against the motion, not "
            "assessable: reverse the sign of its scale, or write confirmed = true under torque if it is right, "
            "and learn again"
        ),
    ),
    (
        ChannelCheck("friction", "contradicts", "place", "", "torque", share=0.999997),
        (
            "is a function of position and speed alone (99.9997% of it), as no force of a drive is, not assessable: "
            "map the drive's torque, force or current, or write confirmed = true under torque if it is right, "
            "and learn again"
        ),
    ),
    (
        ChannelCheck("friction", "contradicts", "other joint", "elbow", "torque", other="wrist"),
        (
            "of elbow: follows the motion of wrist and not its own, not assessable: put the columns in the order of "
            "the joints, or write confirmed = true under torque if it is right, "
            "and learn again"
        ),
    ),
    (
        ChannelCheck("inertia", "contradicts", "inertia", "", "torque", 62.0, "kg", 620.0),
        (
            "the starts show an inertia of 62 kg, the machine file has 620 kg, not assessable: correct mass, inertia, "
            "transmission ratio or the scale of the torque, or write confirmed = true under torque if it is right, "
            "and learn again"
        ),
    ),
    (
        ChannelCheck("inertia", "agrees", "inertia", "", "torque", 580.0, "kg", 620.0),
        "the starts show an inertia of 580 kg, the machine file has 620 kg",
    ),
    (
        ChannelCheck("derivative", "agrees", "size", "", "speed", 0.998, other="position"),
        "fits the derivative of the position (ratio 0.998)",
    ),
    (
        ChannelCheck(
            "derivative",
            "contradicts",
            "size",
            "",
            "speed",
            57.3,
            other="position",
            between=" (a factor as between deg and rad)",
        ),
        (
            "is 57.3 times the derivative of the position (a factor as between deg and rad), not assessable: correct "
            "the unit of the speed, of the position or of the time, or write confirmed = true under speed if it is "
            "right, and learn again"
        ),
    ),
    (
        ChannelCheck("derivative", "contradicts", "sign", "elbow", "acceleration", -1.0, other="speed"),
        (
            "of elbow: has the opposite sign of the derivative of the speed, not assessable: reverse the sign of its "
            "scale, or write confirmed = true under acceleration if it is right, "
            "and learn again"
        ),
    ),
    (
        ChannelCheck("derivative", "contradicts", "course", "", "speed", share=0.43, other="position"),
        (
            "does not follow the derivative of the position: in 43% of the motion it has the opposite sign, not "
            "assessable: map another column, or write confirmed = true under speed if it is right, "
            "and learn again"
        ),
    ),
    (
        ChannelCheck("derivative", "contradicts", "joints", "elbow", "speed", other="position", between="wrist"),
        (
            "of elbow: follows the derivative of the position of another joint, wrist, not assessable: put the columns "
            "in the order of the joints, or write confirmed = true under speed if it is right, "
            "and learn again"
        ),
    ),
    (
        ChannelCheck("derivative", "not checked", "rest", "elbow", "acceleration", other="speed"),
        "of elbow: derivative not checked: the joint hardly moves",
    ),
    (
        ChannelCheck("derivative", "not checked", "apart", "", "acceleration", 0.2, other="speed"),
        "derivative not checked: in 20% of the motion it has the opposite sign of the derivative of the speed",
    ),
    (ChannelCheck("friction", "not checked", "few", "", "torque"), "friction not checked: too little motion"),
    (
        ChannelCheck("friction", "not checked", "one direction", "", "torque"),
        "friction not checked: motion in one direction, with no start that shows the sign",
    ),
    (
        ChannelCheck("friction", "not checked", "unclear", "", "torque"),
        "friction not checked: the motion does not show it",
    ),
    # truth
    (
        truth.FollowsTorque("elbow", 0.999),
        ("follows the torque of elbow without lag (r = 0.999): not an independent truth, if it is made from it"),
    ),
    (
        truth.NotTared(200.4, 1.5),
        (
            "the cell rests at 200 N before the contact at 1.500 s: not tared, or pressed already; forces "
            "count from there"
        ),
    ),
    (
        truth.ForceBeginsLate(5.3, 5.35),
        (
            "begins at 5.300 s, 50 ms before the contact at 5.350 s: if that is the rebound of an earlier "
            "one, its latency is longer"
        ),
    ),
    (
        truth.ForceLeft(3.14, 2.5),
        (
            "3.1 N are left at the end of the contact that began at 2.500 s: it still presses, or the "
            "reading at rest has shifted and hides later contacts"
        ),
    ),
    (
        truth.RestLevelShifted(12.34, 2.5, 0.0),
        (
            "the reading at rest shifted by 12.3 N before the contact at 2.500 s: the onset counts from "
            "where it was then"
        ),
    ),
    (
        truth.RestLevelShifted(12.34, 2.5, 1.25),
        (
            "the reading at rest shifted by 12.3 N before the contact at 2.500 s, 1.2 N/s just before it: "
            "the onset counts from where it was then"
        ),
    ),
    (truth.InProgress(0.75), "a contact is in progress when it begins, until 0.750 s: its onset is not recorded"),
    # synchronisation
    (
        synchronisation.ChannelShift(
            "", "position", "momentum balance", 3.1e-3, 2.4e-3, 3.9e-3, 301.2, "contact", 11, 12, (41e-6, 36e-6, 45e-6)
        ),
        (
            "load cell late by 3.1 ms (2.4 to 3.9) against the position in the momentum balance, from 11 of 12 "
            "contacts, at 301.2 s; drift 41 ppm (36 to 45); one kind of contact: clock, filters and mechanical delay "
            "cannot be told apart"
        ),
    ),
    (
        synchronisation.ChannelShift(
            "", "speed", "two masses", -8e-3, -9e-3, -7e-3, 2.0, "contact", 8, 8, None, -8.5e-3, -7.5e-3
        ),
        (
            "load cell early by 8.0 ms (7.0 to 9.0) against the speed in the balance of motor and load, from 8 "
            "contacts; -8.5 ms in stiff and -7.5 ms in soft contacts: a clock's offset is the same in both"
        ),
    ),
    (
        synchronisation.ChannelShift(
            "elbow", "position", "derivative", 4.86e-3, 4.79e-3, 4.92e-3, 2.0, "section", 5, 5
        ),
        "late by 4.86 ms (4.79 to 4.92) against the position of elbow, from 5 sections",
    ),
    (
        synchronisation.ShiftNotAssessable("", "position", "correlation 0.45", 3),
        "latency against the position not assessable in 3 events: correlation 0.45",
    ),
    (
        synchronisation.MeasuredSynchronisation(4.2e-3, "load cell late by 3.1 ms (2.0 to 4.2) against the position"),
        (
            "synchronisation measured: load cell late by 3.1 ms (2.0 to 4.2) against the position; latencies are not "
            "corrected, their resolution includes 4.20 ms"
        ),
    ),
    # injection
    (
        injection.InjectedContactFact(6.12345, 402.7),
        "injected: a simulated contact at 6.1235 s, peak 403 N, was added to an impact-free recording",
    ),
    # scoring
    (
        scoring.OnsetUnseen(2, 0.03, 5.0, 0.03),
        (
            "load-cell samples are missing for 30 ms where contact 2, first seen at 5.000 s, may have "
            "begun: its latency may be up to 30 ms longer"
        ),
    ),
    (
        scoring.OnsetUnseen(2, 3.0, 5.0, None),
        (
            "load-cell samples are missing for 3000 ms where contact 2, first seen at 5.000 s, may have "
            "begun: its latency is unknown"
        ),
    ),
    (
        scoring.PeakUnseen(1, 0.03),
        ("load-cell samples are missing for 30 ms during contact 1: its peak may be larger than the one reported"),
    ),
    (
        containers.BagNotClosed("log.db3-wal"),
        "the bag was not closed: read from a temporary copy, with its journal log.db3-wal",
    ),
    (containers.DamagedRows(1), "1 row is left out: no time, topic or payload that can be read"),
    (
        containers.StandardDefinitions(("std_msgs/msg/Float64",)),
        "does not contain message definitions: read as the standard ones of std_msgs/msg/Float64",
    ),
    (
        runs.SamplesOutsideRuns(3, 900, "run_id"),
        "3 of 900 samples belong to no run, as 'run_id' has no value there: left out",
    ),
    (
        runs.ReturningIds(("A/2",), "run_id"),
        "1 run has an id in 'run_id' that an earlier run has, too: named A/2",
    ),
    (scoring.NoForce(1, "the acceleration is missing"), "contact 1: no force: the acceleration is missing"),
    (
        scoring.ForceUnassessable(1, "en_12453_reducing_gap", "load-cell samples are missing"),
        "contact 1 is not assessable by en_12453_reducing_gap: load-cell samples are missing",
    ),
    (
        scoring.LogNotCut(4, (3,)),
        (
            "contains 4 strokes in one operation, and stroke 3 is not assessable: cut it with operations = "
            '"motion" in the benchmark file, or detect --operations motion'
        ),
    ),
    (
        scoring.LogNotCut(4, (2, 3)),
        (
            "contains 4 strokes in one operation, and 2 of them are not assessable: cut it with operations = "
            '"motion" in the benchmark file, or detect --operations motion'
        ),
    ),
    (
        scoring.AssumedImpactFree("force: is not in this log: no column 'F'"),
        "force: is not in this log: no column 'F': assumed to be free of impacts",
    ),
    (scoring.LearnedFromIt(), "the signature was learned from this log: the absence of alarms is no evidence"),
    (scoring.PlotsLeftOut(7), "7 more operations with a miss or a false alarm have no trigger plot"),
    (scoring.LimitsUnchecked(1, 2, "gm"), "1 of 2 limits not checked (gm not run)"),
    (scoring.DetectorLeftOut("no channel 'acceleration'"), "left out: no channel 'acceleration'"),
    (
        scoring.SpeedsPooled("limit", "forward at 0.2 m/s", "forward at 0.3 m/s"),
        (
            "the threshold limit pools runs forward at 0.2 m/s and forward at 0.3 m/s: its limits are too wide for one "
            'of them; learn and score each speed in a benchmark file of its own, or set threshold = "signature", which '
            "has limits by speed"
        ),
    ),
    (
        scoring.SingleSpeed("forward at 0.2 m/s"),
        (
            "speed_range has no effect: of this motion only one speed was learned, forward at 0.2 m/s; add runs at "
            "another speed"
        ),
    ),
    (
        scoring.CreepNotLearned(14, "runs forward at 0.01 m/s: too few"),
        "14 strokes at creep speed not learned, and not assessed: runs forward at 0.01 m/s: too few",
    ),
    (scoring.DetectorUnassessable("nothing is valid"), "not assessable: nothing is valid"),
    (
        scoring.NothingLearnedWithout("momentum", "9 impact-free runs of one class"),
        "momentum is not assessable: nothing can be learned from the other recordings: 9 impact-free runs of one class",
    ),
    (
        channels.AxesHeld("fz", 0.0042),
        "its axes have clocks of their own: each is held on the clock of fz, up to 4.2 ms old",
    ),
    (channels.AbsentFile("file", "cell_3.csv"), "has no file for this log: 'cell_3.csv' does not exist"),
    (
        channels.AbsentFile("file", "cell_3.csv", reason="no column 'fz'"),
        "its file 'cell_3.csv' cannot be used: no column 'fz'",
    ),
    (
        clocks.FileAligned("cell_3.csv", -1.25, "trigger", 0.001, 12),
        "from cell_3.csv, its times shifted by -1.25 s (by the trigger in both, known to 1 ms); 12 samples outside the "
        "log left out",
    ),
    (
        clocks.FileAligned("cell_3.csv", 2.0, "offset", 0.0, 0),
        "from cell_3.csv, its times shifted by 2 s (as time_offset states)",
    ),
    (
        clocks.TriggersDiffer(2, 3),
        "its trigger rises 3 times in its own file, 2 times in the log: aligned by the first of each",
    ),
    (
        clocks.TriggersDrift(4.0, 60.0, 66.7),
        "its clock runs apart from the log's: the triggers' distances differ by 4 ms over 60 s (66.7 ppm); aligned in "
        "the middle",
    ),
    (
        truth.ForceMagnitudeUsed((-1.5, 2.0, 0.25)),
        "magnitude of 3 axes, the rest level of each removed (at first -1.5, 2, 0.25 N): it cannot tell pushing from "
        "pulling; direction in [channels] selects a component",
    ),
    (
        truth.LabelsWithoutZone(),
        "the dates have no zone: read as UTC, like dates without a zone in a log. If the logs state a zone, set "
        "labels_zone, e.g. '+02:00'",
    ),
    (
        truth.RowsNotScored("free/99.csv (line 3)", "stiff/01.csv"),
        "rows about logs that are not scored are not used: free/99.csv (line 3); a scored log is named as stiff/01.csv",
    ),
    (truth.KindsExcluded(1, ("wave",)), "1 label of kind wave is not a contact: an alarm there is a false alarm"),
    (
        truth.KindsExcluded(3, ("wave", "push")),
        "3 labels of kind wave, push are not contacts: an alarm there is a false alarm",
    ),
    (
        scoring.RecordingsWithoutRow("plc", 2, 9, True, "stiff/01.csv"),
        "plc: 2 of 9 recordings without a row: left out; first stiff/01.csv",
    ),
    (
        scoring.RecordingsWithoutRow("plc", 2, 9, False, "stiff/01.csv"),
        "plc: 2 of 9 recordings without a row: counted as monitored without an alarm; first stiff/01.csv",
    ),
    (
        scoring.ConditionsNotTunedOn(2),
        "2 changed conditions: not used for tuning: the tuned benchmark files have them, and cdtool benchmark scores "
        "them",
    ),
    (
        placeholders.PlaceholderRatio(157.08),
        "transmission_ratio = 1 m/rad is a placeholder of cdtool init: with it the load moves at 157 m/s; give the "
        "travel per motor angle",
    ),
    (
        placeholders.PlaceholderRatio(float("nan")),
        "transmission_ratio = 1 m/rad is a placeholder of cdtool init; give the travel per motor angle",
    ),
    (
        placeholders.PlaceholderScale("mA", "N m", "A"),
        "scale = 1 for 'mA' is a placeholder of cdtool init; give the N m per A",
    ),
    (
        placeholders.PlaceholderInertia("load_mass"),
        "load_mass is 0, a placeholder of cdtool init: detectors with a model refuse it",
    ),
    (
        placeholders.UncheckedLines(2, ("type", "time")),
        "2 keys of the machine file with the mark CHECK (type, time): delete a mark after checking",
    ),
    (
        placeholders.UncheckedLines(1, ()),
        "1 key of the machine file with the mark CHECK: delete a mark after checking",
    ),
]


def kinds() -> Iterator[type[Fact]]:
    """Yield every kind of the package that can be made."""
    for item in pkgutil.iter_modules(cdtool.findings.__path__, "cdtool.findings."):
        for _, kind in inspect.getmembers(importlib.import_module(item.name), inspect.isclass):
            if issubclass(kind, Fact) and kind.__module__ == item.name and not inspect.isabstract(kind):
                yield kind


@pytest.mark.parametrize(("fact", "sentence"), SENTENCES, ids=[fact.kind for fact, _ in SENTENCES])
def test_a_fact_is_written_as_one_sentence(fact, sentence):
    assert fact.sentence() == sentence


def test_every_kind_has_its_sentence_in_the_table():
    assert {type(fact) for fact, _ in SENTENCES} == set(kinds())


def test_every_kind_has_a_name_of_its_own():
    names = [fact.kind for fact in {type(fact): fact for fact, _ in SENTENCES}.values()]
    assert len(set(names)) == len(names) == len(set(kinds())) and all(name == name.lower() for name in names)
    assert clocks.RepeatedStamps(1, 2, (0,), "line").kind == "repeated_stamps"


def test_subject_and_variant_are_fields_of_the_kind():
    named = {kind: {kind.subject_field, kind.variant_field} - {""} for kind in kinds()}
    assert all(names <= {field.name for field in fields(kind)} for kind, names in named.items())
    assert sum(map(len, named.values())) > 15
    left_out = containers.ColumnLeftOut("mode", "text")
    assert (left_out.subject, left_out.variant) == ("mode", "text")
    assert (clocks.NoClock().subject, clocks.NoClock().variant) == ("", "")


@pytest.mark.parametrize("fact", [fact for fact, _ in SENTENCES], ids=lambda fact: fact.kind)
def test_a_finding_is_hashable_and_its_values_are_json(fact):
    finding = Finding(fact, "time", "loss", file="bag_0.mcap")
    assert finding in {finding} and finding != Finding(fact, "time")
    values = json.loads(json.dumps(finding.to_dict()))
    assert values["kind"] == fact.kind and values["message"] == f"bag_0.mcap: {fact.sentence()}"
    assert (values["channel"], values["severity"], values["file"]) == ("time", "loss", "bag_0.mcap")


def test_numbers_stand_apart_from_the_sentence():
    numbers = Finding(channels.MissingValues(2, 100), "speed").to_dict()["numbers"]
    assert numbers == {"count": 2, "values": 100}


def test_a_fact_about_a_million_lines_holds_few_numbers():
    finding = Finding(tables.BlankLines(range(2, 2_000_002, 2)))
    assert finding.to_dict()["numbers"] == {"count": 1_000_000, "first": (2, 4, 6), "last": 2_000_000}
    assert finding.message == "1000000 lines (2, 4, 6, ...) skipped: blank"
    assert tables.BlankLines((3, 5, 7, 9)) == tables.BlankLines([3, 5, 7, 9]) != tables.BlankRows((3, 5, 7, 9))


def test_a_finding_of_words_alone_says_what_to_write():
    with pytest.raises(TypeError, match=r"Finding\(Remark\("):
        Finding("the recorder lost its clock", "torque")  # type: ignore[arg-type]


def test_a_finding_names_its_channel_and_the_part_of_its_log():
    assert str(Finding(Remark("late"))) == "late"
    assert str(Finding(Remark("late"), "speed")) == "speed: late"
    assert str(Finding(Remark("late"), "speed", file="b.mcap")) == "speed: b.mcap: late"


def test_losses_come_before_warnings_and_these_before_notes():
    note, warning, loss = (Finding(Remark(text), severity=text) for text in ("note", "warning", "loss"))
    assert worst_first([note, warning, loss, warning]) == (loss, warning, warning, note)


def test_a_leap_that_never_ends_has_no_new_zero():
    assert math.isnan(channels.Leap(2.5, 0.1, 9.1).new_zero)
