"""Strategies for ROS message definitions and values that fit them."""

from __future__ import annotations

from hypothesis import strategies as st

INTEGERS = {f"{sign}int{bits}": (0 if sign else -(2 ** (bits - 1)), 2 ** (bits - (not sign)) - 1)
            for sign in ("", "u") for bits in (8, 16, 32, 64)}  # fmt: skip
NUMBERS = (*INTEGERS, "bool", "float32", "float64")
NAMES = ("a", "b2", "name", "position", "velocity", "frame_id")


def number(kind):
    if kind == "bool":
        return st.booleans()
    if kind.startswith("float"):
        return st.floats(width=int(kind[5:]), allow_nan=True)
    return st.integers(*INTEGERS[kind])


@st.composite
def definitions(draw, ros2=True):
    """Draw a definition's text and the strategy of its values as dicts, with up to two nested types."""
    nested = {}
    for title in ("Inner", "Outer")[: draw(st.integers(0, 2))]:
        nested[title] = draw(members(dict(nested), ros2))
    text, values = draw(members(nested, ros2, least=1))
    for title, (body, _) in nested.items():
        text += f"{'=' * 80}\nMSG: test_msgs/{title}\n{body}"
    return text, values


@st.composite
def members(draw, nested, ros2, least=0):
    text, values = "# a comment\nint8 CONSTANT=5\n\n", {}
    for name in draw(st.lists(st.sampled_from(NAMES), unique=True, min_size=least, max_size=5)):
        kind = "string" if name in ("name", "frame_id") else draw(st.sampled_from((*NUMBERS, "string", *nested)))
        base = nested[kind][1] if kind in nested else number(kind) if kind in NUMBERS else st.text("aé", max_size=9)
        form = draw(st.sampled_from(("", "[]", "[3]", "[<=4]") if ros2 else ("", "[]", "[3]")))
        package = draw(st.sampled_from(("", "test_msgs/"))) if kind in nested else ""
        text += f"{package}{kind}{form}  {name}   # {name}\n"
        sizes = {"": None, "[]": (0, 4), "[3]": (3, 3), "[<=4]": (0, 4)}[form]
        values[name] = base if sizes is None else st.lists(base, min_size=sizes[0], max_size=sizes[1])
    return text, st.fixed_dictionaries(values)


def numeric_texts(text_fields):
    """Return fields to decode: those of a survey, elements of their arrays, and fields that may be missing."""
    more = [name.replace("[:]", "[1]") for name in text_fields if name.endswith("[:]")]
    return [*text_fields, *more, "a", "a[0].b2", "b2.position", "position[x]", "velocity[:]", "name[0]"]
