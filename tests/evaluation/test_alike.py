"""Similar findings are one line with a count."""

from __future__ import annotations

from cdtool.evaluation.alike import grouped


def test_singular_plural_and_lists_of_any_length_match():
    items = [
        ("a", "1 gap after 0.1 s (4 ms)"),
        ("b", "2 gaps after 0.1 s (4 ms), 0.2 s (5 ms)"),
        ("c", "5 gaps after 0.1 s (4 ms), 0.2 s (5 ms), 0.3 s (6 ms) and 2 more"),
        ("d", "1 gap after 0.4 s (4 ms)"),
        ("e", "1 value is infinite, masked"),
        ("f", "2 values are infinite, masked"),
    ]
    (name, text), *others = grouped(items)
    assert name == "a" and text.endswith("; 3 more like it (b, c, d)")
    assert len(others) == 2  # two are both shown


def test_similar_messages_are_one_line_with_a_count():
    items = [(f"ch{i}", f"the sample period varies by {i} % (std) about 10 ms") for i in range(46)]
    assert grouped([*items, ("ch1", "stuck?")]) == [
        ("ch0", "the sample period varies by 0 % (std) about 10 ms; 45 more like it (ch1, ch2, ch3, ...)"),
        ("ch1", "stuck?"),
    ]
    assert grouped(items[:3]) == items[:3]
