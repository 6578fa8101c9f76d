"""A multipart/form-data body, cut into its parts without copying them."""

from python_multipart.exceptions import FormParserError
from python_multipart.multipart import MultipartParser, parse_options_header

from phongbench_api.http.problems import MalformedError, RequestError

_MOST_PARTS = 8


class _Cutter:
    """Where the parts of one body begin and end; python-multipart reports offsets into the buffer."""

    def __init__(self) -> None:
        self.places: dict[bytes, tuple[int, int]] = {}
        self._header, self._value = b"", b""
        self._name: bytes | None = None
        self._from: int | None = None
        self._to = 0

    def on_part_begin(self) -> None:
        """A part begins."""
        if len(self.places) == _MOST_PARTS:
            raise MalformedError(f"more than {_MOST_PARTS} parts", "(body)")
        self._name, self._from, self._to = None, None, 0

    def on_header_field(self, data: bytes, start: int, end: int) -> None:
        """A piece of a header's name."""
        self._header += data[start:end]

    def on_header_value(self, data: bytes, start: int, end: int) -> None:
        """A piece of a header's value."""
        self._value += data[start:end]

    def on_header_end(self) -> None:
        """A header is whole; only the one that names the part counts."""
        if self._header.lower() == b"content-disposition":
            kind, options = parse_options_header(self._value)
            self._name = options.get(b"name") if kind == b"form-data" else None
        self._header = self._value = b""

    def on_part_data(self, data: bytes, start: int, end: int) -> None:
        """A piece of the part, which lies in the buffer in one piece."""
        self._from, self._to = (start if self._from is None else self._from), end

    def on_part_end(self) -> None:
        """A part is whole."""
        if self._name is None or self._name in self.places:
            raise MalformedError("a part without a name, or two of the same", "(body)")
        self.places[self._name] = (self._from or 0, self._to if self._from is not None else 0)


def parts(body: bytes, content_type: str, wanted: tuple[str, ...]) -> dict[str, memoryview]:
    """The parts of these names, which must be all there are; views of the body."""
    _, options = parse_options_header(content_type)
    boundary = options.get(b"boundary", b"")
    if not 0 < len(boundary) <= 70:
        raise MalformedError("the content type has no usable boundary", "Content-Type")
    cutter = _Cutter()
    names = ("on_part_begin", "on_header_field", "on_header_value", "on_header_end", "on_part_data", "on_part_end")
    parser = MultipartParser(boundary, {name: getattr(cutter, name) for name in names})  # type: ignore[arg-type]
    try:
        parser.write(body)
        parser.finalize()
    except FormParserError:
        raise MalformedError("the body is no multipart/form-data", "(body)") from None
    if set(cutter.places) != {name.encode() for name in wanted} or not _ends(body, boundary):
        raise RequestError("must have exactly these parts, whole", "(body)", f"parts: {', '.join(wanted)}")
    view = memoryview(body)
    return {name: view[slice(*cutter.places[name.encode()])] for name in wanted}


def _ends(body: bytes, boundary: bytes) -> bool:
    return body.rstrip(b"\r\n \t").endswith(b"--" + boundary + b"--")
