"""Ways in which JSON and archives of arrays are damaged, each drawn from a random generator."""

from __future__ import annotations

import io
import json
import re
import struct
import zipfile
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.shows.fuzz.damage import OF_TEXT, Way, emptied, flipped, truncated

# what takes the place of a value of JSON; the last two are texts that no reader makes of a value
ODD: tuple[Any, ...] = (
    *(None, True, -1, 0, 1e308, 10**400, float("nan"), float("inf"), "", "x" * 5000, "\n\x00*/"),
    *([], {}, [[]], {"": {}}, [None] * 3, {"x": 1.0}),
)
ENCRYPTED, COMPRESSION, LOCAL, CENTRAL = 0x1, 99, b"PK\x03\x04", b"PK\x01\x02"


def nested(data: bytes, rng: np.random.Generator) -> bytes:
    """JSON with lists or tables in each other in the place of a value."""
    depth = int(rng.choice([50, 100, 500, 900, 2000, 100_000]))
    inner = "[" * depth + "]" * depth if rng.random() < 0.5 else '{"a":' * depth + "1" + "}" * depth
    return _with_value(data, rng, inner)


def long_number(data: bytes, rng: np.random.Generator) -> bytes:
    """JSON with a number of hundreds or thousands of digits in the place of a value."""
    return _with_value(data, rng, "1" + "0" * int(rng.choice([308, 309, 400, 5000])))


def odd_value(data: bytes, rng: np.random.Generator) -> bytes:
    """JSON with another value in the place of one."""
    return _with_value(data, rng, json.dumps(ODD[int(rng.integers(len(ODD)))]))


def lost_key(data: bytes, rng: np.random.Generator) -> bytes:
    """JSON without one of its keys."""
    content = json.loads(data.splitlines()[0] if _lines(data) else data)
    tables = [place for place in _places(content) if isinstance(place[0], dict)]
    if tables:
        group, key = tables[int(rng.integers(len(tables)))]
        del group[key]
    return json.dumps(content).encode() + (b"\n" if _lines(data) else b"")


def _lines(data: bytes) -> bool:
    """Whether a file has JSON in each line."""
    return len(data.splitlines()) <= 2


def _places(content: Any) -> list[tuple[Any, Any]]:
    """All places of values: what holds them, and their keys."""
    found, waiting = [], [content]
    while waiting:
        group = waiting.pop()
        keys = list(group) if isinstance(group, dict) else range(len(group))
        found += [(group, key) for key in keys]
        waiting += [group[key] for key in keys if isinstance(group[key], dict | list)]
    return found


def _with_value(data: bytes, rng: np.random.Generator, text: str) -> bytes:
    content = json.loads(data.splitlines()[0] if _lines(data) else data)
    places = _places(content)
    if places:
        group, key = places[int(rng.integers(len(places)))]
        group[key] = "<here>"
    return json.dumps(content).replace('"<here>"', text, 1).encode()


def encrypted(data: bytes, rng: np.random.Generator) -> bytes:
    """An archive whose members state that they are encrypted."""
    return _stated(data, 6, 8, ENCRYPTED)


def unknown_compression(data: bytes, rng: np.random.Generator) -> bytes:
    """An archive whose members state a compression that nobody knows."""
    return _stated(data, 8, 10, COMPRESSION)


def _stated(data: bytes, local: int, central: int, value: int) -> bytes:
    """An archive with a number of each member's header set."""
    changed = bytearray(data)
    for signature, place in ((LOCAL, local), (CENTRAL, central)):
        at = changed.find(signature)
        while at >= 0:
            changed[at + place : at + place + 2] = struct.pack("<H", value)
            at = changed.find(signature, at + 4)
    return bytes(changed)


def huge_shape(data: bytes, rng: np.random.Generator) -> bytes:
    """An archive of arrays whose headers state up to 1e12 numbers."""
    count = int(rng.choice([10**7, 10**9, 10**12, 10**18]))
    return _rewritten(data, lambda header: re.sub(r"\(\d+,\)", f"({count},)", header))


def broken_header(data: bytes, rng: np.random.Generator) -> bytes:
    """An archive of arrays whose headers are no text of NumPy."""
    kinds = ("(" * 40, "{'descr': '<f8'", "None", "'<f8'", "\x00\xff", "{'shape': (3,)}")
    kind = kinds[int(rng.integers(len(kinds)))]
    return _rewritten(data, lambda header: kind)


def other_kind(data: bytes, rng: np.random.Generator) -> bytes:
    """An archive of arrays of another kind, shape or length, or without numbers."""
    kinds: tuple[Callable[[Any], Any], ...] = (
        lambda a: a.astype(str),
        lambda a: a.astype("i1"),
        lambda a: a[None, :],
        lambda a: a[: len(a) // 2],
        lambda a: a[:0],
        lambda a: a * np.nan,
        lambda a: a * 1e300,
        lambda a: a[::-1],
        lambda a: a.astype(object),
        lambda a: np.zeros(2_000_000),
    )
    kind = kinds[int(rng.integers(len(kinds)))]
    stream = io.BytesIO()
    with np.load(io.BytesIO(data)) as arrays, np.errstate(all="ignore"):
        np.savez_compressed(stream, **{name: kind(arrays[name]) for name in arrays.files})
    return stream.getvalue()


def lost_series(data: bytes, rng: np.random.Generator) -> bytes:
    """An archive of arrays without some of them."""
    stream = io.BytesIO()
    with np.load(io.BytesIO(data)) as arrays:
        kept = [name for name in arrays.files if rng.random() < 0.7]
        np.savez_compressed(stream, **{name: arrays[name] for name in kept})
    return stream.getvalue()


def _rewritten(data: bytes, change: Callable[[str], str]) -> bytes:
    """An archive of arrays with other headers; one that states more than before is padded."""
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, _archive(stream) as new:
        for name in old.namelist():
            array = old.read(name)
            length = struct.unpack("<H", array[8:10])[0]
            header = change(array[10 : 10 + length].decode("latin-1")).encode("latin-1")
            size = struct.pack("<H", len(header))
            new.writestr(name, array[:8] + size + header + array[10 + length :])
    return stream.getvalue()


def _archive(stream: io.BytesIO) -> zipfile.ZipFile:
    return zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1)


OF_JSON: tuple[Way, ...] = (*OF_TEXT, nested, long_number, odd_value, lost_key)
OF_ARRAYS: tuple[Way, ...] = (
    *(truncated, flipped, emptied, encrypted, unknown_compression),
    *(huge_shape, broken_header, other_kind, lost_series),
)
