"""Texts of users in ASCII, which all files of other programs are written in."""

from __future__ import annotations

import unicodedata

# Letters that Unicode does not decompose, umlauts as German writes them without, minus and dashes.
_OTHER = "äöüÄÖÜßæÆøØœŒłŁđĐı\u2212\u2013\u2014"
_PLAIN = "ae,oe,ue,Ae,Oe,Ue,ss,ae,Ae,oe,Oe,oe,Oe,l,L,d,D,i,-,-,-"
_LETTERS = str.maketrans(dict(zip(_OTHER, _PLAIN.split(","), strict=True)))


def in_ascii(text: str) -> str:
    """Return a text with letters of ASCII for Latin ones (ä becomes ae, é e), and ? for all else beyond ASCII."""
    composed = unicodedata.normalize("NFC", text).translate(_LETTERS)
    return "".join(c if c.isascii() else _letters(c) for c in composed)


def _letters(sign: str) -> str:
    parts = (c for c in unicodedata.normalize("NFKD", sign) if not unicodedata.combining(c))
    letters = "".join(parts)
    # Of a wide or a barred "<" it must not make one that opens a tag.
    return letters if letters.isascii() and letters.isalpha() else "?"


def identifier(text: str, first: str) -> str:
    """Return a text as a name that every program accepts: letters, digits and underscores, a letter first.

    Parameters
    ----------
    text : str
    first : str
        Word to be put in front of a name that does not begin with a letter.
    """
    name = "".join(c if c.isalnum() else "_" for c in in_ascii(text))
    return name if name[:1].isalpha() else f"{first}_{name}"
