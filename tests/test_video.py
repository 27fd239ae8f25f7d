"""Films: what is written can be read back; what fails leaves nothing behind."""

import pathlib
import re
import subprocess
import sys
import textwrap

import imageio.v3 as imageio
import imageio_ffmpeg
import numpy as np
import pytest

from fieldsim.errors import FieldsimWarning, FilmError, InputError
from fieldsim.render.video import Film


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


@pytest.mark.parametrize("name", ["a.mp4", "a.gif", "a.png", "frames/", "shot_%04d.png"])
@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_a_film_left_by_an_error_leaves_nothing(tmp_path, name, error):
    with pytest.raises(error):
        write_then(f"{tmp_path}/{name}", error)
    assert names(tmp_path) == []


def test_a_failed_film_leaves_the_older_one(tmp_path):
    written(tmp_path / "a.mp4")
    before = (tmp_path / "a.mp4").read_bytes()
    with pytest.raises(KeyboardInterrupt):
        write_then(tmp_path / "a.mp4", KeyboardInterrupt)
    assert (tmp_path / "a.mp4").read_bytes() == before
    assert names(tmp_path) == ["a.mp4"]


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
        from fieldsim.render.video import Film

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
