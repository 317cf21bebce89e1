"""URLs as they are shown: without user info and query string, which are kept in memory and used for access only.

A path goes through text in many places (results, reports, messages, `FILE#RUN`). So that no secret goes with it, the
text is what is shown, and the rest is looked up when fsspec is asked. Only http and https have a query string in
general: in an object store `?` may be part of a name, and only what looks like a signed URL, `?name=value`, is hidden.
"""

from __future__ import annotations

import re

_URL = re.compile(r"(?P<scheme>[A-Za-z][A-Za-z0-9+.-]+)://(?P<rest>.*)", re.DOTALL)
_QUERY = re.compile(r"\?[^#]*")
_SIGNED = re.compile(r"\?[A-Za-z0-9._~-]+=[^#]*")
_USER_INFO = re.compile(r"(?<=://)[^/\s'\"@]*@")
_ANY_QUERY = re.compile(r"(?P<url>[A-Za-z][A-Za-z0-9+.-]+://[^\s'\"?]*)\?[^\s'\"]*")
# In these the part before @ is a container, not a user.
_CONTAINERS = frozenset(("abfs", "abfss", "wasb", "wasbs", "az", "adl"))

# What is not shown, by what is shown: the user info of a host, the query string of a URL.
_users: dict[str, str] = {}
_queries: dict[str, str] = {}


def scheme_of(text: str) -> str:
    """Return the protocol of a URL in lower case; empty for a local path.

    >>> scheme_of("s3://bucket/log.csv"), scheme_of("C:/logs/log.csv")
    ('s3', '')
    """
    match = _URL.match(text)
    return match["scheme"].lower() if match else ""


def shown(url: str) -> str:
    """Return a URL without user info and query string, which `complete` adds again in this process.

    >>> shown("https://user:secret@host/log.csv?X-Amz-Signature=abc")
    'https://host/log.csv'
    """
    match = _URL.match(url)
    assert match is not None, "a URL has a protocol"
    scheme, rest = match["scheme"].lower(), match["rest"]
    authority, slash, path = rest.partition("/")
    user, at, host = authority.rpartition("@")
    if at and (scheme not in _CONTAINERS or ":" in user):
        _users[f"{scheme}://{host}"] = user
        authority = host
    query = (_QUERY if scheme in ("http", "https") else _SIGNED).search(path)
    if query:
        path = path[: query.start()] + path[query.end() :]
    text = f"{scheme}://{authority}{slash}{path}"
    if query:
        _queries[text] = _queries[text.partition("#")[0]] = query[0]
    return text


def complete(text: str) -> str:
    """Return a URL with the user info and query string that `shown` has removed."""
    scheme, _, rest = text.partition("://")
    authority, slash, path = rest.partition("/")
    user = _users.get(f"{scheme}://{authority}")
    before = f"{scheme}://{user}@{authority}" if user else f"{scheme}://{authority}"
    return f"{before}{slash}{path}{_queries.get(text, '')}"


def without_secrets(text: str) -> str:
    """Return a message of a library without the user info and query strings of the URLs in it."""
    text = _ANY_QUERY.sub(lambda match: match["url"], _USER_INFO.sub("", text))
    for secret in (*_users.values(), *_queries.values()):
        text = text.replace(secret, "")
    return text
