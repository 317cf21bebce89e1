"""The report as Markdown that a pull request can hold: verdict, limits, figures, and the rest folded away."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from urllib.parse import quote

from cdtool.errors import UsageError
from cdtool.evaluation.evaluated import Evaluated
from cdtool.evaluation.limits import not_met
from cdtool.evaluation.results import LimitResult, Results
from cdtool.plain_text import counted
from cdtool.report.few_contacts import explained
from cdtool.report.markdown.details import details
from cdtool.report.markdown.figures import comparison_section, force_sections, group_section, limit_sections
from cdtool.report.markdown.text import Section, escape, fitted
from cdtool.report.verdict_words import NO_CERTIFICATE, counts_words, verdict_words

# Room for the verdict and how to read the figures, whatever names there are.
_LEAST = 4_000
_LIMITS_NAMED = 5
_REASONS_NAMED = 4
_LONGEST_NAME = 40


@dataclass(frozen=True)
class Image:
    """A figure beside the report: its file name, caption, and group (None: of all groups)."""

    name: str
    caption: str
    group: str | None = None


def to_markdown(evaluated: Evaluated, images: Sequence[Image] = (), most: int = 60_000) -> str:
    """The report as GitHub-flavoured Markdown in at most `most` characters; text from files is never markup.

    Where all of it would be longer, tables are cut and say how many rows results.json has; the verdict and the limits
    go before figures, figures before what is folded. Raises UsageError for `most` below 4,000.
    """
    if most < _LEAST:
        raise UsageError(f"a report of at most {most} characters", f"give it {_LEAST} or more")
    results = evaluated.results
    figures = [Section("", " ".join(part for part in (_how_to_read(results), explained(evaluated.summaries)) if part))]
    figures += [Section("", _image(image)) for image in images if image.group is None]
    for group in results.groups:
        own = [_image(image) for image in images if image.group == group]
        figures.append(group_section(evaluated, group, "\n\n".join(own)))
    figures += [*comparison_section(evaluated), *force_sections(results)]
    return fitted(_head(evaluated), (*limit_sections(results), figures, details(results)), most)


def _head(evaluated: Evaluated) -> str:
    results = evaluated.results
    parts = [f"# Collision detection: {verdict_words(evaluated)}", f"{counts_words(evaluated)}."]
    failing = not_met(results.limits)
    if failing:
        named = "; ".join(_limit_words(item) for item in failing[:_LIMITS_NAMED])
        more = f"; and {len(failing) - _LIMITS_NAMED} more" if len(failing) > _LIMITS_NAMED else ""
        parts.append(f"**Not met:** {named}{more}.")
    reasons = results.conclusion.reasons
    if reasons:
        lines = [escape(reason) for reason in reasons[:_REASONS_NAMED]]
        lines += [f"and {len(reasons) - _REASONS_NAMED} more"] if len(reasons) > _REASONS_NAMED else []
        parts.append(f"**Force, missed contacts, not assessable:** {'; '.join(lines)}.")
    if results.skipped:
        parts.append(f"**Left out or lost: {counted(len(results.skipped), 'item')}**, named below.")
    return "\n\n".join([*parts, NO_CERTIFICATE])


def _how_to_read(results: Results) -> str:
    onset = escape(results.provenance.get("onset") or "rule not stated")
    return (
        f"Latency: from the onset of the contact ({onset}) to the alarm, with debounce. In brackets: 95 % interval. "
        "Mean and std are those of the n detected contacts; median and P95 take a missed contact as later than all. "
        '"At most": one-sided 95 % bound. Read a latency beside missed, not assessable and false alarms.'
    )


def _limit_words(item: LimitResult) -> str:
    where = ", ".join(escape(name, _LONGEST_NAME) for name in (item.detector, item.group, item.figure))
    return f"{where}: {escape(item.reason or item.outcome, 2 * _LONGEST_NAME)}"


def _image(image: Image) -> str:
    return f"![{escape(image.caption)}]({quote(image.name)})"
