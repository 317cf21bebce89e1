"""What users see of errors: one line that names the file once."""

from __future__ import annotations

from pathlib import Path

import pytest

from cdtool.base.errors import RecordingError, naming


@pytest.mark.parametrize("name", ["line", "l", "no", "is", "logs/01.csv"])
def test_a_file_is_named_once_even_if_its_name_begins_the_message(name):
    with pytest.raises(RecordingError) as fault, naming(Path("outer")), naming(Path(name)):
        raise RecordingError("line 78, column 'speed': is no number")
    assert fault.value.message == f"outer: {name}: line 78, column 'speed': is no number"
    with pytest.raises(RecordingError) as fault, naming(Path(name)), naming(Path(name)):
        raise RecordingError("line 78")
    assert fault.value.message == f"{name}: line 78"
