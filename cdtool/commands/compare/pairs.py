"""Which recordings of two results files are the same, so that their contacts are compared one by one.

Conventions: a recording is the same where its bytes are (SHA-256), or where its name and every contact's onset are. A
group is paired where at least half of the recordings of the smaller side have a partner; else all of it is compared
unpaired, so that a chance match of two onsets never decides which contacts count.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from cdtool.base.errors import ConfigurationError
from cdtool.results.results import ContactResult, RecordingResult, Results, grouped

Onsets = Mapping[tuple[str, str], Mapping[int, tuple[float, float]]]
"""By group and recording: each contact's onset [s] and its uncertainty [s]."""


@dataclass(frozen=True)
class Pairing:
    """The partner in the new results of each old recording of a group, by name; where not `paired`, of the same bytes.

    What happened on the partners is a fact; whether they are enough to decide about the group is `paired`.
    """

    partners: Mapping[str, str]
    old_alone: int
    new_alone: int
    paired: bool


def pair_recordings(old: Results, new: Results) -> dict[str, Pairing]:
    """The pairing of every group that both hold.

    Raises ConfigurationError where a recording of the same bytes has other contacts: then the ground truth changed, and
    no difference would be the detector's.
    """
    onsets = (_onsets(old), _onsets(new))
    shared = [group for group in old.every_group if group in new.every_group]
    before, after = (grouped(results.recordings, "group") for results in (old, new))
    return {group: _pair(group, before.get(group, ()), after.get(group, ()), *onsets) for group in shared}


def _pair(
    group: str, old: Sequence[RecordingResult], new: Sequence[RecordingResult], before: Onsets, after: Onsets
) -> Pairing:
    partners = _same_bytes(old, new)
    counts = ({item.recording: item.contacts for item in old}, {item.recording: item.contacts for item in new})
    for name, partner in partners.items():
        if counts[0][name] != counts[1][partner]:
            raise _other_truth(name, f"its contacts are {counts[0][name]} in old and {counts[1][partner]} in new")
        _refuse_other_onsets(name, before.get((group, name), {}), after.get((group, partner), {}))
    identical = dict(partners)
    taken = set(partners.values())
    left = {item.recording for item in new} - taken
    for item in old:
        name = item.recording
        if name not in partners and name in left and _same_onsets(before.get((group, name)), after.get((group, name))):
            partners[name] = name
    paired = bool(partners) and 2 * len(partners) >= min(len(old), len(new))
    partners = partners if paired else identical
    return Pairing(partners, len(old) - len(partners), len(new) - len(partners), paired)


def _same_bytes(old: Sequence[RecordingResult], new: Sequence[RecordingResult]) -> dict[str, str]:
    """One to one by hash; of several copies the one of the same name first."""
    copies: dict[str, list[str]] = defaultdict(list)
    for item in new:
        if item.sha256:
            copies[item.sha256].append(item.recording)
    partners: dict[str, str] = {}
    for item in sorted(old, key=lambda item: item.recording not in copies.get(item.sha256, ())):
        free = copies.get(item.sha256)
        if free:
            partner = item.recording if item.recording in free else free[0]
            free.remove(partner)
            partners[item.recording] = partner
    return partners


def _same_onsets(
    before: Mapping[int, tuple[float, float]] | None, after: Mapping[int, tuple[float, float]] | None
) -> bool:
    """Return whether both have the same contacts; a recording without contacts cannot be recognised by its onsets."""
    if not before or not after or before.keys() != after.keys():
        return False
    return all(_agree(before[number], after[number]) for number in before)


def _refuse_other_onsets(
    name: str, before: Mapping[int, tuple[float, float]], after: Mapping[int, tuple[float, float]]
) -> None:
    for number in sorted(before.keys() & after.keys()):
        if not _agree(before[number], after[number]):
            onsets = f"{before[number][0]:.6f} s in old and {after[number][0]:.6f} s in new"
            raise _other_truth(name, f"contact {number} begins at {onsets}")


def _other_truth(name: str, problem: str) -> ConfigurationError:
    return ConfigurationError(
        f"{name}: the same bytes, but {problem}",
        "the ground truth changed: run the old build again with the labels and the version of the new one",
    )


def _agree(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """Whether two onsets are within the uncertainty of either."""
    # An onset in seconds since 1970 is stored to some 2e-7 s.
    return abs(one[0] - other[0]) <= min(one[1], other[1]) + 1e-6


def _onsets(results: Results) -> Onsets:
    found: dict[tuple[str, str], dict[int, tuple[float, float]]] = defaultdict(dict)
    for item in results.contacts:
        found[item.group, item.recording][item.contact] = (item.onset_s, item.onset_uncertainty_s or 0.0)
    return found


def pairs_of_contacts(
    pairing: Pairing, old: Sequence[ContactResult], new: Sequence[ContactResult]
) -> list[tuple[ContactResult, ContactResult]]:
    """The contacts of one detector that both hold, by recording and number."""
    after = {(item.recording, item.contact): item for item in new}
    keyed = ((item, (pairing.partners.get(item.recording, ""), item.contact)) for item in old)
    return [(item, after[key]) for item, key in keyed if item.recording in pairing.partners and key in after]
