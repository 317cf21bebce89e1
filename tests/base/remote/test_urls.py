"""What of a URL is shown."""

from __future__ import annotations

import pytest

from cdtool.base.remote.urls import complete, shown, without_secrets


@pytest.mark.parametrize(
    ("url", "expected"),
    [
        ("s3://bucket/a b/ü#1.csv", "s3://bucket/a b/ü#1.csv"),
        ("S3://bucket/a?.csv", "s3://bucket/a?.csv"),
        ("s3://bucket/a.csv?X-Amz-Signature=abc", "s3://bucket/a.csv"),
        ("https://user:pass@host:8000/a.csv?sig=abc&x=1", "https://host:8000/a.csv"),
        ("https://host/a.csv?sig=abc#7", "https://host/a.csv#7"),
        ("sftp://user:pa:ss@host/a.csv", "sftp://host/a.csv"),
        ("abfs://box@account.dfs.core.windows.net/a.csv", "abfs://box@account.dfs.core.windows.net/a.csv"),
    ],
)
def test_user_info_and_query_are_not_shown_and_used_for_access(url, expected):
    assert shown(url) == expected
    scheme, _, rest = url.partition("://")
    if "#7" not in url:
        assert complete(expected) == f"{scheme.lower()}://{rest}"


def test_the_query_of_a_log_is_that_of_its_runs():
    shown("https://host/cycles.csv?sig=xyz#7")
    assert complete("https://host/cycles.csv") == "https://host/cycles.csv?sig=xyz"


def test_messages_of_libraries_lose_their_secrets():
    shown("sftp://robot:geheim@plant/log.csv")
    said = "401, url='https://u:pw@host/a.csv?X-Amz-Signature=0123' for robot:geheim"
    clean = without_secrets(said)
    assert not any(secret in clean for secret in ("pw", "0123", "geheim", "Amz"))
    assert "https://host/a.csv" in clean
