"""Films: what is written can be read back; what fails leaves nothing behind."""

import contextlib
import functools
import pathlib
import re
import signal
import subprocess
import sys
import textwrap

import imageio.v3 as imageio
import imageio_ffmpeg
import numpy as np
import pytest

from fieldsim.errors import FieldsimWarning, FilmError, InputError
from fieldsim.render.output.video import Film


def frames(count, width, height):
    """Smooth pictures, each of its own brightness."""
    row, column = np.mgrid[:height, :width]
    for i in range(count):
        picture = np.stack([255 * column // width, 255 * row // height, np.full_like(row, 20 + 15 * i)], axis=-1)
        yield picture.astype(np.uint8)


def written(path, count=6, size=(64, 36), fps=25):
    with Film(path, size, fps) as film:
        for image in frames(count, *size):
            film.write(image)
    return np.array(list(frames(count, *size)))


def write_then(path, error):
    with Film(path, (64, 36), 25) as film:
        for image in frames(3, 64, 36):
            film.write(image)
        raise error


def read_mp4(path, width, height):
    """Frames, and what ffmpeg says of the file. (imageio's reader leaves its pipes to the garbage collector.)"""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(command, capture_output=True, check=True)
    return np.frombuffer(done.stdout, np.uint8).reshape(-1, height, width, 3), done.stderr.decode()


def names(folder):
    return sorted(p.name for p in pathlib.Path(folder).iterdir())


def test_mp4_reads_back(tmp_path):
    path = tmp_path / "a.mp4"
    expected = written(path)
    read, about = read_mp4(path, 64, 36)
    assert read.shape == expected.shape
    # Chroma has half resolution and the values are quantised: a few levels.
    assert np.abs(read.astype(int) - expected).mean() < 4
    assert re.search(r"Video: h264 .*yuv420p\(tv, bt709, progressive\), 64x36.*25 fps", about)
    assert names(tmp_path) == ["a.mp4"]
    # The index stands before the pictures, so that a browser can start to play at once.
    content = path.read_bytes()
    assert content.index(b"moov") < content.index(b"mdat")


def test_odd_sizes_are_padded_with_their_edge(tmp_path):
    expected = written(tmp_path / "a.mp4", size=(63, 37))
    read, _ = read_mp4(tmp_path / "a.mp4", 64, 38)
    assert len(read) == 6
    assert np.abs(read[:, :37, :63].astype(int) - expected).mean() < 4
    assert np.abs(read[:, 37].astype(int) - read[:, 36]).mean() < 4


def test_the_smallest_film(tmp_path):
    written(tmp_path / "a.mp4", count=1, size=(1, 1))
    assert len(read_mp4(tmp_path / "a.mp4", 2, 2)[0]) == 1


def test_gif_reads_back_and_loops(tmp_path):
    expected = written(tmp_path / "a.gif", fps=20)
    read = imageio.imread(tmp_path / "a.gif")
    assert read.shape == expected.shape
    # 256 colours a frame, dithered.
    assert np.abs(read.astype(int) - expected).mean() < 8
    about = imageio.immeta(tmp_path / "a.gif")
    assert (about["loop"], about["duration"]) == (0, 50)


def test_png_is_the_last_frame(tmp_path):
    expected = written(tmp_path / "a.png", size=(7, 5))
    np.testing.assert_array_equal(imageio.imread(tmp_path / "a.png"), expected[-1])


@pytest.mark.parametrize(("path", "first"), [("frames/", "frames/frame_0000.png"), ("shot_%03d.png", "shot_000.png")])
def test_sequences_are_numbered(tmp_path, path, first):
    expected = written(f"{tmp_path}/{path}", count=3)
    files = sorted(tmp_path.rglob("*.png"))
    assert files[0] == tmp_path / first
    np.testing.assert_array_equal([imageio.imread(f) for f in files], expected)


def test_an_existing_folder_takes_a_sequence_and_older_frames_are_named(tmp_path):
    written(f"{tmp_path}/frames/", count=3)
    with pytest.warns(FieldsimWarning, match=r"frames of a longer film remain, from frame_0002\.png"):
        written(tmp_path / "frames", count=2)


@pytest.mark.parametrize("name", ["a.mp4", "a.gif", "a.png"])
def test_same_frames_same_bytes(tmp_path, name):
    written(tmp_path / name)
    first = (tmp_path / name).read_bytes()
    written(tmp_path / name)
    assert (tmp_path / name).read_bytes() == first


def test_size_may_come_from_the_first_image(tmp_path):
    with Film(tmp_path / "a.mp4") as film:
        film.write(np.zeros((4, 6, 3), np.uint8))
        with pytest.raises(InputError, match="the image is 8x4, the film 6x4"):
            film.write(np.zeros((4, 8, 3), np.uint8))
    assert (film.size, film.frames) == ((6, 4), 1)


def pictures_of(folder, path):
    """The frames in what was written, of 64x36."""
    if path.endswith(".mp4"):
        return read_mp4(folder / path, 64, 36)[0]
    return imageio.imread(folder / path)


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError, SystemExit, InputError])
def test_a_film_left_by_an_error_keeps_its_frames(tmp_path, name, error):
    words = rf"{name} keeps the 3 frames made before"
    with pytest.raises(error) as raised:
        write_then(tmp_path / name, error("wrong"))
    assert re.search(words, " ".join([str(raised.value), *getattr(raised.value, "__notes__", ())]))
    assert names(tmp_path) == [name]
    assert len(pictures_of(tmp_path, name)) == 3


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
def test_what_is_left_of_a_film_replaces_nothing(tmp_path, name):
    written(tmp_path / name)
    before = (tmp_path / name).read_bytes()
    partial, another = name.replace("a.", "a.partial."), name.replace("a.", "a.partial-2.")
    for kept in (partial, another):
        with pytest.raises(KeyboardInterrupt) as raised:
            write_then(tmp_path / name, KeyboardInterrupt)
        assert raised.value.__notes__ == [f"{tmp_path / kept} keeps the 3 frames made before"]
        assert len(pictures_of(tmp_path, kept)) == 3
    assert (tmp_path / name).read_bytes() == before
    assert names(tmp_path) == sorted([name, partial, another])


def test_what_is_left_of_a_film_does_not_replace_what_came_meanwhile(tmp_path):
    def shoot():
        with Film(tmp_path / "a.gif") as film:
            film.write(next(frames(1, 8, 8)))
            (tmp_path / "a.gif").write_bytes(b"another run's")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        shoot()
    assert (tmp_path / "a.gif").read_bytes() == b"another run's"
    assert names(tmp_path) == ["a.gif", "a.partial.gif"]


@pytest.mark.parametrize(
    ("name", "first", "beside"),
    [
        ("frames", "frames/frame_0000.png", "frames.partial/frame_0000.png"),
        ("shot_%04d.png", "shot_0000.png", "shot.partial/shot_0000.png"),
        ("%d.png", "0.png", "frames.partial/0.png"),
    ],
)
def test_a_sequence_left_by_an_error_keeps_its_frames(tmp_path, name, first, beside):
    (tmp_path / "frames").mkdir()
    for kept in (first, beside):
        with pytest.raises(KeyboardInterrupt) as raised:
            write_then(tmp_path / name, KeyboardInterrupt)
        found = sorted((tmp_path / kept).parent.glob("*.png"))
        assert found[0] == tmp_path / kept
        np.testing.assert_array_equal([imageio.imread(path) for path in found], list(frames(3, 64, 36)))
        (note,) = raised.value.__notes__
        assert note.endswith(" keeps the 3 frames made before")
        assert str(pathlib.Path(kept).parent) in note
    assert not list(tmp_path.glob(".*"))


def interrupted(function, *arguments):
    signal.raise_signal(signal.SIGINT)
    return function(*arguments)


def number_of(path):
    if path.suffix == ".mp4":
        return len(read_mp4(path, 64, 36)[0])
    return len(list(path.iterdir())) if path.is_dir() else len(imageio.imread(path))


@pytest.mark.parametrize("name", ["a.mp4", "a.gif", "frames/"])
def test_an_interrupt_at_the_very_end_comes_after_it(tmp_path, monkeypatch, name):
    film = Film(f"{tmp_path}/{name}", (64, 36))
    with pytest.raises(KeyboardInterrupt), film:  # noqa: PT012
        for image in frames(3, 64, 36):
            film.write(image)
        monkeypatch.setattr(film._writer, "finish", functools.partial(interrupted, film._writer.finish))
    assert names(tmp_path) == [name.rstrip("/")]
    assert number_of(tmp_path / name) == 3


@pytest.mark.parametrize("name", ["a.mp4", "a.gif", "frames/"])
def test_a_second_interrupt_loses_nothing(tmp_path, monkeypatch, name):
    film = Film(f"{tmp_path}/{name}", (64, 36))
    first = KeyboardInterrupt()
    with pytest.raises(KeyboardInterrupt), film:  # noqa: PT012
        for image in frames(3, 64, 36):
            film.write(image)
        monkeypatch.setattr(film._writer, "finish", functools.partial(interrupted, film._writer.finish))
        raise first
    assert "keeps the 3 frames" in first.__notes__[0]
    assert number_of(tmp_path / name) == 3


def test_a_still_left_by_an_error_leaves_nothing(tmp_path):
    with pytest.raises(KeyboardInterrupt) as raised:
        write_then(tmp_path / "a.png", KeyboardInterrupt)
    assert not hasattr(raised.value, "__notes__")
    assert names(tmp_path) == []


def test_a_film_is_entered_once_at_a_time(tmp_path):
    film = Film(tmp_path / "a.gif")
    with film:
        with pytest.raises(FilmError, match="the film is open already"):
            film.__enter__()
        film.write(next(frames(1, 8, 8)))
    assert names(tmp_path) == ["a.gif"]


def test_a_dead_encoder_is_a_film_error(tmp_path):
    def shoot():
        with Film(tmp_path / "a.mp4", (640, 360), 25) as film:
            for image in frames(9, 640, 360):
                film.write(image)
                film._writer.process.kill()

    with pytest.raises(FilmError, match=r"a\.mp4: writing failed, nothing is kept: ffmpeg was killed by signal 9"):
        shoot()
    assert names(tmp_path) == []


@pytest.mark.parametrize("name", ["a.mp4", "a.gif", "a.png", "frames/"])
def test_a_full_disk_is_a_film_error(tmp_path, name):
    """A limit on the size of files stands in for the full disk: writes fail in the same way."""
    pytest.importorskip("resource")
    script = """
        import resource, sys
        import numpy as np
        from fieldsim.errors import FilmError
        from fieldsim.render.output.video import Film

        noise = np.random.default_rng(1)
        resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))
        try:
            with Film(sys.argv[1], (160, 90), 25) as film:
                for _ in range(20):
                    film.write(noise.integers(0, 255, (90, 160, 3), dtype=np.uint8))
        except FilmError as error:
            print(error)
    """
    command = [sys.executable, "-c", textwrap.dedent(script), f"{tmp_path}/{name}"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    assert len(done.stdout.splitlines()) == 1
    assert "writing failed, nothing is kept" in done.stdout
    assert "File too large" in done.stdout
    assert names(tmp_path) == []


def test_whole_pictures_of_a_sequence_survive_a_full_disk(tmp_path, monkeypatch):
    def full(path, image):
        path.write_bytes(b"torn")
        if path.name == "2":
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(sys.modules["fieldsim.render.output.formats"], "_write_png", full)
    with pytest.raises(FilmError, match=r"writing failed, .*frames keeps the 2 frames made before: No space left"):
        written(f"{tmp_path}/frames/")
    assert names(tmp_path / "frames") == ["frame_0000.png", "frame_0001.png"]
    assert names(tmp_path) == ["frames"]


def test_a_film_that_failed_takes_no_more_frames(tmp_path):
    def shoot():
        with Film(tmp_path / "a.mp4", (640, 360), 25) as film:
            for image in frames(20, 640, 360):
                with contextlib.suppress(FilmError):
                    film.write(image)
                if film._writer:
                    film._writer.process.kill()

    with pytest.raises(FilmError, match="signal 9"):
        shoot()
    assert names(tmp_path) == []


def test_bad_paths_are_refused_before_any_work(tmp_path):
    with pytest.raises(InputError, match=r"folder .*nowhere' does not exist; create it first"):
        Film(tmp_path / "nowhere" / "a.mp4", (4, 4), 25)
    with pytest.raises(InputError, match=r"a\.avi: this ending is not known; give name\.mp4"):
        Film(tmp_path / "a.avi", (4, 4), 25)
    with pytest.raises(InputError, match="this ending is not known"):
        Film(tmp_path / "film", (4, 4), 25)
    with pytest.raises(InputError, match=r"written name_%04d\.png"):
        Film(tmp_path / "a_%s.png", (4, 4), 25)
    (tmp_path / "b.mp4").mkdir()
    with pytest.raises(InputError, match="this is a folder"):
        Film(tmp_path / "b.mp4", (4, 4), 25)


@pytest.mark.parametrize("size", [(0, 4), (4, -1), (4,), "big", (4.5, 4), (20000, 4), 7])
def test_bad_sizes_are_refused(tmp_path, size):
    with pytest.raises(InputError, match="size is"):
        Film(tmp_path / "a.mp4", size, 25)


def test_bad_images_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"shape \(4, 4\) of float64"), Film(tmp_path / "a.mp4") as film:
        film.write(np.zeros((4, 4)))
    with pytest.raises(FilmError, match="no frame was written"), Film(tmp_path / "a.mp4"):
        pass
    with pytest.raises(FilmError, match="the film is not open"):
        Film(tmp_path / "a.mp4").write(np.zeros((4, 4, 3), np.uint8))
    assert names(tmp_path) == []
