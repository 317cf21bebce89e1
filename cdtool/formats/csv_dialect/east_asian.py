"""Recognise Japanese (Shift-JIS) and Chinese (GB18030) text by its bytes; a text in doubt is Latin.

Both encodings write a character as two bytes, the second of which may be an ASCII letter in Shift-JIS. A Latin text in
Windows-1252 has single bytes above 0x7f, rarely two in a row (`Größe`, `créée`), and read as one of these encodings it
has rare characters, one by one.
"""

from __future__ import annotations

import codecs
import re
from collections import Counter
from collections.abc import Callable

# A text has at least this many characters of its language in words of two or more.
_LETTERS = {"cp932": 3, "gb18030": 4}
# A word directly behind a small letter is part of a Latin one.
_WORD = re.compile(r"([a-z]?)([^\x00-\x7f]+)")
_HIGH = re.compile(rb"[\x80-\xff]")
_SYMBOLS_OF_JAPAN = range(0x81, 0x84)
_SYMBOLS_OF_CHINA = (0xA1, 0xA2, 0xA3, 0xA6, 0xA9)


def east_asian(sample: bytes) -> str | None:
    """Return "cp932" or "gb18030" for text in one of them, which is not UTF-8; None for any other text.

    The lines from the first with a byte above 0x7f on decide, up to 16 KB of them.

    Parameters
    ----------
    sample : bytes
        The first bytes of a text; its last character may be incomplete.

    Examples
    --------
    >>> east_asian("時間,位置,トルク".encode("cp932")), east_asian("时间,位置,速度".encode("gb18030"))
    ('cp932', 'gb18030')
    >>> east_asian("Zeit,Größe,Türöffnung,créée".encode("cp1252")) is None
    True
    """
    first = _HIGH.search(sample)
    begin = sample.rfind(b"\n", 0, first.start()) + 1 if first else 0
    lines = sample[begin : begin + (1 << 14)]  # enough to decide
    for encoding, kind in (("cp932", _japanese), ("gb18030", _chinese)):
        try:
            text = codecs.getincrementaldecoder(encoding)().decode(lines)
        except UnicodeDecodeError:
            continue
        if _is_plausible(Counter(_WORD.findall(text)), encoding, kind):
            return encoding
    return None


def _is_plausible(words: Counter[tuple[str, str]], encoding: str, kind: Callable[[bytes], str]) -> bool:
    """Return whether the words consist of common characters in words of several."""
    letters: set[str] = set()
    all_letters = sure = common = known = in_words = 0
    for (before, word), count in words.items():
        kinds = [kind(letter.encode(encoding)) for letter in word]
        pairs = len(kinds) - kinds.count("single")
        known += count * pairs
        common += count * (pairs - kinds.count("rare"))
        if pairs > 1 and not before:
            in_words += count * pairs
            sure += kinds.count("sure")
            all_letters += count * (kinds.count("letter") + kinds.count("sure"))
            letters.update(letter for letter, of in zip(word, kinds, strict=True) if of in ("letter", "sure"))
    enough = sure > 0 and all_letters >= _LETTERS[encoding] and len(letters) >= 3
    # Most are in common use, and at least half in words of two or more.
    return enough and common >= 0.75 * known and in_words >= 0.5 * known


def _japanese(character: bytes) -> str:
    """Return the kind of a character of Shift-JIS: kana and the characters of JIS level 1 are letters.

    Such a character with an ASCII letter as its second byte is no evidence: in Latin texts it is `é` before a letter.
    """
    if len(character) < 2:
        return "single"  # half-width kana, which are accented capitals in Latin texts
    lead, trail = character
    kana = (lead == 0x82 and trail >= 0x9F) or (lead == 0x83 and trail <= 0x96)
    if kana or 0x88 <= lead <= 0x97 or (lead == 0x98 and trail <= 0x72):
        return "sure" if kana or trail >= 0x80 else "symbol"
    return "symbol" if lead in _SYMBOLS_OF_JAPAN or lead == 0x87 else "rare"


def _chinese(character: bytes) -> str:
    """Return the kind of a character of GB18030: the characters of GB 2312 level 1 are letters.

    Only a second byte from 0xe0 on is sure: the others are capital letters in Latin texts, half-width kana in Japanese.
    """
    lead, trail = character[0], character[-1]
    if len(character) != 2 or trail < 0xA1:
        return "rare"
    if 0xB0 <= lead <= 0xD7:
        return "sure" if trail >= 0xE0 else "letter"
    return "symbol" if lead in _SYMBOLS_OF_CHINA else "rare"
