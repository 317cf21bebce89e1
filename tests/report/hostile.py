"""Hostile names that may be in a file or a configuration."""

HOSTILE = {
    "math": "$x^2$ \\frac{a}{",
    "script": "<script>alert(1)</script>&amp;",
    "climb": "../../etc/passwd",
    "newline": "one\ntwo\r\x00\x1b[31m",
    "right to left": "abc\u202egnp.exe\u2067",
    "long": "n" * 300,
    "markdown": "![x](http://a.b) | [y](z) `c` **d** @user www.a.b ~~s~~",
    "not a character": "a\ufffe\ud800b",
    "empty": "",
}
