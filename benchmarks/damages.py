"""Damages for the fuzzer: bytes anywhere, and for E57 also what lies behind its check sums.

Everything random comes from the generator that is passed down.
"""

from __future__ import annotations

import random
import re
import struct
from hashlib import sha256

__all__ = ["damaged", "damaged_e57", "damaged_kept", "damaged_laz"]

NUMBERS = (b"0", b"-1", b"nan", b"inf", b"1e999", b"-1e-320", b"1,5", b"4294967296", b"9" * 30, b"1e308", b"0x10", b"")
WHOLE = (0, 1, -1, 2**7, 2**8 - 1, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**62, 2**63 - 1, 2**64 - 1)


def damaged(data: bytes, chance: random.Random) -> bytes:
    """One to four damages of random kinds."""
    for _ in range(chance.randint(1, 4)):
        data = chance.choice(DAMAGES)(data, chance)
    return data


def _stretch(data: bytes, chance: random.Random) -> tuple[int, int]:
    start = chance.randrange(len(data) + 1)
    return start, min(len(data), start + int(chance.paretovariate(0.6)))


def _flip(data: bytes, chance: random.Random) -> bytes:
    if not data:
        return data
    at = chance.randrange(len(data))
    return data[:at] + bytes([data[at] ^ 1 << chance.randrange(8)]) + data[at + 1 :]


def _noise(data: bytes, chance: random.Random) -> bytes:
    at = chance.randrange(len(data) + 1)
    other = chance.randbytes(chance.randint(1, 8))
    return data[:at] + other + data[at + len(other) :]


def _cut(data: bytes, chance: random.Random) -> bytes:
    start, stop = _stretch(data, chance)
    return data[:start] + data[stop:]


def _truncate(data: bytes, chance: random.Random) -> bytes:
    return data[: chance.randrange(len(data) + 1)]


def _repeat(data: bytes, chance: random.Random) -> bytes:
    start, stop = _stretch(data, chance)
    return data[:stop] + data[start:stop] * chance.randint(1, 5) + data[stop:]


def _move(data: bytes, chance: random.Random) -> bytes:
    start, stop = _stretch(data, chance)
    at = chance.randrange(len(data) + 1)
    return data[:at] + data[start:stop] + data[at:]


def _snippet(data: bytes, chance: random.Random) -> bytes:
    from samples import SNIPPETS

    start, stop = _stretch(data, chance)
    return data[:start] + chance.choice(SNIPPETS) + data[stop if chance.random() < 0.5 else start :]


def _whole(data: bytes, chance: random.Random) -> bytes:
    """A number at the edge of what 1 to 8 bytes hold, of either byte order."""
    size = chance.choice((1, 2, 4, 8))
    value = (chance.choice(WHOLE) & (1 << 8 * size) - 1).to_bytes(size, chance.choice(("little", "big")))
    at = chance.randrange(len(data) + 1)
    return data[:at] + value + data[at + size :]


def _real(data: bytes, chance: random.Random) -> bytes:
    value = chance.choice((float("nan"), float("inf"), -1e308, 1e-320, 0.0))
    kind = chance.choice(("<d", ">d", "<f", ">f"))
    packed = struct.pack(kind, value if "d" in kind else value % 1e30)
    at = chance.randrange(len(data) + 1)
    return data[:at] + packed + data[at + len(packed) :]


def _number(data: bytes, chance: random.Random) -> bytes:
    """Another number in the place of one that stands there as text."""
    found = list(re.finditer(rb"-?\d+(\.\d+)?", data[:20000]))
    if not found:
        return _noise(data, chance)
    match = chance.choice(found)
    return data[: match.start()] + chance.choice(NUMBERS) + data[match.end() :]


def _encode(data: bytes, chance: random.Random) -> bytes:
    kinds = (
        lambda d: d.decode("latin-1").encode("utf-16"), lambda d: b"\xef\xbb\xbf" + d,
        lambda d: d.replace(b"\n", b"\r\n"), lambda d: d.replace(b".", b","), lambda d: d * 2,
    )  # fmt: skip
    return chance.choice(kinds)(data)


def _nest(data: bytes, chance: random.Random) -> bytes:
    """Brackets, ten thousand deep."""
    at = chance.randrange(len(data) + 1)
    return data[:at] + chance.choice((b"[", b"{", b'{"a":', b"<a>", b"(")) * 10000 + data[at:]


# Rare ones stand once, those that get past a parser's first lines more often.
DAMAGES = (_flip, _flip, _noise, _noise, _cut, _cut, _truncate, _repeat, _move, _snippet, _snippet, _whole, _whole,
           _real, _number, _number, _number, _number, _encode) * 3 + (_nest,)  # fmt: skip


def damaged_kept(data: bytes, chance: random.Random) -> bytes:
    """A kept stage; every other one has the right hash in front."""
    data = damaged(data, chance)
    return sha256(data[32:]).digest() + data[32:] if chance.random() < 0.5 else data


def damaged_laz(data: bytes, chance: random.Random) -> bytes:
    """A LAZ file, every other one only where lazrs reads: how points are packed, the table of chunks, the points."""
    if chance.random() < 0.5:
        return damaged(data, chance)
    start = data.index(b"laszip encoded")
    rest = data[start:]
    for _ in range(chance.randint(1, 4)):
        rest = chance.choice((_flip, _flip, _noise, _whole))(rest, chance)[: len(rest)]
    return data[:start] + rest


# ASTM E2807: 48 bytes of header, among them the length of the file, where its XML begins and how long it is; then
# binary sections, then XML, all in pages of 1020 bytes and a check sum of four.
_HEAD = "<8sIIQQQQ"
_E57_TYPES = (b"Integer", b"ScaledInteger", b"Float", b"String", b"Blob", b"Structure", b"Vector", b"CompressedVector")
_ELEMENT = re.compile(rb"<(\w+)[^<>]*(?:/>|>[^<]*</\1>|>(?:(?!<\1[ >]).)*?</\1>)", re.DOTALL)
_E57_ATTRIBUTES = (
    b'precision="single"', b'precision="double"', b'minimum="%s"', b'maximum="%s"', b'scale="%s"', b'offset="%s"',
    b'recordCount="%s"', b'fileOffset="%s"', b'length="%s"',
)  # fmt: skip


def damaged_e57(data: bytes, chance: random.Random) -> bytes:
    """An E57 file damaged behind its check sums: in the XML, which stays XML for the most part, or in the packets.

    One in eight is damaged anywhere instead, check sums and all.
    """
    if chance.random() < 0.125:
        return damaged(data, chance)
    from e57 import CONTENT, PAGE, content_of, paged

    content = content_of(data)
    head = list(struct.unpack_from(_HEAD, content))
    begin = head[4] - head[4] // PAGE * (PAGE - CONTENT)
    binary, xml = content[48:begin], content[begin : begin + head[5]]
    for _ in range(chance.randint(1, 3)):
        where = chance.random()
        if where < 0.6:
            xml = chance.choice(_XML_DAMAGES)(xml, chance)
        elif where < 0.95:
            binary = chance.choice((_flip, _noise, _whole, _whole, _real))(binary, chance)[: len(binary)]
        else:
            head[chance.randrange(1, 7)] = chance.choice(WHOLE) & 0xFFFFFFFF
    if chance.random() < 0.95:
        head[3], head[5] = -(-(begin + len(xml)) // CONTENT) * PAGE, len(xml)
    return paged(struct.pack(_HEAD, *head) + binary + xml)


def _other_element(xml: bytes, chance: random.Random) -> bytes:
    """An element left out, doubled, or put in the place of another."""
    found = list(_ELEMENT.finditer(xml))
    if not found:
        return xml
    one, other = chance.choice(found), chance.choice(found)
    text = chance.choice((b"", one[0] * 2, other[0]))
    return xml[: one.start()] + text + xml[one.end() :]


def _other_type(xml: bytes, chance: random.Random) -> bytes:
    found = list(re.finditer(rb'(?<=type=")\w+', xml))
    return _put(xml, found, chance.choice(_E57_TYPES), chance)


def _other_value(xml: bytes, chance: random.Random) -> bytes:
    """Another number between two tags, in an attribute, or where there was none."""
    found = list(re.finditer(rb'(?<=>)-?[\d.][\d.e+-]*(?=<)|(?<=")-?[\d.][\d.e+-]*(?=")', xml))
    value = chance.choice((*NUMBERS, b"%d" % chance.choice(WHOLE), b"%d" % chance.randrange(5000)))
    return _put(xml, found, value, chance)


def _other_attribute(xml: bytes, chance: random.Random) -> bytes:
    """One more attribute."""
    found = list(re.finditer(rb'(?<=type=")\w+"', xml))
    attribute = chance.choice(_E57_ATTRIBUTES)
    if b"%s" in attribute:
        attribute = attribute % chance.choice(NUMBERS)
    match = chance.choice(found) if found else None
    return xml[: match.end()] + b" " + attribute + xml[match.end() :] if match else xml


def _other_name(xml: bytes, chance: random.Random) -> bytes:
    """All elements of one name get another's."""
    names = sorted({m[0] for m in re.finditer(rb"(?<=<)\w+", xml)})
    if not names:
        return xml
    return re.sub(rb"(?<=<)(/?)%s\b" % chance.choice(names), rb"\1" + chance.choice(names), xml)


def _put(data: bytes, found: list[re.Match[bytes]], other: bytes, chance: random.Random) -> bytes:
    if not found:
        return data
    match = chance.choice(found)
    return data[: match.start()] + other + data[match.end() :]


_XML_DAMAGES = (_other_element, _other_element, _other_type, _other_value, _other_value, _other_value, _other_attribute,
                _other_name, _flip, _cut, _snippet)  # fmt: skip
