"""The formats of films and pictures: writers of one file each, or of a sequence of them.

mp4 and GIF are encoded by the ffmpeg that comes with imageio-ffmpeg, run here as a process: imageio's own writer drops
ffmpeg's exit status and words, so that a full disk would pass for a finished film.
"""

import fractions
import os
import pathlib
import re
import subprocess
import tempfile
import warnings
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from fieldsim import files
from fieldsim.errors import FieldsimWarning, InputError

KNOWN = "name.mp4, name.gif, name.png (one picture), folder/ or name_%04d.png (a sequence)"

# Names of a sequence's pictures.
_PATTERN = re.compile(r"[^%]*%0?[0-9]?d[^%]*\.png", re.IGNORECASE | re.DOTALL)

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


class Writer(Protocol):
    """Writes the frames of one film into a part of a file, or of a folder: one class a format.

    Made of the part's path, the frames' (width, height) and the frames per second. Whatever fails raises OSError.
    still: whether only the last frame is kept; in_folder: whether the part is a folder.
    """

    still: bool
    in_folder: bool

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

    still = in_folder = False

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

    still, in_folder = True, False

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

    still, in_folder = False, True

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


def format_of(path) -> type[Writer]:
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
