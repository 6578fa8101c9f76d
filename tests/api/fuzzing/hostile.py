"""Bodies and words that have broken other services."""

import json

import numpy as np

MARK = "zzMARKzz"


def npy(descr: object = "<f4", shape: object = (2, 1, 3), data: bytes = bytes(24)) -> bytes:
    """A .npy file with any header at all."""
    header = repr({"descr": descr, "fortran_order": False, "shape": shape}).encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + data


_PAIRS = '{"approximation": "lyon", "gamma": 8, "alpha": 50, "a": [[0, 0, 1]], "b": [[0, 0, %s]]}'
_CAMERA = {"position": [0, 0, 5], "target": [0, 0, 0]}
_BALL = {"shape": "sphere", "centre": [0, 0, 0], "radius": 1, "material": "m"}
_SCENE = {"camera": _CAMERA, "materials": {"m": {"shininess": 5}}, "objects": [_BALL]}
#: scenes that are wrong, with the mark wherever a name or a value may stand
_SCENES = (
    MARK,
    {MARK: 1},
    _SCENE | {MARK: 1},
    _SCENE | {"materials": {MARK: MARK}},
    _SCENE | {"materials": {MARK: {}}},
    _SCENE | {"materials": {MARK: {MARK: 1}}},
    _SCENE | {"materials": {MARK: {"diffuse": [MARK, 2, 3]}}},
    _SCENE | {"materials": {MARK: {"approximation": f"{MARK}:{MARK}"}}},
    _SCENE | {"materials": {MARK: {"approximation": f"lyon:{MARK}:{MARK}:{MARK}"}}},
    _SCENE | {"materials": {"m": {"approximation": "lyon:dot:" + "9" * 5000}}},
    _SCENE | {"materials": {"m": {"chequerboard": [MARK, [MARK]]}}},
    _SCENE | {"materials": {"m": {"chequerboard": [MARK, MARK]}}},
    _SCENE | {"materials": {MARK: {"shininess": 9e4, "specular": [1, 1, 1], "approximation": "lyon:dot:4"}}},
    *(_SCENE | {"objects": [_BALL | {key: MARK}]} for key in (*_BALL, MARK)),
    *(
        _SCENE | {"objects": [{"shape": "mesh", "material": "m", key: value}]}
        for key, value in (("file", f"{MARK}.obj"), ("file", "/etc/passwd"), ("surface", MARK), ("surface", "torus"))
    ),
    *(_SCENE | {"camera": _CAMERA | {"position": at}} for at in ([0, 0, 0], [0, 0, 1e9], [1e9] * 3, MARK, [MARK] * 3)),
    _SCENE | {"lights": [{"position": [0, 0, 5], "attenuation": [0, 0, 0]}]},
    _SCENE | {"lights": [MARK]},
)
#: bodies that claim to be JSON
JSON = (
    b"",
    b" ",
    b"null",
    b"[]",
    b"0",
    b'""',
    b"{",
    b"}",
    b"\xff\xfe",
    b"\xef\xbb\xbf{}",
    b"NaN",
    b"{'a': 1}",
    b"{}" * 2,
    b"[" * 100_000,
    b'{"a":' * 50_000,
    b'"\\ud800"',
    b'{"\\udfff": 1}',
    b'{"a": "\x00"}',
    b'{"a": 1, "a": 2}',
    *(
        _PAIRS.replace("%s", number).encode()
        for number in (
            "NaN",
            "Infinity",
            "-Infinity",
            "1e999",
            "-1e999",
            "1" * 5000,
            "0." + "1" * 5000,
            "1e-999",
            "true",
            "null",
            '"1"',
            "[1]",
            "{}",
            "-0",
            "00",
            "0x1",
            "1_000",
            ".5",
            "5.",
            "+1",
            "9" * 20,
            "-" + "9" * 400,
        )
    ),
    *(
        json.dumps({"approximation": name, "alpha": 50, "a": [], "b": []}).encode()
        for name in (MARK, "", "../phong", "phong\x00", "💥", "<script>", "a" * 10_000)
    ),
    json.dumps({"a": [[0, 0, 1]] * 1000, "b": [[0, 0, 1]] * 999, "approximation": "phong", "alpha": 1}).encode(),
    json.dumps({MARK: {MARK: [MARK] * 100}}).encode(),
    *(json.dumps({"scene": scene, "size": [8, 8]}).encode() for scene in _SCENES),
    *(json.dumps({"scene": "test-card", "size": [8, 8], key: MARK}).encode() for key in ("specular", "skip", "model")),
    json.dumps({"scene": "test-card", "size": [8, 8], "specular": {"approximation": "lyon", "lambda": MARK}}).encode(),
)
#: bodies that claim to be binary vectors
BINARY = (
    b"",
    b"\0",
    bytes(23),
    bytes(24),
    bytes(25),
    bytes(48),
    b"\xff" * 24,
    np.full(6, np.nan, "<f4").tobytes(),
    np.full(6, np.inf, "<f4").tobytes(),
    np.full(6, 3e38, "<f4").tobytes(),
    np.full(6, 1e-45, "<f4").tobytes(),
    np.full(600, -1.0, "<f8").tobytes(),
    npy(),
    npy(shape=(2, 1 << 40, 3)),
    npy(shape=(2, -1, 3)),
    npy(descr="|O"),
    npy(descr=">f4"),
    npy(descr="<c8"),
    npy(descr="<U9"),
    npy(shape=(2, 10**40, 3)),
    npy(data=bytes(25)),
    npy(data=b""),
    npy(shape="x"),
    npy(shape=()),
    npy(descr=["x"]),
    b"\x93NUMPY",
    b"\x93NUMPY\x03\x00" + b"\xff" * 60,
    b"\x93NUMPY\x01\x00\xff\xff" + b"(" * 65535,
    b"PK\x03\x04" + bytes(100),
    b"\x1f\x8b" + bytes(100),
)
#: bodies that claim to be forms; the boundary is always `x`
_PART = b'--x\r\nContent-Disposition: form-data; name="%s"\r\n\r\n%s\r\n'
FORMS = (
    b"",
    b"--x--",
    b"--x\r\n\r\n\r\n--x--",
    b"--x\r\n" * 1000,
    b"--x\r\nA: " + b"b" * 100_000,
    _PART % (b"request", b"{}"),
    _PART % (b"request", b"{}") + _PART % (b"vectors", b"") + b"--x--",
    _PART % (b"request", b"{}") * 2 + _PART % (b"vectors", npy()) + b"--x--",
    _PART % (b"request", b"{") + _PART % (b"vectors", npy()) + b"--x--",
    _PART % (b"request", b'{"lights": []}') + _PART % (b"vectors", npy(shape=(2, 1 << 40, 3))) + b"--x--",
    _PART.replace(b"form-data", b"attachment") % (b"request", b"{}") + b"--x--",
    b"--x\r\n" + b"Z" * 5000 + b": 1\r\n\r\n--x--",
)
#: values of parameters and parts of paths
WORDS = (
    "",
    " ",
    "0",
    "-1",
    "1e999",
    "nan",
    "inf",
    "-inf",
    "9" * 400,
    "0x10",
    "1/0",
    "1/255",
    "..",
    "../..",
    "%2e%2e",
    "\x00",
    "/",
    "//evil.example",
    "\\",
    "a" * 5000,
    MARK,
    "<script>",
    "'\"",
    "\r\nX: y",
    "ﬀ",
    "💥",
    "\ud800",
    "null",
    "true",
    "none",
    "latest",
    "lyon",
    "phong",
    "cross",
    "taylor",
    "8",
    "7",
    "50",
    "10..200",
    "10..",
    "10,50",
    "max_abs",
    "-max_abs",
    "float32",
    "l1",
    "half",
    "index.html",
    "front",
    "$(id)",
    "; DROP TABLE runs",
    "{{7*7}}",
    "${7*7}",
    "%s%n",
    "١٢",
)
ACCEPTS = (
    "*/*",
    "application/json",
    "text/csv",
    "application/vnd.apache.parquet",
    "application/octet-stream",
    "image/svg+xml",
    "text/*;q=0.1",
    "application/json;q=0",
    "nonsense",
    "a/b;q=x",
    "," * 1000,
    ";",
    "*/*;q=" + "9" * 100,
    "image/png",
    "application/x-npy",
)
HEADERS = (
    ("range", "bytes=0-0"),
    ("range", "bytes=" + "0-," * 500),
    ("content-encoding", "gzip"),
    ("host", "evil.example"),
    ("host", ""),
    ("if-none-match", "*"),
    ("if-none-match", '"' * 500),
    ("origin", "null"),
    ("transfer-encoding", "chunked"),
    ("content-length", "-1"),
    ("content-length", "9" * 20),
    ("expect", "100-continue"),
    ("cookie", MARK),
    ("x-forwarded-host", "evil.example"),
    ("te", "trailers"),
)
#: bodies by the media type they claim
BODIES = {
    "application/json": JSON,
    "application/octet-stream": BINARY,
    "application/x-npy": BINARY,
    "multipart/form-data; boundary=x": FORMS,
    "multipart/form-data": FORMS[:2],
    "text/plain": JSON[:3],
    "": BINARY[:2],
}
