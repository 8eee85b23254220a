"""Damage to bytes, to text, to JSON and to the containers of files."""

from __future__ import annotations

import copy
import io
import json
import math
import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from fuzzing.case import Case, cut

_WORDS = re.compile(rb"[^\s,=:/\[\]{}\"']+")
NUMBERS = (
    *(b"0", b"-1", b"1", b"nan", b"inf", b"-inf", b"1e38", b"1e39", b"1e308", b"1e999", b"1e-45", b"255", b"65536"),
    *(b"2147483647", b"2147483648", b"4294967295", b"9223372036854775807", b"9223372036854775808", b"59999999"),
    *(b"99999999999999999999999", b"9" * 5000, b"0x10", b"1_0", b"", b"x", b"1.5", b"100000", b"1000000000"),
)
VALUES: tuple[Any, ...] = (
    *(0, -1, 1, 2, 3, 0.5, -0.5, 1e38, 1e39, 1e308, float("nan"), float("inf"), 255, 256, 65535, 65536, 2**31),
    *(
        2**32,
        2**63,
        2**64,
        10**30,
        59_999_999,
        20_000_000,
        1_000_000,
        -(2**63),
        5126,
        5121,
        5130,
        True,
        None,
        "",
        "x",
    ),
    *("0", "x" * 100_000, "\0", "\ud800", [], {}, [0], [[]], [0, 0, 0], [float("nan")] * 3, {"x": 1}, "VEC3", "MAT4"),
    *([0] * 16, [1e300] * 16, list(range(100))),
)
ADDRESSES = (
    *("fifo", "/dev/zero", "/dev/full", "http://127.0.0.1:9/x", "file:///etc/passwd", "../../../../etc/passwd", "/"),
    *(".", "folder", "missing", "loop.png", "data:", "data:;base64,", "data:;base64,!!!!", "data:,abc", "%00", "\0"),
    *("data:application/octet-stream;base64," + "A" * 100_000, "x" * 5000, "empty.png", "//host/x", "C:\\x", "a:b"),
    *("http://[", "picture.png", "%", "~/x", "/proc/self/mem", "/proc/self/fd/0", "FTP://x", ""),
)


def mutated(case: Case, data: bytes) -> bytes:
    """Bytes with a few of them changed, gone, repeated or made huge."""
    rng = case.rng
    for _ in range(rng.choice([1, 1, 2, 3, 8])):
        data = rng.choice(_BYTES)(case, data)
    return data


def _at(case: Case, data: bytes) -> int:
    """A place, often in the header."""
    most = min(len(data), 256) if case.chance(0.6) else len(data)
    return case.rng.randrange(most) if most else 0


def _flip(case: Case, data: bytes) -> bytes:
    changed = bytearray(data)
    count = case.rng.choice([1, 1, 2, 4, 16, 64])
    for _ in range(count if data else 0):
        changed[_at(case, data)] ^= 1 << case.rng.randrange(8)
    case.note(f"{count} bits flipped")
    return bytes(changed)


def _cut(case: Case, data: bytes) -> bytes:
    end = case.rng.choice([0, 1, len(data) - 1, _at(case, data), case.rng.randrange(len(data) + 1)])
    case.note(f"cut after {end} of {len(data)} bytes")
    return data[: max(end, 0)]


def _repeat(case: Case, data: bytes) -> bytes:
    start, length = _at(case, data), case.rng.choice([1, 4, 16, 100, 1000])
    times = case.rng.choice([2, 3, 100])
    case.note(f"bytes {start} to {start + length} {times} times")
    return data[:start] + data[start : start + length] * times + data[start + length :]


def _remove(case: Case, data: bytes) -> bytes:
    start, length = _at(case, data), case.rng.choice([1, 2, 4, 16, 100])
    case.note(f"bytes {start} to {start + length} gone")
    return data[:start] + data[start + length :]


def _fill(case: Case, data: bytes) -> bytes:
    start, length = _at(case, data), case.rng.choice([1, 2, 4, 8, 64, 1000])
    value = case.rng.choice([0x00, 0xFF, 0x7F, 0x80, 0x20, 0x0A])
    case.note(f"bytes {start} to {start + length} all {value:#x}")
    return data[:start] + bytes([value]) * min(length, len(data) - start) + data[start + length :]


def _number(case: Case, data: bytes) -> bytes:
    start = _at(case, data)
    width = case.rng.choice([2, 4, 4, 8])
    number = case.rng.choice(
        [0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 1 << 20, 1 << 30, (1 << 31) - 1, 1 << 31, (1 << 32) - 1]
    )
    order = case.rng.choice("<>")
    code = {2: "H", 4: "I", 8: "Q"}[width]
    case.note(f"at {start} the number {number} ({order}{code})")
    packed = struct.pack(order + code, number & ((1 << (8 * width)) - 1))
    return data[:start] + packed + data[start + width :]


_BYTES: tuple[Callable[[Case, bytes], bytes], ...] = (_flip, _flip, _cut, _repeat, _remove, _fill, _number, _number)


# Text -------------------------------------------------------------------------------------------------------


def mutated_text(case: Case, data: bytes) -> bytes:
    """Text with a few words or lines changed, gone or repeated; at times only bytes."""
    for _ in range(case.rng.choice([1, 1, 2, 4])):
        data = mutated(case, data) if case.chance(0.2) else case.rng.choice(_TEXT)(case, data)
    return data


def _word(case: Case, data: bytes) -> bytes:
    words = list(_WORDS.finditer(data))
    if not words:
        return data
    word = case.rng.choice(words)
    by = case.rng.choice(
        [*NUMBERS, *NUMBERS, case.rng.choice(words)[0], case.rng.choice(ADDRESSES).encode("utf-8", "replace")]
    )
    case.note(
        f"{cut(word[0].decode(errors='replace'), 40)} at {word.start()} is {cut(by.decode(errors='replace'), 60)}"
    )
    return data[: word.start()] + by + data[word.end() :]


def _line(case: Case, data: bytes) -> bytes:
    lines = data.split(b"\n")
    at = case.rng.randrange(len(lines))
    times = case.rng.choice([0, 0, 2, 3, 100, 100_000])
    times = min(times, 1 + 20_000_000 // (1 + len(lines[at])))
    case.note(f"line {at + 1}, {cut(lines[at].decode(errors='replace'), 60)}, {times} times")
    if times > 1000 and case.chance(0.5):
        case.note("each with a number of its own")
        repeated = [lines[at] + str(k).encode() for k in range(times)]
    else:
        repeated = [lines[at]] * times
    return b"\n".join(lines[:at] + repeated + lines[at + 1 :])


def _swap(case: Case, data: bytes) -> bytes:
    lines = data.split(b"\n")
    first, second = (case.rng.randrange(len(lines)) for _ in range(2))
    lines[first], lines[second] = lines[second], lines[first]
    case.note(f"lines {first + 1} and {second + 1} swapped")
    return b"\n".join(lines)


def _wide(case: Case, data: bytes) -> bytes:
    words = list(_WORDS.finditer(data))
    if not words:
        return data
    word = case.rng.choice(words)
    case.note(f"{cut(word[0].decode(errors='replace'), 40)} at {word.start()} up to 100,000 times")
    return data[: word.start()] + b" ".join([word[0]] * min(100_000, 20_000_000 // len(word[0]))) + data[word.end() :]


_TEXT: tuple[Callable[[Case, bytes], bytes], ...] = (_word, _word, _word, _line, _line, _swap, _wide)


# JSON -------------------------------------------------------------------------------------------------------


def mutated_json(case: Case, data: bytes) -> bytes:
    """JSON with a few values replaced, gone, repeated or nested."""
    if case.chance(0.15):
        return mutated_text(case, data)
    if case.chance(0.05):
        return case.rng.choice(
            [b"[" * 100_000, b'{"a":' * 100_000, b"[]", b"null", b"{}", b'"' + b"x" * 10**6 + b'"']
        )
    tree = json.loads(data)
    for _ in range(case.rng.choice([1, 1, 1, 2, 3])):
        found = list(_json_places(tree))
        if not found:
            break
        holder, key = case.rng.choice(found)
        action = case.rng.choice(["value", "value", "value", "value", "delete", "repeat", "nest", "add"])
        case.note(f"{action} {key!r} of {cut(json.dumps(holder[key]), 60)}")
        if action == "delete":
            del holder[key]
        elif action == "repeat" and isinstance(holder, list):
            times = case.rng.choice([2, 100, 200_000])
            case.note(f"{times} times")
            holder[key:key] = [holder[key]] * times
        elif action == "nest":
            holder[key] = [holder[key]]
        elif action == "add" and isinstance(holder, dict):
            holder[case.rng.choice(_KEYS)] = _json_value(case, None)
        else:
            holder[key] = _json_value(case, holder[key])
    return json.dumps(tree).encode("utf-8", "replace")


_KEYS = (
    *("matrix", "rotation", "scale", "translation", "mesh", "skin", "children", "weights", "extensions", "sparse"),
    *(
        "byteStride",
        "byteOffset",
        "mode",
        "normalized",
        "indices",
        "targets",
        "uri",
        "bufferView",
        "extensionsRequired",
    ),
)


def _json_places(node: Any) -> Iterator[tuple[Any, Any]]:
    for key in list(node) if isinstance(node, dict) else range(min(len(node), 30)):
        yield node, key
        if isinstance(node[key], dict | list):
            yield from _json_places(node[key])


def _json_value(case: Case, before: Any) -> Any:
    value = case.rng.choice(ADDRESSES if isinstance(before, str) and case.chance(0.6) else VALUES)
    case.note(f"now {cut(repr(value), 60)}")
    return copy.deepcopy(value)


# Containers -------------------------------------------------------------------------------------------------


def mutated_glb(case: Case, data: bytes) -> bytes:
    """A binary glTF file, of which the description is mutated, or the bytes."""
    if case.chance(0.3) or data[:4] != b"glTF":
        return mutated(case, data)
    size = int.from_bytes(data[12:16], "little")
    text = mutated_json(case, data[20 : 20 + size])
    text += b" " * (-len(text) % 4)
    rest = data[20 + size :]
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest


def mutated_png(case: Case, data: bytes) -> bytes:
    """A PNG, of which a chunk is mutated and its check sum is right again, or the bytes."""
    if case.chance(0.3):
        return mutated(case, data)
    chunks, at = [], 8
    while at + 12 <= len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        chunks.append((data[at + 4 : at + 8], data[at + 8 : at + 8 + length]))
        at += 12 + length
    number = case.rng.randrange(len(chunks))
    name, body = chunks[number]
    action = case.rng.choice(["mutate", "mutate", "header", "repeat", "remove", "add"])
    case.note(f"{action} chunk {name.decode()}")
    if action == "header":
        sides = [case.rng.choice([0, 1, 16, 16384, 16385, 65535, 2**31 - 1, 2**32 - 1]) for _ in range(2)]
        bits = case.rng.choice([1, 2, 4, 8, 16, 32])
        kind = case.rng.choice([0, 2, 3, 4, 6, 5])
        chunks[0] = (b"IHDR", struct.pack(">IIBBBBB", *sides, bits, kind, 0, 0, case.rng.choice([0, 1, 2])))
        case.note(f"{sides[0]} × {sides[1]}, {bits} bits, kind {kind}")
    elif action == "repeat":
        chunks.insert(number, chunks[number])
    elif action == "remove":
        del chunks[number]
    elif action == "add":
        bomb = zlib.compress(bytes(100_000_000), 9)
        extra = case.rng.choice(
            [
                (b"zTXt", b"x\0\0" + bomb),
                (b"iCCP", b"x\0\0" + bomb),
                (b"iTXt", b"x\0\1\0\0\0" + bomb),
                (b"eXIf", b"II*\0" + b"\xff" * 40),
                (b"tRNS", b"\0" * 500),
                (b"PLTE", b"\0" * 7),
                (b"acTL", b"\xff" * 8),
                (b"gAMA", b"\0\0\0\0"),
            ]
        )
        chunks.insert(1, extra)
        case.note(f"a chunk {extra[0].decode()}")
    else:
        chunks[number] = (name, mutated(case, body))
    made = [
        struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
        for name, body in chunks
    ]
    return data[:8] + b"".join(made)


_HEADERS = (
    *("(1000000000, 1000000000)", "(16385, 16385)", "()", "(16,)", "(2, 2, 2)", "(-1, 16)", "(0, 0)", "(16, 0)"),
    *("(1, 16384)", "(" * 200, "(" * 9000, "(16.0, 16)", "None", "(2**70,)", "(True, 2)", "(4611686018427387904, 4)"),
)
_TYPES = (
    *("'|O'", "'<U1000000000'", "'<f2'", "'>f8'", "'<c16'", "'|S4'", "'<M8[s]'", "'|V8'", "'|b1'", "'x'", "'<f16'"),
    *("[('a', '<f4')]", "'|i1'", "'<u8'", "None", "'<f4,<f4'", "[('a', '<f4', (1000000, 1000000))]"),
)


def mutated_npy(case: Case, data: bytes) -> bytes:
    """An array, of which the header, values or bytes are mutated."""
    if case.chance(0.3) or len(data) < 12:
        return mutated(case, data)
    if case.chance(0.4):
        return _other_values(case, data)
    length = int.from_bytes(data[8:10], "little")
    header, rest = data[10 : 10 + length].decode("latin-1"), data[10 + length :]
    if case.chance(0.6):
        shape = case.rng.choice(_HEADERS)
        case.note(f"shape {cut(shape, 60)}")
        header = re.sub(r"\([^)]*\)", lambda _: shape, header, count=1)
    else:
        kind = case.rng.choice(_TYPES)
        case.note(f"type {kind}")
        header = re.sub(r"'[<>|][^']*'", lambda _: kind, header, count=1)
    text = header.encode("latin-1")
    if len(text) > 65535 or case.chance(0.1):
        return b"\x93NUMPY\x02\x00" + struct.pack("<I", len(text)) + text + rest
    return data[:8] + struct.pack("<H", len(text)) + text + rest


def _other_values(case: Case, data: bytes) -> bytes:
    """The same array with one of its values, or all, strange."""
    try:
        array = np.load(io.BytesIO(data), allow_pickle=False).copy()
    except Exception:
        return mutated(case, data)
    kind = array.dtype.kind
    strange: list[Any] = [0, -1, 1, 2**31 - 1, 2**63 - 1, -(2**62), 255, 1000]
    if kind == "f":
        strange = [0.0, -0.0, math.nan, math.inf, -math.inf, 1e38, -1e38, 1e300, 1e9, -1e9, 1e-45, -1.0]
    elif kind in "US":
        strange = ["", "x", "{}", "\n", "x" * 1000]
    value = case.rng.choice(strange)
    case.note(f"value {cut(repr(value), 40)} in {array.dtype} {array.shape}")
    with np.errstate(all="ignore"):
        put = np.array([value]).astype(array.dtype) if kind not in "US" else np.array([value])
    if array.ndim == 0 or kind in "US":
        array = put[0] if array.ndim == 0 else put
    elif case.chance(0.5):
        array[...] = put[0]
    elif array.size:
        array.flat[case.rng.randrange(array.size)] = put[0]
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=False)
    return stream.getvalue()


def mutated_npz(case: Case, data: bytes) -> bytes:
    """An archive of arrays, of which a member is mutated or unpacks to gigabytes, or the bytes."""
    rng = case.rng
    if case.chance(0.3):
        return mutated(case, data)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = [(name, archive.read(name)) for name in archive.namelist()]
    except Exception:
        return mutated(case, data)
    name, _ = rng.choice(members)
    action = rng.choice(["array", "array", "array", "bomb", "name", "again", "many", "remove"])
    case.note(f"{action} {name}")
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for each, content in members:
            if each == name and action == "remove":
                continue
            if each == name and action == "array":
                content = mutated_npy(case, content)
            if each == name and action == "bomb":
                _bomb(case, archive, each)
                continue
            if each == name and action == "name":
                each = rng.choice(
                    ["../x.npy", "/x.npy", "x", ".npy", "x" * 60_000 + ".npy", "é.npy", "a\\b.npy", "\x1b.npy"]
                )
            archive.writestr(each, content)
            if each == name and action == "again":
                archive.writestr(each, content[: len(content) // 2])
        if action == "many":
            for k in range(20_000):
                archive.writestr(f"many{k}.npy", b"")
    return stream.getvalue()


def _bomb(case: Case, archive: zipfile.ZipFile, name: str) -> None:
    """A member of three gigabytes: zeros, behind a header that declares them, or many more, or few."""
    rows, columns = case.rng.choice([(16384, 49152), (12000, 12000), (1 << 20, 1 << 20), (16, 16), (800_000_000, 1)])
    header = f"{{'descr': '<f4', 'fortran_order': False, 'shape': ({rows}, {columns}), }}\n".encode()
    if columns == 1:
        header = f"{{'descr': '<f4', 'fortran_order': False, 'shape': ({rows},), }}\n".encode()
    case.note(f"shape {rows} × {columns}, 3 GiB of zeros")
    with archive.open(name, "w", force_zip64=True) as member:
        member.write(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header)
        zeros = bytes(1 << 24)
        for _ in range(192):
            member.write(zeros)
