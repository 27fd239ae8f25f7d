"""Films and pictures: frames streamed into a file that appears under its name only when it is complete.

| path | result |
|---|---|
| `name.mp4` | H.264, plays everywhere; odd sizes are padded by one row or column |
| `name.gif` | loops forever, a palette of its own for every frame; of more than 50 frames per second only 50 are kept |
| `name.png` | one picture: the last frame |
| `folder/` or `name_%04d.png` | a sequence of pictures, numbered from 0 |

mp4 and GIF are encoded by the ffmpeg that comes with imageio-ffmpeg, run here as a process: imageio's own writer
ignores ffmpeg's exit status and messages, so that a full disk would pass for a finished film.
"""

import contextlib
import fractions
import os
import pathlib
import re
import subprocess
import tempfile
import threading
import types
import warnings
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from fieldsim import files, interrupts, validate
from fieldsim.copies import Uncopied
from fieldsim.errors import FieldsimWarning, FilmError, InputError
from fieldsim.types import PathLike, RealLike, SizeLike, WholeLike

KNOWN = "name.mp4, name.gif, name.png (one picture), folder/ or name_%04d.png (a sequence)"

# Names of a sequence's pictures.
_PATTERN = re.compile(r"[^%]*%0?[0-9]?d[^%]*\.png", re.IGNORECASE | re.DOTALL)

# Frames per second that films can have.
SLOWEST, FASTEST = 0.01, 1000.0

# Constant quality 18 is visually lossless. A fixed number of threads and no time stamps: same frames, same bytes.
_MP4 = (
    "-vf scale=out_color_matrix=bt709:flags=accurate_rnd+full_chroma_int,"
    "setparams=colorspace=bt709:color_primaries=bt709:color_trc=bt709 "
    "-c:v libx264 -preset fast -crf 18 -pix_fmt yuv420p -threads 2 -movflags +faststart "
    "-fflags +bitexact -flags:v +bitexact -f mp4"
).split()
_GIF = (
    "-filter_complex split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=new=1:dither=bayer:bayer_scale=4 "
    "-loop 0 -threads 1 -fflags +bitexact -flags:v +bitexact -f gif"
).split()


class Film(Uncopied):
    """A film being written: a context manager with `write(image)`.

        with fs.Film("walk.mp4", fps=30) as film:
            for t in fs.timeline(4.0, fps=30):
                film.write(fs.render(world.at(t), camera))

    path: where to; its ending says what (see above). size: (width, height) in pixels; None takes the first image's.
    fps: frames per second, 0.01 to 1000. The file appears under its name when the block ends. When the block is left by
    an error or an interrupt, the frames so far appear under that name if there was nothing before, else as
    `name.partial.mp4` (pictures of a sequence in `name.partial/`), and the error says so; of a `name.png` nothing
    appears. What was there before is replaced by a whole film only.
    Raises InputError for a path that cannot be (before any frame is made) and FilmError when writing fails, as on a
    full disk, which leaves whole pictures of a sequence only.
    """

    _remedy = "make one in each process"

    def __init__(
        self, path: PathLike, size: SizeLike | None = None, fps: RealLike = 30.0, *, planned: WholeLike | None = None
    ):
        self._target = validate.path("Film", "path", path)
        self.path = os.fspath(path)
        self.fps = validate.number("Film", "fps", fps, at_least=SLOWEST, at_most=FASTEST)
        self.size = None if size is None else validate.size("Film", size)
        self.planned = None if planned is None else validate.whole("Film", "planned", planned, at_least=0)
        self.frames = 0
        self._format = _format_of(self.path)
        self._format.check(self._target)
        self._part: files.Part | None = None
        self._writer: Writer | None = None
        self._failure: FilmError | None = None
        self._lock = threading.Lock()

    @property
    def still(self) -> bool:
        """Whether only the last frame is kept, so that the others need not be made."""
        return self._format is _Picture

    def __enter__(self) -> "Film":
        if self._part is not None:
            raise FilmError(f"{self.path}: the film is open already; give every `with` a fs.Film of its own")
        try:
            self._part = files.Part(self._target, folder=self._format is _Sequence)
        except OSError as reason:
            raise FilmError(f"{self.path}: cannot write here: {reason.strerror or reason}") from None
        self.frames, self._failure = 0, None
        return self

    def write(self, image: np.ndarray) -> None:
        """Add a frame: an array (height, width, 3) of uint8."""
        part = self._part
        if part is None:
            raise self._failure or self._not_open()
        image = validate.array("Film.write", "the image", image, "give (H, W, 3) of uint8")
        if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
            raise InputError(f"Film.write: the image has shape {image.shape} of {image.dtype}; give (H, W, 3) of uint8")
        size = validate.size("Film.write", image.shape[1::-1])
        if self.size is not None and self.size != size:
            raise InputError(f"Film.write: the image is {size[0]}x{size[1]}, the film {self.size[0]}x{self.size[1]}")
        self.size = size
        try:
            with self._lock:
                if self._writer is None:
                    self._writer = self._format(part.path, size, self.fps)
                self._writer.write(image)
                self.frames += 1
        except OSError as reason:
            raise self._failed(reason) from None

    @interrupts.held()
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None
    ) -> None:
        try:
            if error is not None:
                try:
                    kept = self._kept()
                except OSError as reason:
                    kept = files.lost_words(self.path, reason)
                if kept:
                    files.say(error, kept)
            elif self._part is None:
                raise self._failure or self._not_open()
            elif self._writer is None:
                raise FilmError(f"{self.path}: no frame was written")
            else:
                self._finish(self._writer, self._part)
        finally:
            self._close()

    def _not_open(self):
        return FilmError(f"{self.path}: the film is not open; write inside `with fs.Film(...) as film:`")

    def _finish(self, writer, part):
        try:
            writer.finish()
            writer.publish(part)
        except OSError as reason:
            raise self._failed(reason) from None

    def _failed(self, reason) -> FilmError:
        """The error for a write that failed, after which the film is closed."""
        with interrupts.held():
            kept = ""
            with contextlib.suppress(OSError):
                kept = self._kept()
            kept = kept or "nothing is kept"
            self._failure = FilmError(f"{self.path}: writing failed, {kept}: {reason.strerror or reason}")
            self._close()
            return self._failure

    def _kept(self):
        """Keep the frames so far under a free name; returns the message about them, "" if there are none."""
        if self._part is None or self._writer is None or not self.frames or self.still:
            return ""
        self._writer.finish()
        name = self._writer.keep(self._part)
        return files.kept_words(name, self.frames, self.planned, "frame")

    def _close(self):
        """Close what is open, and remove temporary files."""
        if self._writer is not None:
            self._writer.abandon()
        if self._part is not None:
            self._part.discard()
        self._part = self._writer = None


class Writer(Protocol):
    """Writes the frames of one film into a part of a file, or of a folder: one class a format.

    Made of the part's path, the frames' (width, height) and the frames per second. Whatever fails raises OSError.
    """

    @staticmethod
    def check(target: pathlib.Path) -> None:
        """Raise InputError, before any work, for a path that this format cannot be written to."""
        ...

    def __init__(self, partial: pathlib.Path, size: tuple[int, int], fps: float): ...

    def write(self, image: np.ndarray) -> None:
        """Add a frame, (height, width, 3) uint8."""
        ...

    def finish(self) -> None:
        """Bring what was written to its end, so that it can be published or kept."""
        ...

    def publish(self, part: files.Part) -> None:
        """Let it appear under its name."""
        ...

    def keep(self, part: files.Part) -> pathlib.Path:
        """Let it appear under a name that is free; returns which."""
        ...

    def abandon(self) -> None:
        """Let go of what is open, finished or not."""
        ...


class _Encoded:
    """Frames piped into ffmpeg."""

    options: Sequence[str] = ()
    even = False

    @staticmethod
    def check(target):
        files.checked_target("Film", target)

    def __init__(self, partial, size, fps):
        self.partial = partial
        encoder = _ffmpeg()
        width, height = (n + n % 2 for n in size) if self.even else size
        source = f"-f rawvideo -pix_fmt rgb24 -s {width}x{height} -r {_rate(fps)} -i -".split()
        self.words = tempfile.TemporaryFile()
        process = subprocess.Popen(
            # ffmpeg would take what stands before a colon for a protocol.
            [encoder, "-y", "-v", "error", "-nostats", *source, *self.options, f"file:{partial}"],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=self.words,
            # An interrupt from the keyboard is for us to handle.
            start_new_session=True,
            # A file-size limit is then an error that ffmpeg reports, not a silent death.
            restore_signals=False,
        )
        assert process.stdin is not None  # a pipe was asked for
        self.process, self.input = process, process.stdin

    def write(self, image):
        if self.even:
            image = np.pad(image, ((0, image.shape[0] % 2), (0, image.shape[1] % 2), (0, 0)), mode="edge")
        try:
            self.input.write(np.ascontiguousarray(image).data)
        except OSError:
            self.process.wait()
            raise OSError(self._said()) from None

    def finish(self):
        try:
            self.input.close()
        except OSError:
            self.process.wait()
        if self.process.wait() != 0:
            raise OSError(self._said())

    def _said(self):
        """The last message of ffmpeg, or its exit status."""
        self.words.seek(0)
        lines = [line.strip() for line in self.words.read().decode(errors="replace").splitlines() if line.strip()]
        status = self.process.returncode
        ended = f"was killed by signal {-status}" if status < 0 else f"ended with status {status}"
        return "ffmpeg says: " + "; ".join(lines[-2:]) if lines else f"ffmpeg {ended}"

    def publish(self, part):
        part.publish()

    def keep(self, part):
        return part.keep()

    def abandon(self):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        if not self.input.closed:
            try:
                self.input.close()
            except OSError:
                pass
        self.words.close()


class _Mp4(_Encoded):
    options = _MP4
    even = True  # what chroma of half resolution needs


class _Gif(_Encoded):
    """GIF counts hundredths of a second, and browsers play a delay below two of them as ten."""

    options = _GIF
    fastest = 50.0

    def __init__(self, partial, size, fps):
        super().__init__(partial, size, min(fps, self.fastest))
        self.share = min(self.fastest / fps, 1.0)
        self.given = self.kept = 0
        self.image = None

    def write(self, image):
        """Keep the frame if a fiftieth of a second ends with it, for as long as one lasts."""
        self.given += 1
        self.image = image
        if round(self.given * self.share) > self.kept:
            self.kept += 1
            super().write(image)

    def finish(self):
        if not self.kept:
            super().write(self.image)
        super().finish()


class _Picture:
    """The last frame as one PNG."""

    check = _Encoded.check
    publish = _Encoded.publish
    keep = _Encoded.keep

    def __init__(self, partial, size, fps):
        self.partial = partial
        self.image = None

    def write(self, image):
        self.image = image.copy()

    def finish(self):
        _write_png(self.partial, self.image)

    def abandon(self):
        pass


class _Sequence:
    """Numbered PNGs, made in a folder of their own and moved to their places at the end."""

    @staticmethod
    def check(target):
        numbered = _is_pattern(target)
        if not numbered and os.path.lexists(target) and not os.path.isdir(target):
            raise InputError(f"Film: {str(target)!r} is a file; give a folder, or {KNOWN}")
        # The first frame, or the folder for all, stands for what is to be made.
        files.checked_target("Film", _frame(target, 0) if numbered or os.path.isdir(target) else target)

    def __init__(self, partial, size, fps):
        self.partial = partial
        self.count = 0

    def write(self, image):
        _write_png(self.partial / str(self.count), image)
        self.count += 1

    def finish(self):
        pass

    def publish(self, part):
        target = part.target
        if not _is_pattern(target):
            target.mkdir(exist_ok=True)
        frames = [_frame(target, index) for index in range(self.count)]
        for frame in frames:
            if os.path.isdir(frame):
                raise OSError(f"{frame} is a folder")
        for index, frame in enumerate(frames):
            os.replace(self.partial / str(index), frame)
        files.appeared.append(part.given)
        after = _frame(target, self.count)
        if after.exists():
            warnings.warn(
                f"{target}: frames of a longer film remain, from {after.name} on", FieldsimWarning, stacklevel=5
            )

    def keep(self, part):
        """Where the frames went: under their own names if none of them was taken, else into a new folder beside."""
        target, given = part.target, part.given
        if any(os.path.lexists(_frame(target, index)) for index in range(self.count)):
            name = target.name.partition("%")[0].rstrip("_-. ") or "frames"
            folder = files.new_folder(target.with_name(name))
            given = part.beside(folder.name)
            target, given = (one / target.name if _is_pattern(target) else one for one in (folder, given))
        elif not _is_pattern(target):
            target.mkdir(exist_ok=True)
        for index in range(self.count):
            if not files.claim(self.partial / str(index), _frame(target, index)):
                raise FileExistsError(f"{_frame(target, index)} has just appeared")
        return given

    def abandon(self):
        pass


def _is_pattern(target):
    return _PATTERN.fullmatch(target.name) is not None


def _frame(target, index):
    """Where a frame of a sequence goes: target is a pattern such as name_%04d.png, or a folder."""
    return target.with_name(target.name % index) if _is_pattern(target) else target / f"frame_{index:04d}.png"


def _write_png(path, image):
    import imageio.v3 as imageio

    # Into memory first: on a full disk an encoder can leave a half-written file without an error.
    path.write_bytes(imageio.imwrite("<bytes>", image, extension=".png"))


def _ffmpeg():
    import imageio_ffmpeg

    try:
        return imageio_ffmpeg.get_ffmpeg_exe()
    except RuntimeError as reason:  # none is there
        raise OSError(str(reason)) from None


def _rate(fps):
    """The rate as a fraction that formats can hold, to seven digits, be it fast or slow."""
    if fps >= 1.0:
        return fractions.Fraction(fps).limit_denominator(1001)
    return 1 / fractions.Fraction(1.0 / fps).limit_denominator(1001)


def _format_of(path) -> type[Writer]:
    """The class that writes `path`."""
    target = pathlib.PurePath(path)
    folder = path.endswith(("/", os.sep))
    if folder and _is_pattern(target):
        raise InputError(f"Film: {path}: give a folder without % in its name, or a pattern without a / at its end")
    if folder or _is_pattern(target) or (not target.suffix and os.path.isdir(path)):
        return _Sequence
    kind = target.suffix.lower()
    if kind == ".png" and "%" in target.name:
        raise InputError(f"Film: {path}: a numbered sequence is written name_%04d.png; a single picture has no % in it")
    try:
        return {".mp4": _Mp4, ".gif": _Gif, ".png": _Picture}[kind]
    except KeyError:
        raise InputError(f"Film: {path}: this ending is not known; give {KNOWN}") from None
