"""Films and pictures: frames streamed into a file that appears under its name only when it is complete.

| path | result |
|---|---|
| `name.mp4` | H.264, plays everywhere; odd sizes are padded by one row or column |
| `name.gif` | loops forever, a palette of its own for every frame; of more than 50 frames per second only 50 are kept |
| `name.png` | one picture: the last frame |
| `folder/` or `name_%04d.png` | a sequence of pictures, numbered from 0 |
"""

import contextlib
import os
import threading
import types

import numpy as np

from fieldsim import files, interrupts, validate
from fieldsim.copies import Uncopied
from fieldsim.errors import FilmError, InputError
from fieldsim.render.output.formats import Writer, format_of
from fieldsim.types import PathLike, RealLike, SizeLike, WholeLike

# Frames per second that films can have.
SLOWEST, FASTEST = 0.01, 1000.0


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
        self._format = format_of(self.path)
        self._format.check(self._target)
        self._part: files.Part | None = None
        self._writer: Writer | None = None
        self._failure: FilmError | None = None
        self._lock = threading.Lock()

    @property
    def still(self) -> bool:
        """Whether only the last frame is kept, so that the others need not be made."""
        return self._format.still

    def __enter__(self) -> "Film":
        if self._part is not None:
            raise FilmError(f"{self.path}: the film is open already; give every `with` a fs.Film of its own")
        try:
            self._part = files.Part(self._target, folder=self._format.in_folder)
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
