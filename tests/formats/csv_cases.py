"""Unusual text tables, each with its expected columns, or with the words of the error if it must be refused.

Every seed gives other cases. The tables are like those of oscilloscopes, PLCs, LabVIEW, Excel, MATLAB, Python and ROS,
or are cut off by an incomplete copy or a power failure. The expected columns are computed from the numbers, never by a
reader.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache

import numpy as np

Columns = dict[str, list[float]]
Content = tuple["str | bytes", "Columns | None"]


@dataclass(frozen=True)
class Case:
    """A file: `columns` are all columns of a survey (None: refused), `words` are part of the error.

    `kind` is the kind of a required finding ("a or b" is one of two; empty: none is required). `pins` are the lines of
    `[csv]` with which the file is read; `clock` and `time` are the column of the time and its expected values [s].
    """

    name: str
    content: bytes
    columns: Columns | None
    words: str = ""
    kind: str = ""
    pins: str = ""
    clock: str = ""
    time: list[float] = field(default_factory=list)


class Table:
    """Rows of a log: time, torque, speed and a counter, as texts with decimal points."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.count = int(rng.integers(12, 60))
        first = float(rng.integers(0, 50))
        self.t = [f"{first + 0.01 * i:.3f}" for i in range(self.count)]
        self.a = [f"{value:.4f}" for value in rng.normal(0.0, 30.0, self.count)]
        self.b = [f"{value:.2f}" for value in rng.normal(0.0, 2.0, self.count)]
        self.n = [str(value) for value in rng.integers(0, 4096, self.count)]
        self.names = ["t", "a", "b"]

    @property
    def rows(self) -> list[list[str]]:
        return [list(row) for row in zip(self.t, self.a, self.b, strict=True)]

    def truth(self, *names: str) -> Columns:
        named = names or ("t", "a", "b")
        return {name: [float(x) for x in column] for name, column in zip(named, (self.t, self.a, self.b), strict=True)}

    def text(
        self,
        separator: str = ",",
        decimal: str = ".",
        end: str = "\n",
        header: bool = True,
        last: bool = True,
        trail: str = "",
        head_trail: str = "",
        above: str = "",
        below_header: str = "",
    ) -> str:
        """Return the table; the lines of `above` and `below_header` are separated by `\\n`."""
        lines = [separator.join(self.names) + head_trail] if header else []
        lines = [*above.splitlines(), *lines, *below_header.splitlines()]
        lines += [separator.join(cell.replace(".", decimal) for cell in row) + trail for row in self.rows]
        return end.join(lines) + (end if last else "")


_MAKERS: list[tuple[str, Callable[[Table], Content], dict[str, str]]] = []


def _case(name: str, **options: str) -> Callable[[Callable[[Table], Content]], Callable[[Table], Content]]:
    def register(make: Callable[[Table], Content]) -> Callable[[Table], Content]:
        _MAKERS.append((name, make, options))
        return make

    return register


def _plain(name: str, make: Callable[[Table], str | bytes], names: tuple[str, ...] = (), **options: str) -> None:
    _MAKERS.append((name, lambda table: (make(table), table.truth(*names)), options))


def _refused(name: str, make: Callable[[Table], str | bytes], words: str, pins: str = "") -> None:
    _MAKERS.append((name, lambda table: (make(table), None), {"words": words, "pins": pins}))


@cache
def cases(seed: int) -> list[Case]:
    """Return all cases of one seed."""
    all_cases = []
    for number, (name, make, options) in enumerate(_MAKERS):
        content, columns = make(Table(np.random.default_rng([seed, number])))
        raw = content.encode() if isinstance(content, str) else content
        words, kind, pins = (options.get(key, "") for key in ("words", "kind", "pins"))
        all_cases.append(Case(name, raw, columns, words, kind, pins))
    return all_cases


# --- separators, decimal marks, line ends, encodings

for _word, _mark in {
    "comma": ",",
    "semicolon": ";",
    "tab": "\t",
    "pipe": "|",
    "blank": " ",
    "comma and blank": ", ",
}.items():
    _plain(f"separator: {_word}", lambda table, mark=_mark: table.text(mark))
for _word, _mark in {"semicolon": ";", "tab": "\t", "pipe": "|", "blank": " "}.items():
    _plain(f"decimal comma, {_word}", lambda table, mark=_mark: table.text(mark, ","))
for _word, _end in {"CRLF": "\r\n", "CR": "\r", "CR CR LF": "\r\r\n"}.items():
    _plain(f"line ends: {_word}", lambda table, end=_end: table.text(end=end))
    _plain(f"line ends: {_word}, none at the end", lambda table, end=_end: table.text(end=end, last=False))
_plain("line ends: LF and CRLF mixed", lambda table: table.text().replace("\n", "\r\n", 7))
_plain("line ends: CR, and one LF at the end", lambda table: table.text(end="\r", last=False) + "\n")
_refused("line ends: a CR between LF", lambda table: table.text(last=False).replace("\n", "\r", 5)[:-1] + "\n", "")
for _codec in ("utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32"):
    _plain(f"encoding: {_codec}", lambda table, codec=_codec: table.text(";", ",", "\r\n").encode(codec))
_plain("encoding: UTF-16 big endian with its mark", lambda table: b"\xfe\xff" + table.text().encode("utf-16-be"))


def _lettered(table: Table, codec: str, names: tuple[str, str, str]) -> Content:
    table.names = list(names)
    return table.text(";").encode(codec), table.truth(*names)


for _codec, _names in {
    "latin-1": ("t [µs]", "größe [°]", "b"),
    "cp1252": ("t", "Kraft – Ist [µN]", "€"),
    "cp932": ("時間", "位置 [mm]", "トルク"),
    "gb18030": ("时间", "位置 [mm]", "转速"),
    "utf-8": ("zeit", "ω [°/s]", "Δx"),
    "utf-16": ("t", "力", "b"),
}.items():
    _MAKERS.append((f"letters of {_codec}", lambda table, c=_codec, n=_names: _lettered(table, c, n), {}))
_plain("sep= of Excel", lambda table: "sep=;\r\n" + table.text(";", ",", "\r\n"), kind="named_separator")
_plain("sep= of a tab", lambda table: "sep=\t\r\n" + table.text("\t", end="\r\n"))
_refused("sep= that the rows contradict", lambda table: "sep=;\n" + table.text(","), "one cell")
_plain("blanks around the cells", lambda table: table.text(" ; "))
_plain(
    "columns aligned with blanks",
    lambda table: "\n".join("  ".join(f"{c:>12}" for c in r) for r in [table.names, *table.rows]) + "\n",
)

# --- numbers


def _numbers(
    name: str, separator: str, write: Callable[[float], str], quote: str = "", refused: bool = False, **options: str
) -> None:
    def make(table: Table) -> Content:
        values = [float(round(x, 2)) for x in table.rng.uniform(1.0e3, 9.9e6, table.count)]
        values[0] = 1234567.5
        body = "".join(f"{i}{separator}{quote}{write(x)}{quote}\n" for i, x in enumerate(values))
        truth = None if refused else {"n": [float(i) for i in range(table.count)], "v": values}
        return f"n{separator}v\n{body}", truth

    _MAKERS.append((name, make, options))


def _swap(text: str, comma: str, point: str) -> str:
    return text.replace(",", "\0").replace(".", point).replace("\0", comma)


_numbers("thousands: 1.234,5 in Excel", ";", lambda x: _swap(f"{x:,.2f}", ".", ","))
_numbers("thousands: 1,234.5 with semicolons", ";", lambda x: f"{x:,.2f}")
_numbers("thousands: 1,234.5 in quotes", ",", lambda x: f"{x:,.2f}", '"')
_numbers("thousands: 1'234.5 of Switzerland", ";", lambda x: _swap(f"{x:,.2f}", "'", "."))
_numbers("thousands: a non-breaking space", ";", lambda x: _swap(f"{x:,.2f}", "\u00a0", ","))
_numbers("thousands: a narrow non-breaking space", "\t", lambda x: _swap(f"{x:,.2f}", "\u202f", ","))
_numbers("thousands: a blank", ";", lambda x: _swap(f"{x:,.2f}", " ", ","))
_numbers("quoted decimal comma between commas", ",", lambda x: f"{x:.2f}".replace(".", ","), '"')
_numbers("quoted numbers", ",", lambda x: f"{x:.2f}", '"')
_numbers("exponents", ",", lambda x: f"{x:.8E}")
_numbers("exponents with a decimal comma", ";", lambda x: f"{x:.8e}".replace(".", ","))
_numbers("a plus sign", ",", lambda x: f"+{x:.2f}")
_numbers("seventeen digits", ",", lambda x: f"{x:.17g}")
_numbers("thirty digits", ",", lambda x: f"{x:.30f}")


@_case("the typographic minus sign")
def _(table: Table) -> Content:
    return table.text(";").replace("-", "\u2212"), table.truth()


def _thousand_or_decimal(table: Table, write: Callable[[int, int], str]) -> str:
    rows = [(int(a), int(b)) for a, b in table.rng.integers(100, 999, (table.count, 2))]
    return "n;v\n" + "".join(f"{i};{write(a, b)}\n" for i, (a, b) in enumerate(rows))


_refused("only 1,234", lambda table: _thousand_or_decimal(table, lambda a, b: f"{a},{b}"), "thousands")
_refused(
    "only 1,234 in quotes",
    lambda table: _thousand_or_decimal(table, lambda a, b: f'"{a},{b}"').replace(";", ","),
    "thousands",
)
_refused(
    "1.234 next to 0,5",
    lambda table: _thousand_or_decimal(table, lambda a, b: f"{a}.{b};0,{a}5").replace("n;v", "n;v;w"),
    "next to",
)
_refused(
    "decimal points and decimal commas",
    lambda table: _thousand_or_decimal(table, lambda a, b: f"{a}.5;0,{b}5").replace("n;v", "n;v;w"),
    "decimal",
)
_refused("decimal commas between commas", lambda table: table.text(",", ","), "names or words")
_refused(
    "a decimal comma and no header", lambda table: "".join(f"{i},0{i % 10}\n" for i in range(table.count)), "two cells"
)


_refused(
    "decimal commas in one column, no header",
    lambda table: "".join(f"{i * i % 7},{i % 9}\n" for i in range(table.count)),
    "two cells",
)
_refused(
    "a comma before milliseconds, no header",
    lambda table: "".join(f"2025-04-25 12:00:{i:02d},{100 + i},{i}\n" for i in range(table.count)),
    "two cells",
)


@_case("a first row with a number in brackets", kind="unread_cells")
def _(table: Table) -> Content:
    truth = table.truth()
    truth["a"][0] = math.nan
    return _with_cell(table, "(1.5)", 0), truth


def _numbered(texts: list[str], values: list[float], separator: str = ";") -> Content:
    """A counter and these numbers as these texts."""
    rows = "".join(f"{i}{separator}{text}\n" for i, text in enumerate(texts))
    return f"n{separator}v\n{rows}", {"n": [float(i) for i in range(len(texts))], "v": values}


def _decimals(table: Table, at_3: str = "") -> Content:
    values = [f"{a}.{b}" for a, b in table.rng.integers(100, 999, (table.count, 2))]
    values[3] = at_3 or values[3]
    return _numbered([value.replace(".", ",") for value in values], [float(value) for value in values])


@_case("1,234 pinned as thousands", pins='thousands = ","\ndecimal = "."')
def _(table: Table) -> Content:
    values = table.rng.integers(1000, 999999, table.count).tolist()
    return _numbered([f"{value:,}" for value in values], [float(value) for value in values])


_MAKERS.append(("1,234 pinned as decimals", _decimals, {"pins": 'decimal = ","'}))
_MAKERS.append(("0,125 can only be a decimal", lambda table: _decimals(table, "0.125"), {}))


@_case("infinite, nan, empty, Microsoft's")
def _(table: Table) -> Content:
    words = {"inf": math.inf, "-Inf": -math.inf, "TRUE": 1.0}
    words |= dict.fromkeys(("nan", "", "1.#QNAN", "-1.#IND"), math.nan)
    return _numbered([*table.a, *words], [*(float(x) for x in table.a), *words.values()], ",")


_refused("a text for a missing value", lambda table: _with_cell(table, "N/A"), "'N/A'", "header = 1")


@_case("a text for a missing value, pinned", pins='missing = ["N/A", "--"]')
def _(table: Table) -> Content:
    truth = table.truth()
    truth["a"][5] = math.nan
    return _with_cell(table, "N/A"), truth


@_case("a number for a missing value, pinned: only as it is written", pins='missing = ["-999"]')
def _(table: Table) -> Content:
    table.a[5], table.a[7] = "-999", "-999.0"
    truth = table.truth()
    truth["a"][5] = math.nan
    return table.text(), truth


def _with_cell(table: Table, cell: str, row: int = 5) -> str:
    lines = table.text().splitlines()
    cells = lines[row + 1].split(",")
    lines[row + 1] = ",".join((cells[0], cell, cells[2]))
    return "\n".join(lines) + "\n"


# --- lines above the rows

_plain("sections in brackets", lambda table: table.text(above="[Header]\nVersion=2\n[Data]"))
_plain("units in brackets above the names", lambda table: table.text(above="[s],[N m],[m/s]"))
_plain("no header", lambda table: table.text(header=False), ("0", "1", "2"))
_plain("no header, decimal comma", lambda table: table.text(";", ",", header=False), ("0", "1", "2"))
_plain("names in quotes", lambda table: table.text().replace("t,a,b", '"t","a","b"'))
_plain(
    "a separator in a quoted name",
    lambda table: table.text().replace("t,a,b", 't,"torque, motor",b'),
    ("t", "torque, motor", "b"),
)
_plain(
    "a line end in a quoted name",
    lambda table: table.text().replace("t,a,b", 't,"torque\n[Nm]",b'),
    ("t", "torque [Nm]", "b"),
)
_plain("a row of units", lambda table: table.text(";", below_header="s;A;rpm"))
_plain("a row of units in brackets", lambda table: table.text(below_header="(ms),(V),(A)\n\n"))
_plain("a row of types", lambda table: table.text("\t", below_header="LREAL\tREAL\tREAL"))
_plain(
    "a preamble of keys and values",
    lambda table: table.text(above="Model,MSO2024\nSample Interval,1e-3\nRecord Length,1000\n"),
    kind="words_above_rows",
)
_plain(
    "a preamble of words",
    lambda table: table.text(";", above="Messung vom 3. April\nPrüfstand 4\n\n"),
    kind="words_above_rows",
)
_plain("a preamble that is wider than the rows", lambda table: table.text(above="a,b,c,d,e,f,g\nh,i,j,k,l,m,n\n\n"))
_plain("comments above", lambda table: table.text(above="# rig 3\n# 1 kHz"))
_plain(
    "comments between the rows",
    lambda table: table.text().replace("\n" + table.t[4], "\n# paused\n" + table.t[4], 1),
    kind="comment_lines",
)
_plain("comments of MATLAB", lambda table: table.text(" ", above="% made by hand\n% 1 kHz"))
_plain("names in a comment, as NumPy writes them", lambda table: "# " + table.text(" "), kind="names_from_comment")
_plain("rostopic echo -p", lambda table: "%" + table.text(), kind="names_from_comment")
_plain("a ruler below the names", lambda table: table.text(" | ", below_header="----+----+----"))
_plain(
    "a repeated header",
    lambda table: table.text().replace("\n" + table.t[6], "\nt,a,b\n" + table.t[6], 1),
    kind="header_lines",
)
_plain(
    "a repeated header with units",
    lambda table: table.text(below_header="s,A,rpm").replace("\n" + table.t[6], "\nt,a,b\ns,A,rpm\n" + table.t[6], 1),
)
_plain("blank lines", lambda table: table.text(end="\n\n"), kind="blank_lines")
_plain("blank lines above", lambda table: "\n\n" + table.text())
_plain("a separator at the end of every line", lambda table: table.text(";", ",", trail=";", head_trail=";"))
_plain("a separator at the end of the rows only", lambda table: table.text(trail=","))
_plain("a separator at the end of the header only", lambda table: table.text(head_trail=","))
_plain(
    "a separator at the end of the rows, no header", lambda table: table.text(trail=",", header=False), ("0", "1", "2")
)
_plain("a footer", lambda table: table.text() + "End of file\n", kind="words_below_rows")
_plain("a footer with sums", lambda table: table.text() + "\nSum,1.5,2\nMean,0.1,0.2\n", kind="footer_skipped")
_plain("a footer padded to the width", lambda table: table.text(";", ",") + "End of file;;\n", kind="footer_skipped")
_plain(
    "an oscilloscope: x-axis and second",
    lambda table: table.text(header=False, above="x-axis,1,2\nsecond,Volt,Volt"),
    ("x-axis", "1", "2"),
)
_plain("columns numbered in the header", lambda table: table.text(header=False, above="t,0,1"), ("t", "0", "1"))
_refused(
    "names with blanks between blanks",
    lambda table: "time motor torque b\n" + table.text(" ", header=False),
    "names or words",
)
_plain(
    "names with blanks, two between",
    lambda table: "time   motor torque   b\n" + table.text("   ", header=False),
    ("time", "motor torque", "b"),
)
_refused("a header of another width", lambda table: table.text(header=False, above="t,a,b,c"), "4 names")
_refused("a preamble directly above the rows", lambda table: table.text(header=False, above="rate,1000"), "2 names")
_refused(
    "a first row that may be names", lambda table: table.text(header=False, above="0.000,OVL,1.5"), "may be the names"
)
_refused("numbers that may be names", lambda table: table.text(header=False, above="0,1,2"), "may number")
_plain(
    "numbers pinned as names", lambda table: table.text(header=False, above="0,1,2"), ("0", "1", "2"), pins="header = 1"
)
_plain(
    "a preamble skipped by a pin",
    lambda table: table.text(header=False, above="rate,1000"),
    ("0", "1", "2"),
    pins="skip_lines = 1",
)
_refused("a wrong pinned header", lambda table: table.text(above="rig 3\n\n"), "line 1", "header = 1")
_refused("a wrong pinned separator", lambda table: table.text(), "one cell", 'separator = ";"')
_refused("a wrong pinned decimal mark", lambda table: table.text(";", ","), "not a number", 'decimal = "."')


@_case("an oscilloscope: names, units and an interval")
def _(table: Table) -> Content:
    empty = [math.nan] * table.count
    truth = {**table.truth("X", "CH1", "CH2"), "Start": empty, "Increment": empty}
    lines = ["X,CH1,CH2,Start,Increment", "Sequence,Volt,Volt,-1.2e-3,4.0e-6"]
    return "\n".join([*lines, *(",".join(row) + ",," for row in table.rows)]) + "\n", truth


@_case("LabVIEW measurement")
def _(table: Table) -> Content:
    head = "LabVIEW Measurement\t\nWriter_Version\t2\nDate\t2025/04/03\n***End_of_Header***\t\n\nChannels\t2\t\n"
    head += "X_Dimension\tTime\tTime\nDelta_X\t0.001\t0.001\n***End_of_Header***\t\t\nX_Value\tTorque\tSpeed\tComment\n"
    return head + table.text("\t", header=False), table.truth("X_Value", "Torque", "Speed")


@_case("a column of words next to numbers")
def _(table: Table) -> Content:
    words = ["idle", "moving", "stopped"]
    lines = [f"{t},{words[i % 3]},{a}" for i, (t, a) in enumerate(zip(table.t, table.a, strict=True))]
    truth = table.truth()
    return "t,state,a\n" + "\n".join(lines) + "\n", {"t": truth["t"], "a": truth["a"]}


@_case("words with the separator in quotes")
def _(table: Table) -> Content:
    lines = [f'{t},"moving, slowly ""{i}""",{a}' for i, (t, a) in enumerate(zip(table.t, table.a, strict=True))]
    truth = table.truth()
    return "t,state,a\n" + "\n".join(lines) + "\n", {"t": truth["t"], "a": truth["a"]}


# --- damage

_refused("a row too short", lambda table: _with_row(table, "1,2"), "line 9 has 2 cells")
_refused("a row too long", lambda table: _with_row(table, "1,2,3,4"), "line 9 has 4 cells")
_refused(
    "two rows without a line end between them",
    lambda table: _with_row(table, "1.0,2.0,3.01.0,2.0,3.0"),
    "line 9 has 5 cells",
)
_refused("words between the rows", lambda table: _with_row(table, "emergency stop"), "line 9")
_refused("a quote that is not closed", lambda table: _with_row(table, '1,"2,3'), "quote")
_refused("an image", lambda _: b"\x89PNG\r\n\x1a\n" + bytes(99), "binary")
_refused("a web page", lambda _: "<html>1,2</html>", "markup")
_refused("a text", lambda _: "Once upon a time.\nThere was a gate.\n", "no row of numbers")
_refused("only a header", lambda _: "t,a,b\n", "no row of numbers")


def _with_row(table: Table, row: str) -> str:
    lines = table.text().splitlines()
    return "\n".join([*lines[:8], row, *lines[8:]]) + "\n"


def _without_last(table: Table) -> Columns:
    return {name: values[:-1] for name, values in table.truth().items()}


def _cut(name: str, cut: Callable[[str], str | bytes], kind: str) -> None:
    _MAKERS.append((name, lambda table: (cut(table.text()), _without_last(table)), {"kind": kind}))


_cut("cut within the last row", lambda text: text[: text.rindex(",")], "last_line_cut")
_cut("cut after a separator", lambda text: text[: text.rindex(",") + 1], "last_line_dropped")
_cut(
    "cut after a sign or the first digit",
    lambda text: text[: text.rindex(",") + 2],
    "last_line_cut or last_line_dropped",
)
_cut("cut within the last number", lambda text: text[:-2], "last_line_dropped")
_cut("cut before the last decimals", lambda text: text[:-3], "last_line_dropped")
_plain("cut of the last line end only", lambda table: table.text(last=False))
_plain("NUL bytes at the end", lambda table: table.text().encode() + bytes(500), kind="nul_bytes_at_end")
_cut("cut within a row, followed by NUL bytes", lambda text: text[:-4].encode() + bytes(4096), "nul_bytes_at_end")
_cut("cut within a row, UTF-16", lambda text: text[:-4].encode("utf-16"), "last_line_dropped")


@_case("NUL bytes between the rows", kind="nul_lines")
def _(table: Table) -> Content:
    lines = table.text().encode().splitlines(keepends=True)
    lines[5] = lines[5][:3] + bytes(40) + b"\n"
    return b"".join(lines), {name: [*values[:4], *values[5:]] for name, values in table.truth().items()}


# --- time: `columns` has the seconds


def _timed(
    name: str,
    write: Callable[[int], str],
    separator: str = ",",
    names: str = "stamp",
    refused: bool = False,
    **options: str,
) -> None:
    """Add a case; `write(ms)` returns the stamp `ms` milliseconds after 2025-04-25 23:59:58 (midnight follows)."""

    def make(table: Table) -> Content:
        steps = np.cumsum(table.rng.integers(1, 400, table.count))
        stamps = [int(step - steps[0]) for step in steps]
        decimal = "," if options.get("comma") else "."
        body = "".join(
            f"{write(ms)}{separator}{a.replace('.', decimal)}\n" for ms, a in zip(stamps, table.a, strict=True)
        )
        truth: Columns = {names.split(separator)[-1]: [ms / 1000.0 for ms in stamps], "a": [float(x) for x in table.a]}
        return f"{names}{separator}a\n{body}", None if refused else truth

    _MAKERS.append((name, make, options))


def _at(ms: int, layout: str, start: str = "2025-04-25T23:59:58") -> str:
    stamp = (np.datetime64(start, "ms") + np.timedelta64(ms, "ms")).astype("datetime64[ms]").item()
    return str(stamp.strftime(layout.replace("%L", f"{stamp.microsecond // 1000:03d}")))


_timed("ISO-8601", lambda ms: _at(ms, "%Y-%m-%dT%H:%M:%S.%L"))
_timed("ISO-8601 in UTC", lambda ms: _at(ms, "%Y-%m-%dT%H:%M:%S.%LZ"))
_timed("ISO-8601 with a zone", lambda ms: _at(ms, "%Y-%m-%dT%H:%M:%S.%L+02:00"))
_timed("ISO-8601 with a blank and nanoseconds", lambda ms: _at(ms, "%Y-%m-%d %H:%M:%S.%L000000"))
_timed("ISO-8601 with a comma", lambda ms: _at(ms, "%Y-%m-%dT%H:%M:%S,%L"), ";", comma="1")
_timed("German date", lambda ms: _at(ms, "%d.%m.%Y %H:%M:%S,%L"), ";", comma="1")
_timed("American date, day above 12", lambda ms: _at(ms, "%m/%d/%Y %H:%M:%S.%L"))
_timed("British date, day above 12", lambda ms: _at(ms, "%d/%m/%Y %H:%M:%S.%L"))
_timed("month by name", lambda ms: _at(ms, "%d-%b-%Y %H:%M:%S.%L"))
_timed("half days", lambda ms: _at(ms, "%m/%d/%Y %I:%M:%S.%L %p"))
_timed("time of a trend of Studio 5000", lambda ms: _at(ms, "%Y/%m/%d,%H:%M:%S;%L"), ",", "Date,Time")
_timed("date and time in two columns", lambda ms: _at(ms, "%d.%m.%Y;%H:%M:%S.%L"), ";", "date;time")
_timed(
    "03/04/2025", lambda ms: _at(ms, "%m/%d/%Y %H:%M:%S.%L", "2025-04-03T23:59:58"), refused=True, words="2025-04-03"
)
_timed(
    "03/04/2025 in a column of its own",
    lambda ms: _at(ms, "%m/%d/%Y;%H:%M:%S.%L", "2025-04-03T12:00:00"),
    ";",
    "date;time",
    refused=True,
    words="2025-03-04",
)
_timed(
    "03/04/2025 pinned",
    lambda ms: _at(ms, "%m/%d/%Y %H:%M:%S.%L", "2025-04-03T23:59:58"),
    pins='time_format = "%m/%d/%Y %H:%M:%S.%f"',
)


@_case("time of day over midnight", kind="written_times")
def _(table: Table) -> Content:
    stamps = [100 * i for i in range(table.count)]
    body = "".join(f"{_at(ms, '%H:%M:%S.%L')};{a}\n" for ms, a in zip(stamps, table.a, strict=True))
    midnight = [86398.0 + ms / 1000.0 for ms in stamps]
    return f"time;a\n{body}", {"time": [round(x, 3) for x in midnight], "a": [float(x) for x in table.a]}


for _unit, _start, _step in (
    ("s", 1700000000, 1),
    ("ms", 1700000000000, 10),
    ("us", 1700000000000000, 10000),
    ("ns", 1700000000000000000, 10**7),
):

    def _epoch(table: Table, start: int = _start, step: int = _step) -> Content:
        stamps = [start + step * i for i in range(table.count)]
        body = "".join(f"{x},{a}\n" for x, a in zip(stamps, table.a, strict=True))
        return f"stamp,a\n{body}", {"stamp": [float(x) for x in stamps], "a": [float(x) for x in table.a]}

    _MAKERS.append((f"epoch in {_unit}", _epoch, {}))

# --- tables that are refused with what to do


def _of_r(table: Table, separator: str, last: str = "") -> str:
    """Return a table as R's write.table writes it: the number of each row, in quotes, has no name."""
    rows = [separator.join((f'"{i}"', *row[:-1], last or row[-1])) for i, row in enumerate(table.rows, start=1)]
    return "\n".join([separator.join(f'"{name}"' for name in table.names), *rows, ""])


_refused("R's names of rows", lambda table: _of_r(table, " "), "all columns but the first")
_refused(
    "R's names of rows, a column of missing values", lambda table: _of_r(table, ",", " "), "all columns but the first"
)
_plain(
    "cells in quotes, with a separator at the end", lambda table: '"' + table.text('","').replace("\n", '",\n"')[:-1]
)
_refused(
    "tags of Siemens in one column",
    lambda table: "VarName;VarValue;Time_ms\n" + "".join(f'"tag";{a};{t}\n' for t, a, _ in table.rows),
    "VarName",
)
_refused("a line break in a cell", lambda table: _with_row(table, '1,"2\n3",4'), "no line break in a cell")
